"""Fields carried from the points of one mesh of a body to those of another that covers the same shape.

Elastic strains travel as ½ ln b_e, trace and deviator apart, the deviator's size as the ratio of the Mises stress to the yield
stress: so a homogeneous state stays what it is, volumes do not change, and points that flow stay on the yield surface. Each
field of a law says how it travels (`prensa.materials.protocol.Travel`). The operator is superconvergent patch recovery
(Zienkiewicz & Zhu 1992): polynomials over patches of elements give values at the nodes, shape functions those at the new
points. The choice is that of docs/developer/book/10.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from prensa.contact.recovery import mises_of, recover
from prensa.geometry.plane import cross
from prensa.materials.protocol import Field, Material
from prensa.mesh.mesh import corner_cells
from prensa.system.assembly import Block
from prensa.types import Array, Flags, Index

NEAREST = 4  # elements with the nearest centres that are looked at first for that of a place
CANDIDATES = 24  # elements with the nearest centres among which that of a place is looked for
OUTSIDE = 0.2  # local coordinate beyond an element up to which its field is carried on
MARGIN = 0.5  # of the range of the points nearby, beyond which no value is believed
MOST_ADDED = 0.05  # of what only grows, to points of a new mesh, for its mean to stay
SAME = 1e-4  # distance over that to the next old point below which a new point is an old one


class Places(NamedTuple):
    """Elements (n,) in which places lie, and shape values N (n, a) of their nodes there."""

    element: Index
    N: Array


def located(points: Array, cells: Index, x: Array) -> Places:
    """Where places x (n, 2) lie among T6 cells (m, 6) with nodes at points; those just outside, in the nearest cell."""
    from scipy.spatial import cKDTree

    tree = cKDTree(points[corner_cells(cells)].mean(axis=1))
    n = len(x)
    best, element, local = np.full(n, np.inf), np.zeros(n, dtype=np.int64), np.full((n, 2), 1 / 3)
    todo = np.arange(n)
    for first, last in ((0, NEAREST), (NEAREST, CANDIDATES)):  # most are in one of the nearest few
        last = min(last, len(cells))
        near = tree.query(x[todo], np.arange(first + 1, last + 1))[1] if last > first else np.zeros((n, 0), dtype=np.int64)
        asked = np.empty(n, dtype=np.int64)
        asked[todo] = np.arange(len(todo))
        for j in range(last - first):
            e = near[asked[todo], j]
            xi = _inverted(points[cells[e]], x[todo])
            outside = np.maximum(np.maximum(-xi[:, 0], -xi[:, 1]), xi.sum(axis=1) - 1)
            better = outside < best[todo]
            i = todo[better]
            best[i], element[i], local[i] = outside[better], e[better], xi[better]
            todo = todo[best[todo] > 1e-10]
            if not len(todo):
                break
        if not len(todo):
            break
    N, _ = shape_values(np.clip(local, -OUTSIDE, 1 + OUTSIDE))
    return Places(element, N)


def _inverted(X: Array, x: Array) -> Array:
    """Local coordinates (n, 2) of places x (n, 2) in T6 with nodes X (n, 6, 2), by Newton's method."""
    xi = _affine(X, x)
    todo = np.arange(len(x))
    for _ in range(10):
        N, dN = shape_values(xi[todo])
        r = x[todo] - (N[:, None] @ X[todo])[:, 0]
        J = X[todo].transpose(0, 2, 1) @ dN
        det = J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]
        det = np.where(np.abs(det) < 1e-300, 1e-300, det)
        step = np.stack(
            [J[:, 1, 1] * r[:, 0] - J[:, 0, 1] * r[:, 1], J[:, 0, 0] * r[:, 1] - J[:, 1, 0] * r[:, 0]], axis=1
        )
        step /= det[:, None]
        # Curved elements fold some way outside of themselves, and Newton's steps would go anywhere from there.
        xi[todo] = np.clip(xi[todo] + step, -3.0, 3.0)
        todo = todo[np.abs(step).max(axis=1) >= 1e-14]
        if not len(todo):
            break
    return xi


def _affine(X: Array, x: Array) -> Array:
    """Local coordinates (n, 2) of places in the triangles of the corners of X (n, 6, 2): those of T6 with straight sides."""
    a, b, r = X[:, 1] - X[:, 0], X[:, 2] - X[:, 0], x - X[:, 0]
    det = cross(a, b)
    det = np.where(np.abs(det) < 1e-300, 1e-300, det)
    xi = np.stack([cross(r, b), cross(a, r)], axis=1)
    return np.asarray(np.clip(xi / det[:, None], -3.0, 3.0))


def shape_values(xi: Array) -> tuple[Array, Array]:
    """N (n, 6) and dN (n, 6, 2) of `prensa.elements.shapes.t6` at many local coordinates (n, 2)."""
    L = np.stack([1 - xi.sum(axis=1), xi[:, 0], xi[:, 1]], axis=1)
    dL = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    a, b = [0, 1, 2], [1, 2, 0]
    N = np.concatenate([L * (2 * L - 1), 4 * L[:, a] * L[:, b]], axis=1)
    corners, middles = (4 * L - 1)[:, :, None] * dL, 4 * (dL[a] * L[:, b, None] + L[:, a, None] * dL[b])
    return N, np.concatenate([corners, middles], axis=1)


def at_places(values: Array, cells: Index, places: Places) -> Array:
    """Nodal values (n, …) interpolated to places (k, …)."""
    return np.asarray(np.einsum("ka,ka...->k...", places.N, values[cells[places.element]]))


# -------------------------------------------------------------------------------------------------------------- tensors
def logarithm(h: Array) -> Array:
    """b_e − I (…, 4: 11, 22, 33, 12) → ½ ln b_e (…, 4); exact to round-off for small strains."""
    return _isotropic(h, lambda w: 0.5 * np.log1p(w))


def exponential(e: Array) -> Array:
    """Inverse of `logarithm`."""
    return _isotropic(e, lambda w: np.expm1(2.0 * w))


def _isotropic(t: Array, f: Callable[[Array], Array]) -> Array:
    """A function of the eigenvalues of symmetric tensors (…, 4)."""
    m, d, s = 0.5 * (t[..., 0] + t[..., 1]), 0.5 * (t[..., 0] - t[..., 1]), t[..., 3]
    r = np.hypot(d, s)
    a, b = f(m + r), f(m - r)
    mean, half = 0.5 * (a + b), 0.5 * (a - b)
    unit = half / np.where(r > 0, r, 1.0)
    return np.stack([mean + unit * d, mean - unit * d, f(t[..., 2]), unit * s], axis=-1)


def split(e: Array) -> tuple[Array, Array]:
    """Trace (…, 1) and deviator (…, 4) of tensors (…, 4)."""
    trace = e[..., :3].sum(axis=-1, keepdims=True)
    deviator = e.copy()
    deviator[..., :3] -= trace / 3.0
    return trace, deviator


def elastic_volume(history: Array) -> Array:
    """J_e (…) = √det b_e of histories (…, h)."""
    h = history
    return np.asarray(np.sqrt((1 + h[..., 2]) * ((1 + h[..., 0]) * (1 + h[..., 1]) - h[..., 3] ** 2)))


def utilisation(law: Material, history: Array) -> Array:
    """Mises stress over yield stress (m, q, 1) of a plastic law's histories (m, q, h)."""
    flat = np.ascontiguousarray(history.reshape(-1, history.shape[-1])[:, : law.size])
    strong: Any = law
    return np.asarray(mises_of(law.cauchy(flat)) / (np.sqrt(3.0) * strong.shear_strength(flat))).reshape(*history.shape[:-1], 1)


# ----------------------------------------------------------------------------------------------------------------- transfer
def carried(block: Block, x: Array, history: Array, new: Array, volume: Array | None = None) -> Array:
    """History (k, q, h) at new points (k, q, 2) from that (m, q, h) of a block of T6 with nodes at x (n, 2).

    ``volume`` (k, q) that the new points have now: the means of what only grows stay what they are then.
    """
    first, last = int(block.cells.min()), int(block.cells.max()) + 1
    own, cells, at = x[first:last], block.cells - first, block.positions(x)
    p = new.reshape(-1, 2)
    places = located(own, cells, p)
    # Logarithms, and the Mises stress over the yield stress, so that means of states that flow still lie on the yield surface
    # and plastic flow stays isochoric.
    smooth = _smooth_fields(block, history)
    # Values of the closest points made jumps of the force ten times as large; a projection onto linear fields needs a limiter,
    # which spoils the linear ones.
    nodal = recover(own, cells, at, smooth)
    growing = _growing(block, smooth.shape[-1])
    # One factor alone would raise everything for what one peak has lost.
    nodal[:, growing] += _kept(block, cells, nodal[:, growing], smooth[..., growing])
    values = at_places(nodal, cells, places)
    bounded = _bounded(values, smooth, cells, places.element)
    out = _history(block, values, bounded, history, at, p)
    same = _same(at, p)
    out[same[0]] = history.reshape(-1, history.shape[-1])[same[1]]
    if volume is not None:
        weight = volume.ravel() / elastic_volume(out)
        for field in block.law.fields.values():
            if field.travel == "growing":
                mean = np.average(history[..., field.columns], axis=(0, 1), weights=block.volume)
                out[:, field.columns] *= _factor(out[:, field.columns], weight, mean, same[0])
    return out.reshape(*new.shape[:2], history.shape[-1])


def carried_beside(block: Block, x: Array, values: Array, growing: Flags, new: Array, volume: Array) -> Array:
    """Values (k, q, v) at new points (k, q, 2) from those (m, q, v) of a block of three points that are no part of its history.

    ``growing`` (v,): which never fall below zero, and whose means over the initial ``volume`` (k, q) of the new points stay what
    they are. No force depends on them, so that they may jump between elements: what patches take off an element is put back
    there, and a peak as narrow as an element stays. Others are smooth fields.
    """
    first, last = int(block.cells.min()), int(block.cells.max()) + 1
    own, cells, at = x[first:last], block.cells - first, block.positions(x)
    p = new.reshape(-1, 2)
    places = located(own, cells, p)
    nodal = recover(own, cells, at, values)
    missing = values - np.einsum("qa,mav->mqv", block.element.N, nodal[cells])
    rest = np.einsum("kq,kqv->kv", _shares(at[places.element], p), missing[places.element]) * growing
    out = _bounded(at_places(nodal, cells, places) + rest, values, cells, places.element)
    out[:, growing] = np.maximum(out[:, growing], 0.0)
    same = _same(at, p)
    out[same[0]], rest[same[0]] = values.reshape(-1, values.shape[-1])[same[1]], 0.0
    mean, weight = np.average(values, axis=(0, 1), weights=block.volume)[growing], volume.ravel()
    # Where patches and elements agree the values are known; what the mean has lost is looked for where they differ.
    doubt, lost = np.abs(rest[:, growing]), mean * weight.sum() - weight @ out[:, growing]
    unsure = weight @ doubt
    out[:, growing] = np.maximum(out[:, growing] + np.clip(lost / np.where(unsure > 0, unsure, np.inf), -1.0, 1.0) * doubt, 0.0)
    out[:, growing] *= _factor(out[:, growing], weight, mean, same[0])
    return out.reshape(*new.shape[:2], values.shape[-1])


def _shares(at: Array, p: Array) -> Array:
    """Shares (k, 3) of three points at (k, 3, 2) in a linear field at places p (k, 2); outside of them, of the nearest side's."""
    ones = np.ones((*at.shape[:2], 1))
    share = np.einsum("kd,kdq->kq", np.c_[p, ones[:, 0]], np.linalg.inv(np.concatenate([at, ones], axis=2)))
    share = np.maximum(share, 0.0)
    return np.asarray(share / share.sum(axis=1, keepdims=True))


def _smooth_fields(block: Block, history: Array) -> Array:
    """Fields (m, q, v) that polynomials follow well: trace, deviator (4), ratio to yield of plastic laws, then all others."""
    trace, deviator = split(logarithm(block.field(history, "elastic")))
    parts = [trace, deviator]
    if block.law.plastic:
        parts.append(utilisation(block.law, history))
    for name, f in block.law.fields.items():
        if f.travel == "flow":
            parts.append(_flowed(block.law, f, history))
        elif name != "elastic":
            parts.append(history[..., f.columns])
    return np.concatenate(parts, axis=-1)


def _growing(block: Block, width: int) -> Index:
    """Columns of the smooth fields, ``width`` of them, that hold what only grows, such as plastic strain and work."""
    fields = [f for name, f in block.law.fields.items() if name != "elastic"]
    columns = [f.travel == "growing" for f in fields for _ in range(f.columns.stop - f.columns.start)]
    return np.flatnonzero([False] * (width - len(columns)) + columns)


def _kept(block: Block, cells: Index, nodal: Array, values: Array) -> Array:
    """What to add (n, v) to nodal values (n, v) of cells (m, 6), linear in each, so that integrals of values (m, q, v) stay.

    Patches lower peaks that are as narrow as an element. What an element has lost there goes back to its corners.
    """
    N = block.element.N
    L, at_nodes = block.corner_fields
    lost = values - np.einsum("qa,mav->mqv", N, nodal[cells])
    # By initial volumes, per which plastic strain and work are counted.
    share = L * block.volume[..., None]
    total, weight = np.zeros_like(nodal), np.zeros(len(nodal))
    np.add.at(total, cells[:, :3], np.einsum("mqa,mqv->mav", share, lost))
    np.add.at(weight, cells[:, :3], share.sum(axis=1))
    out = total / np.where(weight > 0, weight, 1.0)[:, None]
    out[cells[:, 3:]] = at_nodes[3:] @ out[cells[:, :3]]
    return out


def _factor(values: Array, weight: Array, mean: Array, kept: Index) -> Array:
    """Factors (k, v) of values (k, v) ≥ 0 that give them a mean (v,) under weights (k,); 1 at the points that are ``kept``."""
    free = np.ones(len(values))
    free[kept] = 0.0
    missing, own = mean * weight.sum() - weight @ values, (weight * free) @ values
    return 1.0 + free[:, None] * np.clip(missing / np.where(own > 0, own, np.inf), -MOST_ADDED, MOST_ADDED)


def _bounded(values: Array, smooth: Array, cells: Index, element: Index) -> Array:
    """Values (k, v) no farther from those of the points of the elements around than part of their range."""
    n = int(cells.max()) + 1
    low, high = np.full((n, smooth.shape[-1]), np.inf), np.full((n, smooth.shape[-1]), -np.inf)
    least, most = smooth.min(axis=1), smooth.max(axis=1)
    for corner in corner_cells(cells).T:
        np.minimum.at(low, corner, least)
        np.maximum.at(high, corner, most)
    around = corner_cells(cells)[element]
    lo, hi = low[around].min(axis=1), high[around].max(axis=1)
    return np.clip(values, lo - MARGIN * (hi - lo), hi + MARGIN * (hi - lo))


def _history(block: Block, values: Array, bounded: Array, old: Array, at: Array, p: Array) -> Array:
    """Histories (k, h) of the fields that have been carried over."""
    law = block.law
    out = np.zeros((len(values), old.shape[-1]))
    column = 6 if law.plastic else 5
    for name, field in law.fields.items():
        if name == "elastic":
            continue
        width = field.columns.stop - field.columns.start
        # bounds of a tensor's components would depend on the axes
        part = (values if field.travel in ("flow", "axes") else bounded)[:, column : column + width]
        if field.travel == "growing":
            part = np.maximum(part, field.start(p))
        elif field.travel == "axes":
            part = part / np.linalg.norm(part, axis=1, keepdims=True)
        elif field.travel == "nearest":
            part = _nearest(at, p, old[..., field.columns])
        out[:, field.columns] = part
        column += width
    # bounds of components would depend on the axes: the ratio to the yield stress bounds the deviator
    trace, deviator = (
        bounded[:, :1],
        values[:, 1:5] - np.array([1.0, 1.0, 1.0, 0.0]) * values[:, 1:4].mean(axis=1)[:, None],
    )
    elastic = law.fields["elastic"].columns
    out[:, elastic] = exponential(_joined(trace, deviator))
    if law.plastic:
        now, wanted = utilisation(law, out[:, None])[:, 0], np.maximum(bounded[:, 5:6], 0.0)
        most = max(1.0, float(utilisation(law, old).max()))
        # The direction of the deviator is interpolated, its size follows from the ratio; patches must not raise it above what
        # any point had.
        share = np.minimum(wanted, most) / np.where(now > 0, now, 1.0)
        out[:, elastic] = exponential(_joined(trace, np.where(now > 0, share, 1.0) * deviator))
    for field in law.fields.values():
        if field.travel == "flow":
            _flow(law, field, out, out[:, field.columns].copy())
    return out


def _flowed(law: Material, field: Field, history: Array) -> Array:
    """What a tensor that travels as ``flow`` differs by from the elastic one (…, 4), in logarithms."""
    return logarithm(history[..., field.columns]) - logarithm(history[..., law.fields["elastic"].columns])


def _flow(law: Material, field: Field, history: Array, flowed: Array) -> None:
    """The inverse: write the field of a history; where nothing has flowed it is the elastic tensor itself."""
    elastic = history[..., law.fields["elastic"].columns]
    flown = exponential(logarithm(elastic) + flowed)
    history[..., field.columns] = np.where(flowed.any(axis=-1, keepdims=True), flown, elastic)


def with_flow(block: Block, history: Array, last: Array) -> Array:
    """A history (m, q, h) with what has flowed in the increment that led to another one, ``last``."""
    out = history.copy()
    for field in block.law.fields.values():
        if field.travel == "flow":
            _flow(block.law, field, out, _flowed(block.law, field, last))
    return out


def _joined(trace: Array, deviator: Array) -> Array:
    strain = deviator.copy()
    strain[:, :3] += trace / 3.0
    return strain


def _nearest(at: Array, p: Array, values: Array) -> Array:
    from scipy.spatial import cKDTree

    return np.asarray(values.reshape(-1, values.shape[-1])[cKDTree(at.reshape(-1, 2)).query(p)[1]])


def _same(at: Array, p: Array) -> tuple[Index, Index]:
    """New points that lie where old ones do, and those: an element that stays keeps its history to the last digit."""
    from scipy.spatial import cKDTree

    distance, number = cKDTree(at.reshape(-1, 2)).query(p, 2)
    same = np.flatnonzero(distance[:, 0] < SAME * distance[:, 1])
    return same, np.asarray(number[same, 0], dtype=np.int64)
