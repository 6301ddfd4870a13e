"""Closed forms for force and capacitance (Hertz, bonded layer, layered half space, parallel plate): oracles and baselines.

All take and give SI. References:

[H]  Hertz (1882), as in Johnson, "Contact Mechanics" (1985), Eq. 4.22-4.24.
[D]  Dimitriadis et al., Biophys. J. 82 (2002) 2798, for the form F = F_Hertz * f(chi), chi = sqrt(R d) / h. Its
     coefficients are up to 16 % wrong; the factor here is a fit to the exact integral equation of the bonded layer.
[HK] Hayes et al., J. Biomech. 5 (1972) 541, the integral equation of the bonded layer.
[G]  Gao, Chiu, Lee, Int. J. Solids Struct. 29 (1992) 2471, weight of a layer in the compliance under a contact.
[Z]  Zhu, Tairych, Rosset, Anderson, SPIE EAPAD (2019), Eq. 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.response import Forward, OutOfRangeError, Response
from models.sensor import Design, FloatArray, Scalar

#: Largest chi = sqrt(R d) / h at which the fit of `bonded_layer_factor` is valid.
CHI_MAX = 1.69

#: Largest total thickness over the disc's radius at which the errors that `ClosedForm` states hold against finite elements. At
#: 0.17 its force is up to 12 % too high and its capacitance change up to 26 % off; at 0.35 14 % and 80 %, at 2 73 % and 94 %
#: (balls of 2 and 5 mm, discs of 5 and 10 mm, to a depth of 0.3 R).
THICKEST = 0.25

#: Version of the formulas of `ClosedForm`: to be raised with every change that changes its numbers.
_FORMULAS = 1

# Least-squares fit to the exact solution of [HK] for nu = 0.5, 0 <= chi <= 1.69, largest error 0.25 %.
_BONDED = np.array([1.0, 1.12696, 1.48170, 1.89668, 0.07652, -0.72302, 0.26060])


def hertz_force(young_modulus: Scalar, radius: Scalar, depth: FloatArray) -> FloatArray:
    """Force of a rigid sphere on an incompressible elastic half space, F = (16/9) E sqrt(R) d^1.5 ([H], nu = 0.5).

    Parameters
    ----------
    young_modulus : [Pa].
    radius : [m], of the sphere.
    depth : [m], indentation. All three are broadcast against each other.

    Returns
    -------
    Force [N]; zero before contact. Small strain, a << R.
    """
    d = np.maximum(depth, 0.0)
    return np.asarray(16 / 9 * young_modulus * np.sqrt(radius) * d**1.5, dtype=float)


def bonded_layer_factor(chi: FloatArray) -> FloatArray:
    """F / F_Hertz of an incompressible elastic layer bonded to a rigid base, chi = sqrt(R d) / h ([D], [HK]).

    Valid for 0 <= chi <= `CHI_MAX`, within 0.25 % of the integral equation.

    Raises
    ------
    OutOfRangeError
        If a chi lies outside the fit.
    """
    if np.any((chi < 0) | (chi > CHI_MAX * (1 + 1e-9))):
        raise OutOfRangeError(f"chi = sqrt(R d)/h must lie in 0..{CHI_MAX}, got {np.max(chi):.4g}")
    return np.asarray(np.polynomial.polynomial.polyval(chi, _BONDED), dtype=float)


def _bonded_kernel(x: FloatArray, nu: float) -> FloatArray:
    """M(x) of [HK]: under a pressure J0(k r) the surface of the layer sinks by 2 (1 - nu^2)/E M(k h)/k J0(k r)."""
    # [(3 - 4 nu) sinh 2x - 2x] / [(3 - 4 nu) cosh 2x + 2 x^2 + 5 - 12 nu + 8 nu^2], written without overflow.
    kappa, e = 3 - 4 * nu, np.exp(-2 * x)
    below = kappa * (1 + e**2) + (4 * x**2 + 2 * (5 - 12 * nu + 8 * nu**2)) * e
    return np.asarray((kappa * (1 - e**2) - 4 * x * e) / below)


def ball_on_bonded_layer(contact: float, radius: float, poisson_ratio: float) -> tuple[float, float]:
    """Small-strain depth and force of a frictionless ball on a compressible layer that is bonded to a rigid base ([HK]).

    In the form of Lebedev and Ufliand, for a sphere rather than a paraboloid, with K(u) = int_0^inf (1 - M(x)) cos(u x) dx:
    phi(t) - (1/pi) int_0^a [K(t - s) + K(t + s)] phi(s) ds = (2/pi) [d - (t/2) ln((R + t)/(R - t))], phi(a) = 0,
    F = pi E/(1 - nu^2) int_0^a phi.

    Parameters
    ----------
    contact : radius a of the contact, up to about 4, and
    radius : R of the ball, both over the thickness of the layer.
    poisson_ratio : nu of the layer.

    Returns
    -------
    Depth over the thickness h, and force over E h^2.
    """
    a, n = contact, 80
    x, wx = np.polynomial.legendre.leggauss(800)
    x, wx = 25 * (x + 1), 25 * wx
    weight = wx * (1 - _bonded_kernel(x, poisson_ratio))
    t, w = np.polynomial.legendre.leggauss(n)
    t, w = a * (t + 1) / 2, a * w / 2
    edge = np.append(t, a)
    # cos(x (t - s)) + cos(x (t + s)) = 2 cos(x t) cos(x s)
    waves = np.cos(np.multiply.outer(edge, x))
    kernel = 2 / np.pi * (waves * weight) @ waves[:n].T * w
    given = 2 / np.pi * np.stack([np.ones(n + 1), -edge / 2 * np.log((radius + edge) / (radius - edge))], axis=1)
    flat, curved = np.linalg.solve(np.eye(n) - kernel[:n], given[:n]).T
    depth = -(given[n, 1] + kernel[n] @ curved) / (given[n, 0] + kernel[n] @ flat)
    return float(depth), float(np.pi / (1 - poisson_ratio**2) * w @ (depth * flat + curved))


def layer_weight(ratio: FloatArray) -> FloatArray:
    """Share of the top layer in the compliance under a contact, ratio = layer thickness / contact radius ([G], nu = 0.5).

    I0(x) = (2/pi) arctan x - (1/pi) x / (1 + x^2): 0 for a very thin layer, 1 for a thick one.
    """
    return np.asarray(2 / np.pi * np.arctan(ratio) - ratio / (np.pi * (1 + ratio**2)))


def effective_modulus(design: Design, depth: FloatArray) -> FloatArray:
    """Modulus of the homogeneous stack that would feel as stiff as sensor on padding: layer and padding in series ([G]).

    Exact for equal moduli; within about 10 % for a ratio of two.

    Parameters
    ----------
    design : one, or a batch of draws.
    depth : [m], indentation, shape (n_depth,) or (n_draw, n_depth): the deeper, the more the padding counts.

    Returns
    -------
    Modulus [Pa], shape (n_draw, n_depth).
    """
    p = {k: np.asarray(v)[:, None] for k, v in design.draws().parameters().items()}
    contact = np.sqrt(p["indenter_radius"] * np.maximum(depth, 1e-12))
    weight = layer_weight(p["sensor_thickness"] / contact)
    # With little padding left the padding's share is bounded by what there is of it.
    padding = layer_weight((p["sensor_thickness"] + p["padding_thickness"]) / contact) - weight
    share = padding / (padding + weight)
    return np.asarray(1 / ((1 - share) / p["young_modulus"] + share / p["padding_young_modulus"]), dtype=float)


def plate_capacitance_change(thickness: Scalar, radius: Scalar, electrode_radius: Scalar, depth: FloatArray) -> FloatArray:
    """C/C0 - 1 of a stack that gives way only straight under the sphere (Winkler), by parallel rings ([Z]).

    With local compression u(r) = d - r^2/(2R) of a stack of thickness h, integrating 2 r dr / a_e^2 [h/(h-u) - 1] over the
    contact gives (2R/a_e^2) [-h ln(1 - d/h) - d]. Leaves out the thickening around the contact and friction of the bond: an
    order of magnitude (within a factor of about two for full-disc electrodes), used to make the surrogate's task smooth.

    Parameters
    ----------
    thickness : h [m], of the whole stack.
    radius : R [m], of the sphere.
    electrode_radius : a_e [m].
    depth : d [m], below h. All broadcast against each other.

    Returns
    -------
    The change [1]; zero before contact.
    """
    d = np.maximum(depth, 0.0)
    bracket = -thickness * np.log1p(-d / thickness) - d
    return np.asarray(2 * radius / np.asarray(electrode_radius) ** 2 * bracket, dtype=float)


@dataclass(frozen=True)
class ClosedForm:
    """The closed forms as a `Forward`: instant and rough, for first looks and tests.

    Force: Hertz times `bonded_layer_factor` with `effective_modulus`, small strain. Capacitance: `plate_capacitance_change`.
    Covers chi <= 1.69 and d <= 0.6 (h_s + h_p). It claims an error of 10 % of force and 50 % of the capacitance change
    along the whole sweep, which is what it deserves against finite elements up to a total thickness of `THICKEST` disc radii;
    `caution` says so of what is thicker.
    """

    name: str = "closed form"
    force_error: float = 0.10
    capacitance_error: float = 0.50

    @property
    def identity(self) -> str:
        """Version of the formulas, and the errors it claims: see `models.response.Forward.identity`."""
        return f"closed form, formulas {_FORMULAS}, errors {float(self.force_error)!r} {float(self.capacitance_error)!r}"

    def max_depth(self, design: Design) -> FloatArray:
        """Largest depth [m] covered, shape (n_draw,)."""
        batch = design.draws()
        h = np.asarray(batch.total_thickness)
        limit = np.minimum(0.6 * h, CHI_MAX**2 * h**2 / np.asarray(batch.indenter.radius))
        extra = (np.asarray(batch.indenter.friction_coefficient) > 0) | (np.asarray(batch.sensor.stiffening) > 0)
        return np.where(extra | batch.padding_is_compressible | (batch.base != "bonded"), 0.0, limit)

    def outside(self, design: Design, depth: FloatArray) -> str:
        """See `Forward.outside`."""
        if design.base != "bonded":
            return f'the closed form knows layers on a bonded base alone; base must be "bonded", got "{design.base}"'
        if np.any(np.asarray(design.indenter.friction_coefficient) > 0):
            return "the closed form is frictionless; friction_coefficient must be 0"
        if np.any(np.asarray(design.sensor.stiffening) > 0):
            return "the closed form knows neo-Hookean layers alone; stiffening must be 0"
        if np.any(design.padding_is_compressible):
            ratio = float(np.min(design.padding_poisson_ratio))
            return (
                f"the closed form knows incompressible layers alone; padding_poisson_ratio must be 0.5, got {ratio:.4g} "
                '(the model "fem" takes any)'
            )
        limit = self.max_depth(design)
        deepest = np.max(np.broadcast_to(depth, (limit.size, np.shape(depth)[-1])), axis=-1)
        worst = int(np.argmax(deepest - limit))
        if deepest[worst] > limit[worst] * (1 + 1e-9):
            return f"the closed form covers depths up to {limit[worst] * 1e3:.4g} mm here, got {deepest[worst] * 1e3:.4g} mm"
        return ""

    def respond(self, design: Design, depth: FloatArray) -> Response:
        """See `Forward.respond`; with the errors stated as `force_error` and `capacitance_error`."""
        if reason := self.outside(design, depth):
            raise OutOfRangeError(reason)
        batch = design.draws()
        p = {k: np.asarray(v)[:, None] for k, v in batch.parameters().items()}
        h = p["sensor_thickness"] + p["padding_thickness"]
        d = np.maximum(np.broadcast_to(depth, (h.shape[0], np.shape(depth)[-1])), 0.0)
        chi = np.sqrt(p["indenter_radius"] * d) / h
        force = hertz_force(effective_modulus(batch, d), p["indenter_radius"], d) * bonded_layer_factor(chi)
        change = plate_capacitance_change(h, p["indenter_radius"], p["electrode_radius"], d)
        c0 = np.broadcast_to(np.asarray(batch.rest_capacitance, dtype=float), h.shape[:1])
        response = Response(
            depth=np.broadcast_to(depth, d.shape).astype(float),
            force=force,
            contact_radius=np.sqrt(p["indenter_radius"] * d),
            capacitance=c0[:, None] * (1 + change),
            rest_capacitance=c0,
            force_error=self.force_error * force[..., None],
            capacitance_error=self.capacitance_error * (c0[:, None] * change)[..., None],
        )
        return response if design.is_batch else response.draw(0)


def caution(forward: Forward, design: Design) -> str:
    """Say that a closed form is asked beyond where its stated errors hold; nothing for other models, or where they hold.

    Parameters
    ----------
    forward : any model.
    design : one, or a batch of draws.
    """
    if not isinstance(forward, ClosedForm):
        return ""
    batch = design.draws()
    ratio = float(np.max(np.asarray(batch.total_thickness) / np.asarray(batch.sensor.radius)))
    if ratio <= THICKEST:
        return ""
    return (
        f"the closed form takes the layers as far wider than thick, and the errors that it states hold up to a total thickness "
        f"of {THICKEST:g} disc radii; here it is asked at {ratio:.2g}, where its force is too high and its capacitance change "
        'several times too small. Use the model "surrogate" or "fem"'
    )
