"""From how the stack presses on its base to what friction there holds: Coulomb's law at the nodes of the base.

The base does not move and the stack does not lift off it, so that its push N on a node is the vertical force of the elements
there. A node sticks where it was, T = -eps (u_r - u_0), as long as |T| <= f N, or slips, T = -s f N with s the sign of its
slip; where nothing presses, it is free. In the equations a node that slips has F_r + s f F_z = 0 in the place of F_r = 0: f
times one row of the elements' forces and stiffness added to another, so that Newton's method stays exact. The tangent is not
symmetric.

From a coefficient between 1.5 and 1.7 on, whatever the layers, the rim of the disc sticks by itself: pushed outwards, it
presses on the base by more than it takes to stick. The force is larger by about a hundredth from there, the change of
capacitance less by up to a quarter, and just where depends on the grid. As the stack does not lift off, the ring within the rim
is pulled down; one that may lift would not be held so. On thin soft padding both states keep the law from about 1 on, and which
is found is chance (`docs/finite_elements.md`).

Forces of the nodes that do the same work as an even pressure are positive at all of them but the one on the axis, which does
not slide.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from models.fem.banded import Entries
from models.fem.elements import BASE_R, BASE_Z, Condensed
from models.fem.mesh import Mesh
from models.sensor import BoolArray, FloatArray, IntArray

#: Stiffness against sliding of a node that sticks, in units of shear modulus times size of the indenter.
STICK_STIFFNESS = 1e7

# A push below this share of the largest is none: far from the indenter it is rounding of either sign.
_NO_PUSH = 1e-7
# Friction of a node below this share of the whole push is none: far out, where the base hardly carries, nodes may change for
# ever.
_NO_FRICTION = 1e-6


@dataclass(frozen=True, eq=False)
class BaseNodes:
    """The nodes on the base, from the axis outwards.

    Attributes
    ----------
    r_dofs, z_dofs : (n_node,), their displacement components.
    elements : (n_edge,), the elements that stand on the base.
    dofs : (n_edge, 16), components of these elements' borders.
    """

    r_dofs: IntArray
    z_dofs: IntArray
    elements: IntArray
    dofs: IntArray


def make_base(mesh: Mesh, border_dofs: IntArray) -> BaseNodes:
    """Pick the nodes of the lowest row, and the elements above them.

    Parameters
    ----------
    mesh : the grid.
    border_dofs : (n_element, 16), displacement components on the border of each element.

    Returns
    -------
    The nodes on the base.
    """
    nr, nz = mesh.shape
    r = 2 * np.arange(mesh.r.size) * mesh.n_row
    elements = np.arange(nr) * nz
    return BaseNodes(r, r + 1, elements, border_dofs[elements])


@dataclass(frozen=True, eq=False)
class Sliding:
    """State of the nodes on a base that rubs, all of shape (n_node,).

    Attributes
    ----------
    sticks : whether the node is held where it is.
    slip : sign of its slip, 0 where it does not slip.
    anchor : displacement u_0 at which it is held; of one that slips, from which it would be held if it turned back.
    push, friction : N of the base and T on the node.
    """

    sticks: BoolArray
    slip: FloatArray
    anchor: FloatArray
    push: FloatArray
    friction: FloatArray


def at_rest(base: BaseNodes) -> Sliding:
    """Nodes that nothing has moved: all but the one on the axis are about to slip outwards, as they do under a ball.

    From nodes that stick, most of which slip in the end, the sets are hard to find: the first that is let go turns the
    friction of its neighbours about.
    """
    zero = np.zeros(base.r_dofs.size)
    axis = np.arange(zero.size) == 0
    return Sliding(axis, np.where(axis, 0.0, 1.0), zero, zero, zero)


@dataclass(frozen=True, eq=False)
class BaseSystem:
    """What friction on the base adds to the equations.

    Attributes
    ----------
    residual : (n_dof,), force.
    stiffness : its entries.
    """

    residual: FloatArray
    stiffness: Entries


def base_system(base: BaseNodes, at: Condensed, u: FloatArray, sliding: Sliding, coefficient: float) -> BaseSystem:
    """Linearise the friction on the base for Newton's method.

    Parameters
    ----------
    base : the nodes.
    at : condensed elements.
    u : (n_dof,), displacements.
    sliding : which nodes stick and slip.
    coefficient : f, above zero and finite.

    Returns
    -------
    Residual and stiffness beside those of elements and contact.
    """
    force, stiffness = at.force[base.elements], at.stiffness[base.elements]
    share = coefficient * sliding.slip
    held = np.where(sliding.sticks, STICK_STIFFNESS, 0.0)
    out = np.zeros(u.size)
    out[base.r_dofs] = held * (u[base.r_dofs] - sliding.anchor)
    rows, columns, values = [base.r_dofs], [base.r_dofs], [held]
    for node, (r, z) in enumerate(zip(BASE_R, BASE_Z, strict=True)):
        own = share[node : node + 2 * base.elements.size : 2]
        np.add.at(out, base.dofs[:, r], own * force[:, z])
        rows.append(np.repeat(base.dofs[:, r], base.dofs.shape[1]))
        columns.append(base.dofs.ravel())
        values.append((own[:, None] * stiffness[:, z]).ravel())
    return BaseSystem(out, Entries(np.concatenate(rows), np.concatenate(columns), np.concatenate(values)))


def stepped(base: BaseNodes, at: Condensed, u: FloatArray, du: FloatArray, sliding: Sliding, coefficient: float) -> Sliding:
    """Push and friction after a step `du` of the displacements `u`, by their linearisation; what sticks and slips stays.

    Parameters
    ----------
    base, at, u, sliding, coefficient : as in `base_system`.
    du : (n_dof,), the step.

    Returns
    -------
    The same nodes with push and friction.
    """
    force = at.force[base.elements] + (at.stiffness[base.elements] @ du[base.dofs][:, :, None])[:, :, 0]
    push = np.zeros(base.r_dofs.size)
    for node, z in enumerate(BASE_Z):
        np.add.at(push, node + 2 * np.arange(base.elements.size), force[:, z])
    stick = -STICK_STIFFNESS * ((u + du)[base.r_dofs] - sliding.anchor)
    return replace(sliding, push=push, friction=np.where(sliding.sticks, stick, -sliding.slip * coefficient * push))


def resorted(
    base: BaseNodes, u: FloatArray, sliding: Sliding, coefficient: float, slack: float, *, one_by_one: bool
) -> Sliding:
    """Which nodes stick, slip and are free after a step.

    Parameters
    ----------
    base : the nodes.
    u : (n_dof,), displacements after the step.
    sliding : with push and friction after it, see `stepped`.
    coefficient : f.
    slack : share of the friction by which a node may break the law rather than change for ever.
    one_by_one : whether the first that changes, from the axis outwards, is the only one.

    Returns
    -------
    The nodes anew.
    """
    place, limit = u[base.r_dofs], coefficient * np.maximum(sliding.push, 0.0)
    pressed = sliding.push > _NO_PUSH * float(np.max(sliding.push))
    starts = sliding.sticks & (np.abs(sliding.friction) > limit * (1 + 1e-9 + slack))
    turns = (sliding.slip != 0) & (sliding.slip * (place - sliding.anchor) < -1e-13)
    # One that was free slips on as it moved: to stick at once would be a jump, and to slip with next to no push is none. Where
    # that friction lifts it again, which much of it may do, it sticks.
    lands = ~sliding.sticks & (sliding.slip == 0)
    sticks = pressed & ((sliding.sticks & ~starts) | turns | (lands & one_by_one))
    onward = np.select([starts, lands], [-np.sign(sliding.friction), np.sign(place - sliding.anchor)], sliding.slip)
    slip = np.where(pressed & ~sticks, onward, 0.0)
    if one_by_one:  # or sets of nodes that change in turn may do so for ever
        later = np.flatnonzero((sticks != sliding.sticks) | (slip != sliding.slip))[1:]
        sticks[later], slip[later] = sliding.sticks[later], sliding.slip[later]
    return replace(sliding, sticks=sticks, slip=slip, anchor=np.where(lands & sticks, place, sliding.anchor))


def settled(before: Sliding, after: Sliding, coefficient: float) -> bool:
    """Whether nodes do after a step what they did before it, all but those whose friction is nothing beside the whole push.

    Parameters
    ----------
    before, after : the nodes as a step took them, and sorted anew.
    coefficient : f.
    """
    changed = (before.sticks != after.sticks) | (before.slip != after.slip)
    friction = np.maximum(coefficient * np.abs(after.push), np.abs(after.friction))
    return not np.any(changed & (friction > _NO_FRICTION * float(np.sum(after.push))))


def carried_on(base: BaseNodes, u: FloatArray, sliding: Sliding) -> Sliding:
    """Nodes as the next step begins with them: one that slips is anchored where its friction would hold it.

    Parameters
    ----------
    base : the nodes.
    u : (n_dof,), displacements of an equilibrium.
    sliding : the nodes there.

    Returns
    -------
    The same nodes with their anchors.
    """
    place = u[base.r_dofs]
    return replace(sliding, anchor=np.where(sliding.sticks, sliding.anchor, place + sliding.friction / STICK_STIFFNESS))
