"""A solution of the finite elements in, a figure of the deformed cross-section through the axis out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from calib.report.deformed.colours import FieldName, scale_of
from calib.report.deformed.outline import LINES, MM, caption, material_lines, meridian, mirrored, refined, tip_height
from calib.report.style import GREY, INK, styled_figure
from models.fem import Solution
from models.fem.fields import Fields, fields_of, sheet
from models.layers import LayeredDesign, Profile
from models.sensor import Base, FloatArray

_METAL = "#c9ced6"


@styled_figure
def cross_section_figure(solution: Solution, step: int = -1, field: FieldName = "pressure") -> Figure:
    """Draw the deformed sensor cut through its axis, coloured by a field, with indenter, layers, electrodes and base.

    A disc much wider than the contact is shown around the contact only. What lies beyond the colours are the extreme 0.2 % of
    the area shown, such as corners where the stress has no bound.

    Parameters
    ----------
    solution : with at least one state.
    step : index into its states; negative ones count from the end.
    field : what to colour by, see `models.fem.fields.Fields`.

    Raises
    ------
    ValueError
        If there is no such step or field.
    """
    fields, design = fields_of(solution, step), solution.design
    half = _half_width(solution)
    scale = scale_of(fields, field, half)
    names = [_layer_name(design, k) for k in range(len(design.layers))]

    # All margins in inches, so that nothing depends on the aspect of the section.
    width, left, below, above = 7.2, 0.55, 1.05, 0.32
    across = width - left - 0.3 - 0.067 * max(len(name) for name in names)
    inch = 2 * half / across
    low, high = -0.19 * inch, design.thickness + 0.75 * inch
    tall = (high - low) / inch
    height = tall + below + above
    fig = Figure(figsize=(width, height))
    ax = fig.add_axes((left / width, below / height, across / width, tall / height))
    ax.set_xlim(-half * MM, half * MM)
    ax.set_ylim(low * MM, high * MM)
    ax.grid(False)

    for layer in range(len(design.layers)):
        r, z, value = (refined(sheet(fields, v, layer)) for v in (fields.r, fields.z, getattr(fields, field)))
        filled = ax.pcolormesh(
            MM * mirrored(r, -1),
            MM * mirrored(z),
            scale.factor * mirrored(value),
            shading="gouraud",
            cmap=scale.colours,
            norm=Normalize(scale.low, scale.high),
            rasterized=True,
        )
    lines = material_lines(solution, step)
    for kind, (r, z) in lines:
        ax.plot(MM * mirrored(r, -1), MM * mirrored(z), gid=kind, **LINES[kind])
    _draw_indenter(ax, design, tip_height(solution, step), inch)
    _draw_base(ax, design.base)
    _name_layers(ax, fields, names, inch)

    beyond = f"; the disc ends at {MM * design.radius:g} mm" if half < np.max(fields.r) else ""
    ax.set_xlabel(f"radius (mm){beyond}")
    ax.set_ylabel("height (mm)")
    ax.set_yticks([t for t in ax.get_yticks() if 0 <= t <= high * MM])
    ax.set_title(caption(solution, step))
    # An electrode hides the interface it lies on.
    electrodes = [x for d in design.dielectrics for x in (d.lower, d.upper)]
    faces = np.cumsum([x.thickness for x in design.layers])[:-1]
    bare = [design.electrode_radius < half or not np.any(np.isclose(face, electrodes)) for face in faces]
    kinds = ["electrode", "interface"] if any(bare) else ["electrode"]
    named = {"electrode": "electrode", "interface": "layer interface"}
    fig.legend(
        [Line2D([], [], **LINES[k]) for k in kinds],
        [named[k] for k in kinds],
        loc="center left",
        bbox_to_anchor=(left / width, 0.3 / height),
        bbox_transform=fig.transFigure,
        borderpad=0,
        borderaxespad=0,
    )
    bar = fig.add_axes(((left + 0.45 * across) / width, 0.4 / height, 0.55 * across / width, 0.11 / height))
    fig.colorbar(filled, cax=bar, orientation="horizontal", extend=scale.extend)
    bar.set_xlabel(scale.label, labelpad=2)
    bar.grid(False)
    return fig


def _half_width(solution: Solution) -> float:
    """Half of the width of the section shown [m], the same for every step: the whole disc, or the contact's surroundings."""
    design, units = solution.design, solution.units
    contact = max(s.contact_radius for s in solution.states) * units.length
    wanted = max(2.2 * contact, 1.2 * design.profile.flat_radius, design.thickness)
    u_r = [s.u.reshape(solution.model.mesh.r.size, -1, 2)[-1, :, 0] for s in solution.states]
    whole = 1.03 * (design.radius + max(0.0, float(np.max(u_r))) * units.length)
    return whole if whole < 1.6 * wanted else wanted


def _draw_indenter(ax: Axes, design: LayeredDesign, tip: float, inch: float) -> None:
    half, high = ax.get_xlim()[1] / MM, ax.get_ylim()[1] / MM
    r, z = meridian(design.profile, high + 0.2 * inch - tip)
    x, y = MM * mirrored(r, -1), MM * (tip + mirrored(z))
    ax.fill(x, y, facecolor=_METAL, edgecolor="none", zorder=6)
    ax.plot(x, y, color=INK, lw=0.9, zorder=6, gid="indenter")
    # The name in two lines at most, inside where it fits, else beside.
    words = _indenter_name(design.profile).split(", ")
    at = high - 0.2 * inch
    within = min(design.profile.radius_at(at - 0.1 * inch - tip), half) / inch
    for lines in (1, 2):
        text = ", ".join(words) if lines == 1 else words[0] + "\n" + ", ".join(words[1:])
        if max(len(t) for t in text.split("\n")) * 0.066 < 2 * within:
            ax.text(0, MM * at, text, ha="center", va="center", fontsize=8.5, zorder=7)
            return
    outside = design.profile.radius_at(high - tip) + 0.1 * inch
    ax.text(MM * outside, MM * at, ", ".join(words), ha="left", va="center", fontsize=8.5, zorder=7)


def _indenter_name(profile: Profile) -> str:
    def mm(x: float) -> str:
        return f"{x * MM:.3g} mm"

    b, rho, angle = profile.flat_radius, profile.rounding_radius, profile.flank_angle
    if angle == np.pi / 2:
        return f"flat punch, radius {mm(b + rho)}, edge {mm(rho)}" if b > 0 else f"sphere, radius {mm(rho)}"
    half_angle = f"half-angle {90 - np.degrees(angle):.3g}°"
    return f"blunt cone, {half_angle}, face {mm(b)}, edge {mm(rho)}" if b > 0 else f"cone, {half_angle}, tip {mm(rho)}"


def _draw_base(ax: Axes, base: Base) -> None:
    (left, right), low = ax.get_xlim(), ax.get_ylim()[0]
    ax.add_patch(Rectangle((left, low), right - left, -low, facecolor="white", edgecolor=GREY, hatch="/////", lw=0, zorder=2))
    ax.plot([left, right], [0, 0], color=INK, lw=1.2, zorder=4)
    box = {"facecolor": "white", "edgecolor": "none", "pad": 1.2}
    ax.text(0, low / 2, f"{base} base", ha="center", va="center", fontsize=8.5, bbox=box, zorder=5)


def _layer_name(design: LayeredDesign, k: int) -> str:
    layer = design.layers[k]
    return f"{layer.name or f'layer {k + 1}'}, {layer.young_modulus * 1e-6:.3g} MPa"


def _name_layers(ax: Axes, fields: Fields, names: Sequence[str], inch: float) -> None:
    """Names to the right of the picture, each with a line to its layer, pushed apart where layers are thin."""
    half, high = ax.get_xlim()[1] / MM, ax.get_ylim()[1] / MM
    ends = []
    for k in range(len(names)):
        r, z = sheet(fields, fields.r, k), sheet(fields, fields.z, k)
        middle = r.shape[1] // 2
        ends.append((min(half, r[-1, middle]), np.interp(half, r[:, middle], z[:, middle])))
    heights = _apart([end[1] for end in ends], 0.16 * inch, 0.05 * inch, high)
    for name, end, height in zip(names, ends, heights, strict=True):
        ax.annotate(
            name,
            (MM * end[0], MM * end[1]),
            (MM * (half + 0.2 * inch), MM * height),
            va="center",
            fontsize=8.5,
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": GREY, "lw": 0.7, "shrinkA": 1, "shrinkB": 0},
        )


def _apart(wanted: Sequence[float], distance: float, low: float, high: float) -> FloatArray:
    """Increasing heights at least `distance` apart, close to the `wanted` ones, from `low` to about `high`."""
    steps = distance * np.arange(len(wanted))
    # Of all heights with the distance taken out that increase, the nearest: pool neighbours that are in the wrong order.
    pools: list[list[float]] = []
    for x in np.asarray(wanted) - steps:
        pools.append([float(x)])
        while len(pools) > 1 and np.mean(pools[-2]) > np.mean(pools[-1]):
            pools[-2:] = [pools[-2] + pools[-1]]
    free = np.concatenate([np.full(len(p), np.mean(p)) for p in pools])
    return np.asarray(np.clip(free, low, max(low, high - steps[-1])) + steps)
