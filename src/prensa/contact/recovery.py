"""Recovered stresses: superconvergent patch recovery, or integration points extrapolated and averaged at the nodes.

Zienkiewicz & Zhu (1992), least squares over patches: around each interior corner node the stress of the integration points is
fitted by a polynomial of the element's order, which is evaluated at the nodes of the patch; a node on the boundary and a mid-
side node average the patches that contain them. Nodes that no interior patch reaches fit the elements at hand, by fewer terms
where those do not determine all. `smoothed` is the older route, the one that the paper took.

The stress of bilinear elements converges twice as fast at their centres as elsewhere in them, where it lacks what does not vary
within them: carried to the boundary from all four points it is of first order. There they are fitted by their means.

No polynomial follows the kink that stresses have where a plastic zone ends: fitted across it and carried on to the skin it
is tens of per cent out. A node of the boundary near ``kinked`` elements is fitted by the elements that it belongs to, by no
more terms than follow from their own points. Where these do not have the pressure of where they are, it is taken from the
traction (`at_free_edges`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from prensa.kernels.compiled import njit
from prensa.layout import of_corners
from prensa.mesh.mesh import boundary_edges, corner_cells
from prensa.precision import SMALLEST
from prensa.types import Array, Flags, Index

TERMS = {3: 3, 4: 4, 6: 6, 8: 6}  # of 1, s, t, st, s², t²; the bilinear element has the first four
OWN_TERMS = {3: 1, 4: 4, 6: 3, 8: 4}  # as many as the points of one element determine
OUTER_TERMS = {3: 3, 4: 4, 6: 3, 8: 4}  # of patches about nodes of the outline alone: one layer does not determine t²
FEWER = np.array([0, 0, 0, 1, 3, 0, 4])  # terms to try where the points do not determine so many
NO_CORNER = 0.9  # cosine between the normals of two sides between which the outline has no corner
ALL, ITSELF, OWN = range(3)  # what a patch reaches, see `_patches`
BY_SHARE = 8  # power of a node's share in a point by which the point counts at the skin: beyond a kink it hardly does
RANK = 1e-10  # share of a term's square, summed over the points, that the terms before must leave for it to be determined


@njit(cache=True, no_cpython_wrapper=True)
def _basis(s, t, out):
    out[0] = 1.0
    out[1] = s
    out[2] = t
    out[3] = s * t
    out[4] = s * s
    out[5] = t * t


@njit(cache=True, no_cpython_wrapper=True)
def _solved(M, B, terms, L):
    """Whether the first terms of M (6, 6) x = B (6, v) are determined; B is then replaced by x. L (6, 6) is overwritten.

    Cholesky's factors, written out: what NumPy has for it takes Numba longer to compile than all else in this module.
    """
    for j in range(terms):
        for i in range(j, terms):
            left = M[i, j]
            for k in range(j):
                left -= L[i, k] * L[j, k]
            if i > j:
                L[i, j] = left / L[j, j]
            elif left > RANK * M[j, j]:
                L[j, j] = math.sqrt(left)
            else:
                return False
    for c in range(B.shape[1]):
        for i in range(terms):
            for k in range(i):
                B[i, c] -= L[i, k] * B[k, c]
            B[i, c] /= L[i, i]
        for i in range(terms - 1, -1, -1):
            for k in range(i + 1, terms):
                B[i, c] -= L[k, i] * B[k, c]
            B[i, c] /= L[i, i]
    return True


@njit(cache=True, no_cpython_wrapper=True)
def _fit(members, begin, end, cells, X, values, x, v, ux, uy, sx, sy, terms, counts, M, L, basis, coefs):
    """Least squares over the points of elements members[begin:end] about node v → coefs (6, values), missing terms zero.

    (ux, uy): direction of s, along which sx is the size of the patch. counts (a, q): how much the points count for each node
    of their element, or (0, q) where all count alike. M, L (6, 6), basis (6,): scratch.
    """
    for i in range(6):
        for j in range(6):
            M[i, j] = 0.0
        for c in range(values.shape[2]):
            coefs[i, c] = 0.0
    for m in range(begin, end):
        e = members[m]
        own = 0
        # Which corner of the element the node is decides the row of the weights.
        while counts.shape[0] and cells[e, own] != v:
            own += 1
        for q in range(X.shape[1]):
            dx, dy = X[e, q, 0] - x[v, 0], X[e, q, 1] - x[v, 1]
            _basis((dx * ux + dy * uy) / sx, (dy * ux - dx * uy) / sy, basis)
            w = counts[own, q] if counts.shape[0] else 1.0
            for i in range(6):
                for j in range(i + 1):
                    M[i, j] += w * basis[i] * basis[j]
                for c in range(values.shape[2]):
                    coefs[i, c] += w * basis[i] * values[e, q, c]
    # the first terms are the same whatever follows: with fewer of them a smaller part of the same equations is solved
    while terms > 0 and not _solved(M, coefs, terms, L):
        terms = FEWER[terms]
    for i in range(terms, 6):
        for c in range(values.shape[2]):
            coefs[i, c] = 0.0


@njit(cache=True, no_cpython_wrapper=True)
def _along(members, begin, end, cells, x):
    """Direction (2,) that is most nearly that of all sides of quadrilaterals members[begin:end], or at right angles to it.

    Sides dx + i dy, turned to four times their angle, are the same for all four of a square: their sum has four times the
    angle of the direction. It turns with the body, and does not depend on the order of nodes and elements.
    """
    real, imaginary = 0.0, 0.0
    for m in range(begin, end):
        e = members[m]
        for a in range(4):
            v, w = cells[e, a], cells[e, (a + 1) % 4]
            dx, dy = x[w, 0] - x[v, 0], x[w, 1] - x[v, 1]
            length = dx * dx + dy * dy
            if length > 0.0:
                c, s = dx * dx - dy * dy, 2.0 * dx * dy
                # the fourth power of the side over its length squared: long sides count more, by their length squared
                real += (c * c - s * s) / length
                imaginary += 2.0 * c * s / length
    angle = 0.25 * math.atan2(imaginary, real)
    return math.cos(angle), math.sin(angle)


@njit(cache=True)
def _add_patches(
    nodes, first, members, interior, cells, x, X, values, counts, by_sides, terms, reach, out, count, M, L, basis, coefs
):
    """Add the values of the patches about some nodes (k,) to those ``out`` (n, v) of the nodes they reach, counted in count (n,).

    counts: see `_fit`. by_sides: whether s and t go along the sides of quadrilaterals instead of the axes.

    reach: `ALL`, all nodes but those that have patches of their own; `ITSELF`, the node alone; `OWN`, the same, by the
    elements that it belongs to, in the size of these. One kernel for all: each would have the fit compiled into it.
    """
    for v in nodes:
        begin, end = first[v], first[v + 1]
        ux, uy, sx, sy = 1.0, 0.0, 0.0, 0.0
        if by_sides:
            ux, uy = _along(members, begin, end, cells, x)
        elif X.shape[1] == 1 and cells.shape[1] == 4:  # four points: the bilinear term has to be that of their own square
            e, a = members[begin], 0
            while cells[e, a] != v:
                a += 1
            w = cells[e, (a + 1) % 4]
            length = math.hypot(x[w, 0] - x[v, 0], x[w, 1] - x[v, 1])
            if length > 0.0:
                ux, uy = (x[w, 0] - x[v, 0]) / length, (x[w, 1] - x[v, 1]) / length
        for m in range(begin, end):
            e = members[m]
            if reach == OWN:
                for q in range(X.shape[1]):
                    sx = sy = max(sx, max(abs(X[e, q, 0] - x[v, 0]), abs(X[e, q, 1] - x[v, 1])))
                continue
            for a in range(cells.shape[1]):
                dx, dy = x[cells[e, a], 0] - x[v, 0], x[cells[e, a], 1] - x[v, 1]
                sx, sy = max(sx, abs(dx * ux + dy * uy)), max(sy, abs(dy * ux - dx * uy))
        if sx == 0.0 or sy == 0.0:
            continue
        _fit(members, begin, end, cells, X, values, x, v, ux, uy, sx, sy, terms, counts, M, L, basis, coefs)
        for m in range(begin, end):
            e = members[m]
            for a in range(cells.shape[1]):
                w = cells[e, a]
                # an interior corner trusts its own patch alone; other nodes collect what reaches them
                if w != v and (interior[w] or reach != ALL):
                    continue
                seen = False
                for k in range(begin, m):  # count each outside node once
                    f = members[k]
                    for b in range(cells.shape[1]):
                        if cells[f, b] == w:
                            seen = True
                if seen:
                    continue
                dx, dy = x[w, 0] - x[v, 0], x[w, 1] - x[v, 1]
                _basis((dx * ux + dy * uy) / sx, (dy * ux - dx * uy) / sy, basis)
                for c in range(values.shape[2]):
                    for i in range(6):
                        out[w, c] += coefs[i, c] * basis[i]
                count[w] += 1


class _Sampled(NamedTuple):
    """What patches are fitted to: arguments of `_add_patches` in its order, see there and `recover`."""

    first: Index
    members: Index
    interior: Flags
    cells: Index
    x: Array
    X: Array
    values: Array
    counts: Array
    by_sides: bool


def _patches(nodes: Index, at: _Sampled, terms: int, reach: int, out: Array, count: Index) -> None:
    """`_add_patches` with scratch, which takes longer to compile in there than it takes to make here."""
    M, L = np.empty((2, 6, 6))
    scratch = M, L, np.empty(6), np.empty((6, at.values.shape[2]))
    _add_patches(nodes, *at, terms, reach, out, count, *scratch)


def _members(cells: Index, n: int) -> tuple[Index, Index]:
    """Elements that nodes belong to, one node's after another's, and where those of each begin (n + 1,)."""
    order = np.argsort(cells.ravel(), kind="stable")
    first = np.concatenate([[0], np.cumsum(np.bincount(cells.ravel(), minlength=n))])
    return (order // cells.shape[1]).astype(np.int64), first.astype(np.int64)


def _around(cells: Index, n: int, some: Flags) -> Flags:
    """Nodes (n,) of the elements that share a node with some of the elements (e,)."""
    near = np.zeros(n, dtype=np.bool_)
    near[cells[some]] = True
    near[cells[near[cells].any(axis=1)]] = True
    return near


def _counts(N: Array) -> Array:
    """How much the points of an element count for each of its nodes (a, q), from its shape functions at the points N (q, a).

    The power `BY_SHARE` of the share that the node has in the point when the element's sides are straight, or that the two ends
    of its side have together. An affine field of any shape of element is fitted exactly whatever the points count. Where
    only two stand each way there is none to spare, and all count alike: (0, q).
    """
    if len(N) == 4:
        return np.empty((0, 4))
    sides = 4 if N.shape[1] in (4, 8) else 3
    at = np.eye(3) if sides == 3 else np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    ends = np.roll(np.arange(sides), -1)
    place = N @ np.vstack([at, 0.5 * (at + at[ends])])[: N.shape[1]]
    share = (place if sides == 3 else np.prod(0.5 * (1.0 + at * place[:, None]), axis=2)).T
    return np.ascontiguousarray(np.vstack([share, share + share[ends]])[: N.shape[1]] ** BY_SHARE)


def recover(
    x: Array, cells: Index, X: Array, values: Array, kinked: Flags | None = None, centred: bool = False,
    N: Array | None = None, by_sides: bool = False,
) -> Array:  # fmt: skip
    """Nodal values (n, v) from point values (e, q, v) at positions X (e, q, 2); x (n, 2) nodes, cells (e, 3|4|6|8).

    kinked (e,): elements in or between which the values may have a kink, such as those that have yielded. ``centred``: the
    points of an element do not have the values of where they are, only their mean has that of their middle. N (q, a): shape
    functions at the points, by which near ones count more beside a kink; without, all count alike. ``by_sides``: the bilinear
    term of a patch is that of the sides of its quadrilaterals, not of the axes: values that enter a solution turn with it.
    """
    n, a = len(x), cells.shape[1]
    at = _sampled(x, cells, X, values)._replace(by_sides=by_sides and a in (4, 8))
    out, count = np.zeros((n, values.shape[2])), np.zeros(n, dtype=np.int64)
    _smooth(at, out, count)
    out /= np.maximum(count, 1)[:, None]
    skin = np.unique(boundary_edges(cells))
    if kinked is not None and kinked.any():
        near = skin[_around(cells, n, kinked)[skin]]
        # `count` has served: the node's own patch is now its only contribution, and is not divided.
        out[near] = 0.0
        _patches(near, at if N is None else at._replace(counts=_counts(N)), OWN_TERMS[a], OWN, out, count)
    if centred and at.interior.any():
        # `kinked` is given for elements that follow gradients, `centred` for the others: neither overwrites what the other has
        # done.
        reached, alike = skin[_reached(at)[skin]], np.ones(X.shape[1])
        middle = at._replace(X=_mean(X, alike), values=_mean(values, alike), counts=np.empty((0, 1)))
        out[reached] = _of_centres(middle)[reached]
    return out


def within_elements(cells: Index, N: Array, values: Array, nodal: Array) -> Array:
    """Nodal scalars (n, v) no further than what some element of the node makes of its own point values (m, q, v) there.

    That is their extremes, and the field, linear between its corners, that is nearest to them (Hinton & Campbell 1974), whose
    values at the nodes are bounded multiples whatever the element's shape. A polynomial in x and y is carried on to many times
    what any point has where elements turn by 45° or fold. N (q, a): shape functions at the points; cells (m, a).
    """
    at_points, at_nodes = of_corners(N)
    own = at_nodes @ np.linalg.pinv(at_points) @ values
    low, high = np.full(nodal.shape, np.inf), np.full(nodal.shape, -np.inf)
    np.minimum.at(low, cells, np.minimum(own, values.min(axis=1, keepdims=True)))
    np.maximum.at(high, cells, np.maximum(own, values.max(axis=1, keepdims=True)))
    return np.clip(nodal, low, high)


def with_tractions_of_centres(
    x: Array, cells: Index, X: Array, values: Array, nodal: Array, yielded: Flags, poisson: float | None,
    weight: Array,
) -> Array:  # fmt: skip
    """Nodal stresses (n, 4) xx, yy, zz, xy in which the normal stress at the outline is that of the means of the elements.

    An incompatible mode whose strain varies in ξ along ξ makes the stress along ξ the same throughout the element: in
    bending the strain along the normal is right then, but where a pressure decreases inwards its points lack that, an
    error of first order at the skin. Near elements that have not yielded everything is fitted by means (see `recover`).
    Near such that have, what is fitted may end in a kink within the layer: there the normal stress alone is, and the strain
    along the normal that it lacked comes with the others, metal that flows being incompressible: the same pressure more;
    else ν/(1 - ν) of it. Corners between two sides have no normal: near yielded elements they are left as they are, and
    in plane stress all nodes are, where sheets that flow get thinner.

    yielded (e,): elements that have yielded; ``poisson``: ν, None in plane stress; weight (q,) of the points in a mean; the
    rest as in `recover`.
    """
    at, out = _sampled(x, cells, X, values), nodal.copy()
    if not at.interior.any():
        return out
    at = at._replace(X=_mean(X, weight), values=_mean(values, weight), counts=np.empty((0, 1)))
    centres, reached = _of_centres(at), _reached(at)
    near = _around(cells, len(x), yielded)
    skin = np.unique(boundary_edges(cells))
    smooth = skin[reached[skin] & ~near[skin]]
    out[smooth] = centres[smooth]
    if poisson is None:
        return out
    none = np.zeros(len(x), dtype=np.bool_)
    nodes, (nx, ny) = _smooth_sides(x, cells, none, none)
    kept = (reached & near)[nodes]
    nodes, nx, ny = nodes[kept], nx[kept], ny[kept]
    xx, yy, _, xy = (centres - nodal)[nodes].T
    more = xx * nx**2 + 2.0 * xy * nx * ny + yy * ny**2
    flows = none.copy()
    flows[cells[yielded]] = True
    along = np.where(flows[nodes], 1.0, poisson / (1.0 - poisson))
    # The addition is Δσ_nn [n⊗n + ν/(1 − ν) (1 − n⊗n)], in components; 1 in the place of ν/(1 − ν) for metal that flows.
    share = np.column_stack([nx**2 + along * ny**2, ny**2 + along * nx**2, along, (1.0 - along) * nx * ny])
    out[nodes] += more[:, None] * share
    return out


def _sampled(x: Array, cells: Index, X: Array, values: Array) -> _Sampled:
    """What patches about interior nodes are fitted to, all points counting alike."""
    members, first = _members(cells, len(x))
    interior = np.zeros(len(x), dtype=np.bool_)
    interior[corner_cells(cells)] = True
    interior[boundary_edges(cells)] = False
    alike = np.empty((0, X.shape[1]))
    return _Sampled(first, members, interior, cells, x, np.ascontiguousarray(X), np.ascontiguousarray(values), alike, False)


def _reached(at: _Sampled) -> Flags:
    """Nodes (n,) that a patch about an interior node reaches."""
    out = np.zeros(len(at.x), dtype=np.bool_)
    out[at.cells[at.interior[at.cells].any(axis=1)]] = True
    return out


def _smooth(at: _Sampled, out: Array, count: Index) -> None:
    """Sums ``out`` (n, v) over the patches that reach nodes, and how many these are: those about interior nodes, then others."""
    a = at.cells.shape[1]
    _patches(np.flatnonzero(at.interior), at, TERMS[a], ALL, out, count)
    left = np.flatnonzero((count == 0) & ~at.interior)
    _patches(left, at, OUTER_TERMS[a], ITSELF, out, count)


def _mean(values: Array, weight: Array) -> Array:
    """Means (e, 1, v) of values at the points (e, q, v)."""
    return np.ascontiguousarray((weight / weight.sum()) @ values)[:, None]


def _of_centres(at: _Sampled) -> Array:
    """Nodal values (n, v) of patches through the one point that elements have, as far as patches about interior nodes reach."""
    out, count = np.zeros((len(at.x), at.values.shape[2])), np.zeros(len(at.x), dtype=np.int64)
    _smooth(at, out, count)
    return np.asarray(out / np.maximum(count, 1)[:, None])


def at_free_edges(
    x: Array, cells: Index, X: Array, values: Array, nodal: Array, loaded: Flags, held: Flags, yielded: Flags,
    poisson: float, revolved: bool,
) -> Array:  # fmt: skip
    """Nodal stresses (n, 4) xx, yy, zz, xy in which those of yielded bodies at free edges come from deviators and traction.

    Points of bilinear elements that are bent have the strains of where they are but for that along the normal, which does
    not vary along the normal, and their pressure is wrong for want of it, or the same in the whole element (F-bar). At an
    edge without traction σ_nn = σ_nt = 0 say what the pressure is: σ_tt = s_tt - s_nn, σ_zz = s_zz - s_nn. The deviators
    are those of the elements that the node belongs to. What they vary by within an element is put right by the strain along
    the normal that goes with it elastically, -ν/(1 - ν) of those along the edge: exact for what was released, which varies
    most; what varies while metal flows is small. Corners between two free sides are left as they are.

    Where all points around have yielded, or none, stresses have no kink, and patches do as well.

    loaded (n,): nodes on which a force acts; held (n,): nodes of supports, between which no side is free;
    yielded (e, q): points that have yielded; ``revolved``: hoop strains vary too; the rest as in `recover`.
    """
    n, a = len(x), cells.shape[1]
    nodes, (nx, ny) = _smooth_sides(x, cells, loaded, held)
    flows, some_rest = np.asarray(yielded.any(axis=1)), np.asarray(~yielded.all(axis=1))
    near = (~loaded & _around(cells, n, flows) & _around(cells, n, some_rest))[nodes]
    nodes, nx, ny = nodes[near], nx[near], ny[near]
    # One fit serves both the values and what varies within the elements, which alone is put right.
    both = np.concatenate([values, values - values.mean(axis=1, keepdims=True)], axis=2)
    # The law integrated at the surface with a history of its own is right in all cases too, but it is a second state to commit,
    # to store and to carry to new meshes.
    own = np.zeros((n, 2 * values.shape[2]))
    _patches(nodes, _sampled(x, cells, X, both), OWN_TERMS[a], OWN, own, np.zeros(n, dtype=np.int64))
    xx, yy, zz, xy = own[nodes].reshape(-1, 2, 4).T  # (2, nodes) each: the values, and what is within the elements of them
    across = xx * nx**2 + 2.0 * xy * nx * ny + yy * ny**2
    along, hoop = xx + yy - 2.0 * across, zz - across  # less σ_nn
    lacking = poisson / (1.0 - poisson) * (along[1] + hoop[1] if revolved else along[1])
    skin = along[0] + lacking
    out = nodal.copy()
    # F-bar of the plane takes half of what varies along the edge from the normal, which is about what zz lacks
    third = hoop[0] + lacking if revolved else hoop[0]
    out[nodes] = np.column_stack([skin * ny**2, skin * nx**2, third, -skin * nx * ny])
    return out


def mises_of(stress: Array) -> Array:
    """Von Mises stresses (…) of stresses (…, 4) xx, yy, zz, xy, in space (…, 6) with the two other shears."""
    xx, yy, zz, *shears = np.moveaxis(stress, -1, 0)
    shear = sum(s**2 for s in shears)
    return np.asarray(np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * shear))


def capped_at_flow_stress(x: Array, cells: Index, nodal: Array, limit: Array, thin: bool) -> Array:
    """Nodal stresses (n, 4) xx, yy, zz, xy of von Mises stresses up to ``limit`` (n,), the flow stress of the metal there.

    A patch carried to its ends may have more, and twice as much where a plastic zone ends within it. At the outline the
    traction stays as it is, and the stress along the skin and across the plane less that along the normal are the smaller;
    where there is no normal, or shear alone is too large, the deviator is, and the pressure stays. ``thin``: plane stress, where
    the stress across the plane is none; the whole stress is the smaller where no traction is.
    """
    out, mises = nodal.copy(), mises_of(nodal)
    over = mises > limit
    if not over.any():
        return out
    share = np.where(over, limit / np.where(over, mises, 1.0), 1.0)[:, None]
    pressure = np.zeros((len(out), 1)) if thin else nodal[:, :3].mean(axis=1, keepdims=True)
    mean = pressure * np.array([1.0, 1.0, 1.0, 0.0])
    out[over] = (mean + share * (nodal - mean))[over]
    none = np.zeros(len(x), dtype=np.bool_)
    nodes, (nx, ny) = _smooth_sides(x, cells, none, none)
    kept = over[nodes]
    nodes, nx, ny = nodes[kept], nx[kept], ny[kept]
    xx, yy, zz, xy = nodal[nodes].T
    nn = xx * nx**2 + 2.0 * xy * nx * ny + yy * ny**2
    nt = (yy - xx) * nx * ny + xy * (nx**2 - ny**2)
    tt = xx + yy - nn
    # In plane stress σ_tt² − σ_tt σ_nn + σ_nn² + 3 σ_nt² = limit² says |σ_tt − σ_nn/2| = √room.
    room = limit[nodes] ** 2 - 3.0 * nt**2 - (0.75 * nn**2 if thin else 0.0)
    if thin:
        half = np.sqrt(np.maximum(room, 0.0))
        skin, across = np.clip(tt, 0.5 * nn - half, 0.5 * nn + half), zz
    else:
        # Mises' square less 3 σ_nt² is homogeneous in σ_tt − σ_nn and σ_zz − σ_nn: one factor on both brings it to the limit.
        rest = np.maximum(mises[nodes] ** 2 - 3.0 * nt**2, SMALLEST)
        less = np.sqrt(np.clip(room / rest, 0.0, 1.0))
        skin, across = nn + less * (tt - nn), nn + less * (zz - nn)
    turned = [nn * nx**2 - 2.0 * nt * nx * ny + skin * ny**2, nn * ny**2 + 2.0 * nt * nx * ny + skin * nx**2]
    whole = np.column_stack([*turned, across, (nn - skin) * nx * ny + nt * (nx**2 - ny**2)])
    # Else traction alone is beyond the limit, and the smaller deviator of above stands.
    out[nodes[room >= 0.0]] = whole[room >= 0.0]
    return out


def _smooth_sides(x: Array, cells: Index, loaded: Flags, held: Flags) -> tuple[Index, Array]:
    """Nodes (k,) of free sides where the outline has no corner, and their unit normals (2, k)."""
    n = len(x)
    sides = boundary_edges(cells)[:, :2]
    sides = sides[~(held[sides].all(axis=1) | loaded[sides].all(axis=1))]
    along = x[sides[:, 1]] - x[sides[:, 0]]
    unit = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
    normal = np.zeros((n, 2))
    np.add.at(normal, sides.ravel(), np.repeat(unit, 2, axis=0))
    length, count = np.hypot(*normal.T), np.bincount(sides.ravel(), minlength=n)
    # Two unit normals at the angle φ add up to the length √(2 (1 + cos φ)).
    nodes = np.flatnonzero((count == 1) | ((count == 2) & (length**2 > 2.0 * (1.0 + NO_CORNER))))
    return nodes, (normal[nodes] / length[nodes, None]).T


def smoothed(x: Array, cells: Index, X: Array, values: Array) -> Array:
    """Nodal values as in `recover`, but extrapolated from the points of each element to its corners and averaged there.

    "Los puntos de integración del elemento … llevados a los nodos de contacto mediante interpolación y posterior
    suavización" (the paper); Hinton and Campbell (1974). The field of an element is the least-squares bilinear one
    of its points (of triangles the linear one), which for 2 × 2 points goes through them.
    """
    corners = x[cells]
    centre = corners.mean(axis=1, keepdims=True)
    size = np.abs(corners - centre).max(axis=(1, 2))[:, None, None]

    def basis(p: Array) -> Array:
        s, t = np.moveaxis((p - centre) / size, -1, 0)
        return np.stack([np.ones_like(s), s, t, s * t][: 3 if cells.shape[1] in (3, 6) else 4], axis=-1)

    at_corners = basis(corners) @ (np.linalg.pinv(basis(X)) @ values)
    out = np.zeros((len(x), values.shape[2]))
    np.add.at(out, cells, at_corners)
    return out / np.maximum(np.bincount(cells.ravel(), minlength=len(x)), 1)[:, None]
