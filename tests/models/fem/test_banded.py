"""The tangent of a sensor under a ball that rubs, factorised in two parts."""

import numpy as np
import pytest

from models.examples import PAPER_SENSOR
from models.fem import contact, dimensionless, elements
from models.fem.banded import Entries
from models.fem.equilibrium import Failure, make_model
from models.fem.path import walk
from models.layers import layered
from models.sensor import design_from


@pytest.mark.parametrize("friction", [0.3, np.inf])
def test_in_two_parts_the_tangent_is_solved_as_in_one(friction: float) -> None:
    stack, _ = dimensionless(layered(design_from(PAPER_SENSOR | {"friction_coefficient": friction})))
    model = make_model(stack, 0.1, 1e-2)
    (state,) = walk(model, np.array([0.05]))
    assert not isinstance(state, Failure)
    gap = contact.gap(model.surface, stack.profile, state.u, state.depth)
    condensed = elements.condense(model.elements, elements.deformation(model.elements, state.u), state.pressure)
    edges = contact.contact_system(model.surface, gap, state.contact, friction).stiffness
    assert not np.allclose(edges, np.swapaxes(edges, 1, 2))
    nothing = Entries(np.zeros(0, dtype=int), np.zeros(0, dtype=int), np.zeros(0))  # anywhere: LU of the whole
    two, one = (model.band.factorise(condensed.stiffness, edges, symmetric=False, beside=b) for b in (None, nothing))
    assert two.outside is not None
    assert one.outside is None
    assert not two.positive_definite
    right = np.random.default_rng(1).normal(size=(model.band.n, 2))
    for loads in (right, right[:, 0]):
        np.testing.assert_allclose(two.solve(loads), one.solve(loads), rtol=1e-6, atol=1e-9 * np.max(np.abs(one.solve(loads))))
