"""Measures of contacts: of one surface against a tool, or of all the surfaces against it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from prensa.measures.measure import MeasureError
from prensa.measures.outline import length
from prensa.mesh.bricks import outside
from prensa.mesh.mesh import beyond_corners, boundary_edges, edges_between
from prensa.mesh.surfaces import surface_areas
from prensa.types import Array, Index

if TYPE_CHECKING:
    from prensa.result.increment import ContactState, Increment, Shape

Names = Sequence[str]
Value = Callable[["Increment"], float]

OPEN = 0  # status of a contact point that does not touch


def _states(increment: Increment, names: Names) -> list[ContactState]:
    return [increment.contacts[name] for name in names]


def area(names: Names) -> Value:
    """Area of the closed points, up to the corners of the body."""
    return lambda increment: sum(c.area for c in _states(increment, names))


def contact_length(names: Names) -> Value:
    """Length of the outline in contact: half of each edge at each of its ends that is closed, up to the corners of the body."""

    def value(increment: Increment) -> float:
        total = 0.0
        for c in _states(increment, names):
            shape = increment.shapes[c.body]
            edges, closed = _touching(c, shape)
            total += float(length(shape.x, edges) @ closed)
        return total

    return value


def _touching(c: ContactState, shape: Shape) -> tuple[Index, Array]:
    """Edges (k, 2|3) or faces (k, 4) of a contact, and the shares (k,) of them that are closed: the same for each end."""
    if shape.X.shape[1] == 3:
        outer = outside(shape.cells)
        faces = outer[np.isin(outer, c.node).all(axis=1)]
        return faces, np.isin(faces, c.node[c.status != OPEN]).mean(axis=1)
    edges = edges_between(boundary_edges(shape.cells), c.node)
    touching = np.isin(np.arange(len(shape.x)), c.node[c.status != OPEN])
    closed = np.where(beyond_corners(shape.x, edges[:, :2], touching), 0, touching[edges[:, :2]].sum(axis=1))
    return edges, 0.5 * closed


def expansion(names: Names, revolved: bool) -> Value:
    """Area of the surface in contact now over the area of the same surface at the beginning; lengths in the plane."""

    def value(increment: Increment) -> float:
        now = then = 0.0
        for c in _states(increment, names):
            shape = increment.shapes[c.body]
            edges, closed = _touching(c, shape)
            now += float(surface_areas(shape.x, edges, revolved) @ closed)
            then += float(surface_areas(shape.X, edges, revolved) @ closed)
        if not then > 0.0:
            raise MeasureError("nothing is in contact, so that no surface there has grown")
        return now / then

    return value


def largest(names: Names, field: str) -> Value:
    """Largest pressure, slip, |shear| or friction power per area at the nodes (the power at the integration points)."""

    def value(increment: Increment) -> float:
        return max(float(np.abs(_values(c, field)).max(initial=0.0)) for c in _states(increment, names))

    return value


def _values(c: ContactState, field: str) -> Array:
    if field != "friction_power":
        values: Any = getattr(c, field)
        if values is None:
            raise MeasureError(f"{field.replace('_', ' ')} is not known here; solve the case")
        return np.asarray(values)
    return _power(c)


def _power(c: ContactState) -> Array:
    """Friction power per area (k,) at the integration points."""
    if not c.points.pressure.any():  # also of contacts that are gone with their tools
        return np.zeros(len(c.points.weight))
    if c.points.speed is None:
        raise MeasureError("the speeds of slip are not known; solve the case")
    return np.asarray(np.abs(c.points.shear) * np.abs(c.points.speed))


def friction_power(names: Names) -> Value:
    """Power of friction over the whole contact."""
    return lambda increment: sum(float(_power(c) @ c.points.weight) for c in _states(increment, names))


def mean(names: Names, field: str) -> Value:
    """Mean pressure or |shear| over the closed area."""

    def value(increment: Increment) -> float:
        states = _states(increment, names)
        whole = sum(c.area for c in states)
        if whole == 0.0:
            raise MeasureError("nothing is in contact, so that there is no mean")
        return sum(float(np.abs(getattr(c.points, field)) @ c.points.weight) for c in states) / whole

    return value


def mean_at_closed(names: Names, field: str) -> Value:
    """Mean of a field over the closed area, by the tributary areas of the nodes."""

    def value(increment: Increment) -> float:
        states = _states(increment, names)
        weights = [np.where(c.status != OPEN, c.weight, 0.0) for c in states]
        whole = float(sum(w.sum() for w in weights))
        if not whole > 0.0:
            raise MeasureError("nothing is in contact, so that there is no mean")
        return float(sum(w @ _values(c, field) for w, c in zip(weights, states))) / whole

    return value


def least_gap(names: Names) -> Value:
    """Smallest gap at the nodes; negative: penetration."""
    return lambda increment: min(float(c.gap.min()) for c in _states(increment, names))


def count(names: Names, status: int) -> Value:
    """Number of nodes that are open (0), stick (1) or slip (2)."""
    return lambda increment: float(sum(np.count_nonzero(c.status == status) for c in _states(increment, names)))


def neutral(name: str, axis: int) -> Value:
    """Coordinate of the neutral point: where shear changes sign and divides the contact best.

    The shear is linear between the nodes. Of several zeros it is the one that makes the force of friction on its one side
    minus that on its other side largest.
    """

    def value(increment: Increment) -> float:
        c = increment.contacts[name]
        closed = np.flatnonzero(c.status != OPEN)
        force, shear, x = c.shear[closed] * c.weight[closed], c.shear[closed], c.x[closed]
        zeros = np.flatnonzero(shear[:-1] * shear[1:] < 0.0) if len(shear) > 1 else np.zeros(0, dtype=np.int64)
        if not len(zeros):
            raise MeasureError(f"the shear of {name!r} does not change sign: it has no neutral point")
        left = np.cumsum(force)[zeros]
        k = zeros[int(np.argmax(np.abs(2.0 * left - force.sum())))]
        share = shear[k] / (shear[k] - shear[k + 1])
        return float((1.0 - share) * x[k, axis] + share * x[k + 1, axis])

    return value


def passing(name: str, what: str) -> Value:
    """Elements that have passed through a contact ('passages'), or that lie in it ('elements')."""

    def value(increment: Increment) -> float:
        if name not in increment.passing:
            raise MeasureError(f"nothing passes through {name!r}: its tool has no end")
        return float(increment.passages[name] if what == "passages" else increment.passing[name].elements)

    return value
