"""From a design and depths to curves at once: small networks over the dimensionless groups, polynomials in depth, own error.

With one material law F/(mu R^2) and C/C0 depend only on h_s/R, h_p/R, a/R, E_p/E (and t_d/h_s, a_e/a for C) and d/R; the moduli
and the permittivity scale exactly. Along a path the variable is s = sqrt(d / reach), reach(design) a smooth minimum of R/2 and
of the depth at which a layer is thinned to 40 %. Then

    log F = log F_closed + s p_F(s),     log(C/C0 - 1) = log c_closed + p_C(s),     log a_c = log sqrt(R d) + s p_a(s)

with polynomials p whose coefficients are networks of the groups. So C = C0 and F = 0 at no indentation, F goes over into Hertz'
limit there, and everything is smooth in depth. The error of log F and that of C/C0 - 1 over C/C0 - 1 + delta are stated, with
delta = 5e-5 a change that no instrument sees: covariances sigma(s) rho(s, s') sigma(s') along the path, with sigma a network,
too, and rho the correlation of what the fit missed on paths kept out of it (`models.surrogate.fitting`).
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from importlib.resources import as_file, files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np

from models.response import Asked, OutOfRangeError, Response
from models.seal import sealed, unsealed
from models.sensor import BoolArray, Design, FloatArray
from models.surrogate import domain
from models.surrogate.coordinates import (
    N_DEPTH_TERMS,
    N_MECHANICAL,
    depth_terms,
    electric_features,
    share_of_family,
    smooth_end,
    with_own,
)
from models.surrogate.domain import DEPTH, GAP, OWN, PADDING, PATH, SENSOR, WIDTH
from models.surrogate.families import FAMILIES, NEO_HOOKEAN, Family
from models.surrogate.groups import BASE_FRICTION, Values
from models.surrogate.network import Network, network_from
from models.surrogate.pressed import N_ERROR_TERMS, SurrogateCurves
from models.surrogate.shapes import Shapes

# Of the file, and of the formulas that turn its networks into curves: to be raised when either changes. What fades towards
# first touch, means of several networks, signed changes, and the end at 1 of a base's friction, by which the share of its
# family is measured, came after all others, whose files and identities stayed.
_FORMAT = 3
_FORMAT_WITH_FADE = 4
_FORMAT_SIGNED = 5
_FORMAT_OF_BASE_FRICTION = 6

# Relative rounding that a bound forgives.
_SLACK = 1e-9


@dataclass(frozen=True, eq=False)
class Surrogate:
    """The fast `Forward`: networks that have learnt finite-element curves, with the error that they still have.

    Refuses what lies outside its training range.

    The surrogate of a family has networks of its own that add to the coefficients of another's, its `base`, on the same scale
    of depth: in proportion to the groups that the family has of its own (1/J_m of Gent's law, friction), so that it goes over
    into the base where they vanish, and, in a family that fades, towards first touch.

    Attributes
    ----------
    end : network from mechanical features to log(d / h) where a layer is thinned to 40 %, or the finite elements end.
    mechanics : from mechanical features to the coefficients of p_F and p_a, (n, 2 * N_DEPTH_TERMS) side by side.
    capacitance : from electric features to those of p_C.
    force_sd, capacitance_sd : from features to the N_ERROR_TERMS of the logarithm of the error's standard deviation.
    force_modes, capacitance_modes : (n_mode, N_MODE_TERMS), modes of the error's correlation along s.
    provenance : where it comes from: finite-element settings, training set and its hash, versions, date, own error.
    family : what it stands for.
    base : the surrogate that it adds to, of the family that its own `adds_to`; None for one that stands by itself.
    """

    end: Network
    mechanics: Network
    capacitance: Network
    force_sd: Network
    capacitance_sd: Network
    force_modes: FloatArray
    capacitance_modes: FloatArray
    provenance: Mapping[str, str]
    family: Family = NEO_HOOKEAN
    base: Surrogate | None = None

    @property
    def name(self) -> str:
        """Short name for tables and reports."""
        return "surrogate" if self.family.name == NEO_HOOKEAN.name else f"{self.family.name} surrogate"

    @cached_property
    def identity(self) -> str:
        """Hash of all its numbers, base included, whatever its file and provenance: see `models.response.Forward.identity`."""
        content = sha256(self.family.signature.encode())
        for name, array in sorted(self._arrays().items()):
            if name.endswith("provenance"):
                continue
            values = np.ascontiguousarray(array)
            content.update(f"{name} {values.dtype.str} {values.shape} ".encode())
            content.update(values.tobytes())
        return f"surrogate, sha256 {content.hexdigest()}"

    def info(self) -> dict[str, str]:
        """Provenance, error and range as words."""
        ranges = {f"range of {b.name}": f"{b.low:.4g} to {b.high:.4g}" for b in domain.bounds(self.family) if b.high > 0}
        depth = "R/2, or where a layer is thinned to 40 % on the axis if that is first"
        return {**self.provenance, **ranges, "range of d": f"up to {depth}"}

    def ends(self, groups: Values, features: Values) -> tuple[Values, Values]:
        """Where loading curves end.

        Parameters
        ----------
        groups : (n, n_group), inside the range.
        features : of these, (n, >= N_MECHANICAL), see `electric_features`.

        Returns
        -------
        Largest depth covered and the scale of depth, both over R, each (n,).
        """
        own = with_own(features[:, :N_MECHANICAL], groups, self.family)
        thinned = (groups[:, SENSOR] + groups[:, PADDING]) * np.exp(self.end(own)[:, 0])
        if self.base is None:
            return np.minimum(DEPTH, thinned), smooth_end(thinned)
        limit, reach = self.base.ends(self._of_base(groups), features)
        return np.minimum(limit, thinned), reach

    def coefficients(self, groups: Values, features: Values) -> tuple[Values, Values | None]:
        """Coefficients of the polynomials along the path, as the networks say them.

        Parameters
        ----------
        groups : (n, n_group), inside the range.
        features : of these, (n, 13), see `electric_features`.

        Returns
        -------
        Of p_F, p_a and p_C side by side, (n, 3 * N_DEPTH_TERMS), and, in a family that fades, of what is added to these and
        fades, or in one whose change is signed of the share that is added to it, of the same shape; None in others.
        """
        mechanics = self.mechanics(with_own(features[:, :N_MECHANICAL], groups, self.family))
        capacitance = self.capacitance(with_own(features, groups, self.family))
        own = np.concatenate([mechanics, capacitance], axis=1)
        if self.base is None:
            return own, None
        below, fading = self.base.coefficients(self._of_base(groups), features)
        added = np.asarray(share_of_family(groups, self.family)[:, None] * own)
        if self.family.signed:
            of_change = np.arange(added.shape[1]) >= mechanics.shape[1]
            return np.asarray(below + np.where(of_change, 0.0, added)), np.where(of_change, added, 0.0)
        if not self.family.fade:
            return np.asarray(below + added), None
        return below, added if fading is None else np.asarray(fading + added)

    def _of_base(self, groups: Values) -> Values:
        """Groups as the family of the base has them, of the same designs without what this one has more."""
        assert self.base is not None
        kept = [OWN + k for k, group in enumerate(self.family.own) if group in self.base.family.own]
        return groups if len(kept) == len(self.family.own) else groups[:, [*range(OWN), *kept, GAP, WIDTH]]

    def _limit(self, groups: FloatArray, design: Design) -> FloatArray:
        """Largest depth [m] (n_draw,) of the batch `design` with its `groups` (n_draw, n_group); 0 outside the range."""
        inside = self._inside(groups, design)
        safe = _safe(groups, inside)
        return np.where(inside, self.ends(safe, electric_features(safe))[0] * np.asarray(design.indenter.radius), 0.0)

    def _inside(self, groups: FloatArray, design: Design) -> BoolArray:
        """Which of the batch `design` with its `groups` are of the family and in its range, (n_draw,)."""
        return domain.inside(groups, self.family) & self.family.serves(design)

    def max_depth(self, design: Design) -> FloatArray:
        """Largest depth [m] covered, shape (n_draw,); 0 where the design is outside the training range."""
        batch = design.draws()
        return self._limit(domain.groups_of(batch, self.family), batch)

    def outside(self, design: Design, depth: FloatArray) -> str:
        """See `Forward.outside`; the sentence also says how the bound comes about."""
        batch = design.draws()
        if why := self.family.refusal(batch):
            return f"the {self.name} {why}"
        groups = domain.groups_of(batch, self.family)
        bound = domain.violated(groups, self.family)
        if bound:
            return f"the {self.name} covers {bound}"
        limit = self._limit(groups, batch)
        deepest = np.max(np.broadcast_to(depth, (limit.size, np.shape(depth)[-1])), axis=-1)
        worst = int(np.argmax(deepest - limit))
        if deepest[worst] > limit[worst] * (1 + _SLACK):
            why = "half the radius" if limit[worst] >= DEPTH * np.asarray(batch.indenter.radius)[worst] else "60 % compression"
            return (
                f"the {self.name} covers depths up to {limit[worst] * 1e3:.4g} mm for this design ({why}), "
                f"got {deepest[worst] * 1e3:.4g} mm"
            )
        return ""

    def curves(self, design: Design) -> SurrogateCurves:
        """See `models.response.WithCurves`: the networks are asked here, once for all depths."""
        batch = design.draws()
        groups = domain.groups_of(batch, self.family)
        inside = self._inside(groups, batch)
        groups = _safe(groups, inside)
        features = electric_features(groups)
        radius = np.asarray(batch.indenter.radius, dtype=float)
        shapes = self.shapes(groups, features)
        return SurrogateCurves(
            limit=np.where(inside, shapes.limit * radius, 0.0),
            shapes=shapes,
            error_terms=self._error_terms(groups, features),
            radius=radius,
            force_scale=np.asarray(batch.sensor.young_modulus, dtype=float) / 3 * radius**2,
            rest_capacitance=np.asarray(batch.rest_capacitance, dtype=float),
            force_modes=self.force_modes,
            capacitance_modes=self.capacitance_modes,
        )

    def respond(self, design: Design, depth: FloatArray) -> Response:
        """See `Forward.respond`; with the error that the surrogate states."""
        curves = self.curves(design)
        if np.any(np.max(depth, axis=-1) > curves.limit * (1 + _SLACK)):
            raise OutOfRangeError(self.outside(design, depth))
        depths = np.broadcast_to(np.asarray(depth, dtype=float), (curves.limit.size, np.shape(depth)[-1]))
        (response,) = curves.press([Asked(depths, ("force", "contact radius", "capacitance"))])
        return response if design.is_batch else response.draw(0)

    def shapes(self, groups: Values, features: Values) -> Shapes:
        """Dimensionless loading curves.

        Parameters
        ----------
        groups : (n, n_group), inside the range.
        features : of these, (n, 13), see `electric_features`.

        Returns
        -------
        Curves, complex if the arguments are.
        """
        limit, reach = self.ends(groups, features)
        plain, added = self.coefficients(groups, features)
        fading = None if added is None else added.reshape(-1, 3, N_DEPTH_TERMS)
        return Shapes(groups, limit, reach, plain.reshape(-1, 3, N_DEPTH_TERMS), fading, self.family)

    def _error_terms(self, groups: FloatArray, features: FloatArray) -> FloatArray:
        """Terms of the logarithms of the sd of log F and of C/C0 - 1 over itself + delta, (n_draw, 2, N_ERROR_TERMS)."""
        force = self.force_sd(with_own(features[:, :N_MECHANICAL], groups, self.family))
        return np.stack([force, self.capacitance_sd(with_own(features, groups, self.family))], axis=1)

    def own_error(self, groups: FloatArray) -> FloatArray:
        """How wrong the surrogate thinks it is, of designs with groups (n, n_group): a number for force, one for capacitance.

        Returns the rms along the path of the errors' sd, of log F and of C/C0 - 1 over itself + delta, (n, 2).
        """
        logs = self._error_terms(groups, electric_features(groups)) @ depth_terms(PATH, N_ERROR_TERMS)
        return np.asarray(np.sqrt(np.mean(np.exp(2 * logs), axis=2)))

    def save(self, path: Path) -> None:
        """Write as npz with a checksum behind it, with what it adds to; nothing in it is executed on reading."""
        file = io.BytesIO()
        np.savez_compressed(file, **self._arrays())
        path.write_bytes(sealed(file.getvalue()))

    @property
    def _format(self) -> int:
        averaged = any(getattr(self, name).members > 1 for name in _NETWORKS)
        return _formats(self.family.name)[-1 if averaged else 0]

    def _arrays(self, prefix: str = "") -> dict[str, Any]:
        """Everything it consists of by name, that of its base with a prefix more: see `_from_arrays`."""
        arrays: dict[str, Any] = {
            "format": self._format,
            "family": self.family.name,
            "force_modes": self.force_modes,
            "capacitance_modes": self.capacitance_modes,
            "provenance": np.array(json.dumps(dict(self.provenance))),
        }
        for name in _NETWORKS:
            arrays |= getattr(self, name).arrays(name)
        below = {} if self.base is None else self.base._arrays(_BASE)
        return {prefix + name: array for name, array in (arrays | below).items()}


_BASE = "base_"


def _safe(groups: FloatArray, inside: BoolArray) -> FloatArray:
    """Groups with harmless ones where a design is not `inside`: there they may be anything, also nothing features exist for."""
    return np.where(inside[:, None], groups, 1.0)


class NotShippedError(LookupError):
    """There is a family, but no surrogate of it in the package; the message says how to get one."""

    def __init__(self, family: Family) -> None:
        super().__init__(
            f"no surrogate of the family {family.name} ({family.words}) comes with the package. Train one with "
            f"`calib surrogate train --family {family.name} -o {family.name}.npz` and give it with "
            f"--surrogate {family.name}.npz, or use the model fem. There are surrogates of {shipped_in_words()}"
        )


def shipped_in_words() -> str:
    """List the families of which a surrogate comes with the package, with what their designs are."""
    return "; ".join(f"{family.name} ({family.words})" for family in FAMILIES.values() if is_shipped(family))


def is_shipped(family: Family) -> bool:
    """Whether a surrogate of the family comes with the package."""
    return _shipped(family).is_file()


def _shipped(family: Family) -> Traversable:
    return files("models.surrogate") / "data" / f"{family.name}.npz"


_NETWORKS = ("end", "mechanics", "capacitance", "force_sd", "capacitance_sd")


def load_surrogate(path: Path | str | None = None, family: Family = NEO_HOOKEAN) -> Surrogate:
    """Read a surrogate from its file, or the one that is shipped with the package.

    Parameters
    ----------
    path : file that `Surrogate.save` wrote; None for the shipped one of
    family : the kind of physics. A file says itself which it stands for.

    Returns
    -------
    The surrogate, with the base that it adds to.

    Raises
    ------
    ValueError
        If the file is not a surrogate of this format, to the last byte as it was written and with finite numbers alone.
    NotShippedError
        If no surrogate of the family comes with the package.
    """
    if path is None:
        if not is_shipped(family):
            raise NotShippedError(family)
        with as_file(_shipped(family)) as shipped:
            return load_surrogate(shipped)
    try:
        with np.load(io.BytesIO(unsealed(Path(path).read_bytes())), allow_pickle=False) as file:
            data = {name: file[name] for name in file.files}
        written = int(data["format"])
        read = _formats(str(data["family"]))
        if written in read:
            return _from_arrays(data)
    except (KeyError, OSError, EOFError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is not a surrogate file ({error}); give one that `calib surrogate train` wrote") from None
    raise ValueError(
        f"{path} has surrogate format {written}, this version reads {' and '.join(map(str, read))} "
        f"of the family {data['family']}; train it anew"
    )


def _formats(family: str) -> tuple[int, ...]:
    """Formats of a family's files, that of a mean of networks last: what fades, is signed or rubs on its base has one alone."""
    if family in FAMILIES and BASE_FRICTION in FAMILIES[family].own:
        return (_FORMAT_OF_BASE_FRICTION,)
    if family in FAMILIES and FAMILIES[family].signed:
        return (_FORMAT_SIGNED,)
    fades = family in FAMILIES and FAMILIES[family].fade
    return (_FORMAT_WITH_FADE,) if fades else (_FORMAT, _FORMAT_WITH_FADE)


def _from_arrays(data: Mapping[str, Any]) -> Surrogate:
    for name, array in data.items():
        if array.dtype.kind == "f" and not np.all(np.isfinite(array)):
            raise ValueError(f"{name} has numbers that are not finite")
    family = str(data["family"])
    if family not in FAMILIES:
        raise ValueError(f"its family is {family}, there are {', '.join(FAMILIES)}")
    below = {name.removeprefix(_BASE): array for name, array in data.items() if name.startswith(_BASE)}
    return Surrogate(
        **{name: network_from(data, name) for name in _NETWORKS},
        force_modes=data["force_modes"],
        capacitance_modes=data["capacitance_modes"],
        provenance=json.loads(str(data["provenance"])),
        family=FAMILIES[family],
        base=_from_arrays(below) if below else None,
    )
