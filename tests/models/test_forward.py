"""What every forward model owes its users, checked over all of them."""

import pickle
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

import models.fem
from models.analytic import ClosedForm
from models.curves import covered
from models.examples import PAPER_SENSOR
from models.fem import FiniteElements
from models.response import ConvergenceError, Forward, OutOfRangeError
from models.sensor import design_from
from models.surrogate import FAMILIES, Family, is_shipped, load_surrogate
from models.surrogate.groups import FRICTION, STIFFENING
from models.surrogate.validation import Toleranced, random_designs, toleranced

PAPER = PAPER_SENSOR | {"young_modulus": 0.62e6, "dielectric_thickness": 0.16e-3}

FORWARDS = [ClosedForm(), FiniteElements(2e-3), load_surrogate()]


@pytest.mark.parametrize("forward", FORWARDS, ids=lambda f: f.name)
def test_forward_keeps_the_protocol(forward: Forward) -> None:
    design = design_from(PAPER)
    depth = np.array([0.2e-3, -0.1e-3, 0.0, 0.05e-3, 0.4e-3])
    single = forward.respond(design, depth)
    n = depth.size
    assert single.force.shape == single.capacitance.shape == single.contact_radius.shape == (n,)
    assert single.force_error.shape[0] == single.capacitance_error.shape[0] == n
    assert single.rest_capacitance.shape == ()

    # Before contact: no force, C0, and nothing to be wrong about.
    np.testing.assert_array_equal(single.force[[1, 2]], 0)
    np.testing.assert_array_equal(single.contact_radius[[1, 2]], 0)
    np.testing.assert_array_equal(single.capacitance[[1, 2]], single.rest_capacitance)
    assert not np.any(single.force_error[[1, 2]])
    assert not np.any(single.capacitance_error[[1, 2]])
    assert single.rest_capacitance == pytest.approx(design.rest_capacitance)

    # Deeper is more force, more contact, more capacitance.
    order = np.argsort(depth)
    for values in (single.force, single.contact_radius, single.capacitance):
        assert np.all(np.diff(values[order])[1:] > 0)

    # A batch is its draws.
    modulus = np.array([0.62e6, 1.24e6])
    batch = forward.respond(design_from(PAPER | {"young_modulus": modulus}), depth)
    assert batch.force.shape == (2, n)
    # (Networks in single precision round differently with the place in a batch.)
    np.testing.assert_allclose(batch.draw(0).force, single.force, rtol=1e-5)
    # Force scales with the modulus, and nothing else does.
    np.testing.assert_allclose(batch.force[1], 2 * batch.force[0], rtol=1e-5)
    np.testing.assert_allclose(batch.capacitance[1], batch.capacitance[0], rtol=1e-5)
    # One depth row for each draw.
    rows = forward.respond(design_from(PAPER | {"young_modulus": modulus}), np.stack([depth, depth / 2]))
    np.testing.assert_allclose(rows.force[0], single.force, rtol=1e-5)


@pytest.mark.parametrize("forward", FORWARDS, ids=lambda f: f.name)
def test_forward_refuses_what_it_does_not_cover(forward: Forward) -> None:
    design = design_from(PAPER)
    limit = forward.max_depth(design)
    assert limit.shape == (1,)
    assert 0.5e-3 < limit[0] < 1.5e-3
    beyond = np.array([limit[0] * 1.01])
    assert forward.outside(design, limit * 0.999) == ""
    assert f"{limit[0] * 1e3:.4g} mm" in forward.outside(design, beyond)
    np.testing.assert_array_equal(covered(forward, design, beyond), [False])
    with pytest.raises(OutOfRangeError, match="depths up to"):
        forward.respond(design, beyond)
    if not isinstance(forward, FiniteElements):
        with pytest.raises(OutOfRangeError, match="friction"):
            forward.respond(design_from(PAPER, friction_coefficient=0.2), np.array([1e-4]))
        several = design_from(PAPER | {"friction_coefficient": np.array([0.0, 0.2])})
        np.testing.assert_array_equal(forward.max_depth(several), [limit[0], 0.0])
        slippery = design_from(PAPER, base="slippery")
        np.testing.assert_array_equal(forward.max_depth(slippery), [0.0])
        with pytest.raises(OutOfRangeError, match='base must be "bonded", got "slippery"'):
            forward.respond(slippery, np.array([1e-4]))
        foam = design_from(PAPER | {"padding_poisson_ratio": np.array([0.5, 0.3])})
        np.testing.assert_array_equal(forward.max_depth(foam), [limit[0], 0.0])
        with pytest.raises(OutOfRangeError, match=r"padding_poisson_ratio must be 0\.5, got 0\.3"):
            forward.respond(foam, np.array([1e-4]))


def kinds() -> dict[str, Forward]:
    shipped = load_surrogate()
    plain = shipped.family
    wider = replace(shipped.mechanics, width=shipped.mechanics.width * (1 + 1e-15))
    return {
        "closed form": ClosedForm(),
        "closed form that claims less error": ClosedForm(force_error=0.05),
        "closed form that claims less error of capacitance": ClosedForm(capacitance_error=0.05),
        "finite elements": FiniteElements(),
        "coarse finite elements": FiniteElements(2e-3),
        "finite elements with the error of their accuracy": toleranced(FiniteElements()),
        "the same, twice the error": Toleranced(FiniteElements(), 2 * toleranced(FiniteElements()).share),
        "coarse finite elements with the error of their accuracy": toleranced(FiniteElements(2e-3)),
        "surrogate": shipped,
        "surrogate with another network": replace(shipped, mechanics=wider),
        "surrogate with other modes of its error": replace(shipped, force_modes=shipped.force_modes * 2),
        "surrogate for stiffening": replace(shipped, family=replace(plain, own=(STIFFENING,))),
        "surrogate for twice the stiffening": replace(shipped, family=replace(plain, own=(replace(STIFFENING, end=0.2),))),
        "surrogate for a slippery base": replace(shipped, family=replace(plain, base="slippery")),
        "surrogate for friction": replace(shipped, family=replace(plain, own=(FRICTION,))),
        "surrogate of Gent's law": load_surrogate(family=FAMILIES["gent"]),
        "surrogate of Gent's law on another base": replace(
            load_surrogate(family=FAMILIES["gent"]), base=replace(shipped, mechanics=wider)
        ),
        "surrogate of a ball that rubs": load_surrogate(family=FAMILIES["friction"]),
    }


def test_models_that_give_other_numbers_have_another_identity() -> None:
    identities = {name: forward.identity for name, forward in kinds().items()}
    assert len(set(identities.values())) == len(identities)
    assert all(len(identity.splitlines()) == 1 for identity in identities.values())


def test_models_that_give_the_same_numbers_have_the_same_identity(tmp_path: Path) -> None:
    assert {name: forward.identity for name, forward in kinds().items()} == {n: f.identity for n, f in kinds().items()}
    # A name for people does not count.
    assert ClosedForm(name="rough").identity == ClosedForm().identity
    assert FiniteElements(name="exact").identity == FiniteElements().identity
    assert FiniteElements(np.float64(1e-3)).identity == FiniteElements(1e-3).identity
    # Nor does the file, nor what is told of its making.
    shipped = load_surrogate()
    assert replace(shipped, provenance={**shipped.provenance, "date": "2020-01-01"}).identity == shipped.identity
    for family in filter(is_shipped, FAMILIES.values()):
        shipped = load_surrogate(family=family)
        shipped.save(tmp_path / f"mine {family.name}.npz")
        assert load_surrogate(tmp_path / f"mine {family.name}.npz").identity == shipped.identity


def test_every_setting_of_the_finite_elements_but_the_name_is_in_their_identity() -> None:
    # A setting that comes is to be put there, and into this list.
    assert {field.name for field in fields(FiniteElements)} == {"accuracy", "name"}


@pytest.mark.parametrize("asked_before", [True, False])
def test_identity_is_the_same_in_another_process(asked_before: bool) -> None:
    for forward in kinds().values():
        told = forward.identity if asked_before else None
        there = pickle.loads(pickle.dumps(forward))
        assert there.identity == (told or forward.identity)


@pytest.mark.parametrize("family", [*filter(is_shipped, FAMILIES.values())], ids=lambda family: family.name)
def test_a_surrogate_answers_in_another_process_as_it_does_here(family: Family) -> None:
    here = load_surrogate(family=family)
    there = pickle.loads(pickle.dumps(here))
    (draw, *_) = random_designs(2, 20261129, family)
    assert here.max_depth(draw) > 0
    np.testing.assert_array_equal(there.max_depth(draw), here.max_depth(draw))


def test_a_surrogate_is_hashed_once() -> None:
    shipped = load_surrogate()
    assert shipped.identity is shipped.identity


def test_no_equilibrium_is_told_by_one_class_wherever_it_is_imported_from() -> None:
    assert models.fem.ConvergenceError is ConvergenceError
    assert models.fem.ConvergenceError.__module__ == "models.response"


def test_no_equilibrium_is_told_by_a_worker_process_as_it_is_here() -> None:
    told = pickle.loads(pickle.dumps(ConvergenceError(0.4e-3, "Newton diverged", None)))
    assert isinstance(told, ConvergenceError)
    assert str(told) == "no equilibrium beyond an indentation of 0.4 mm: Newton diverged"
    assert (told.depth_reached, told.reason, told.response) == (0.4e-3, "Newton diverged", None)
