"""What bricks are refused for, and the faces and Jacobians by which that is found."""

from __future__ import annotations

from itertools import product

import numpy as np

from prensa.mesh.faces import shapes
from prensa.mesh.mesh import MeshError, check_apart, within, written
from prensa.precision import DRAWN, SMALLEST
from prensa.types import Array, Flags, Index

# corners of the six faces of a brick, seen from outside counter-clockwise
FACES = np.array([(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])
EDGE_ENDS = np.array([(1, 3, 4), (2, 0, 5), (3, 1, 6), (0, 2, 7), (7, 5, 0), (4, 6, 1), (5, 7, 2), (6, 4, 3)])
"""Corners at the other ends of the three edges of a corner, right-handed."""
TETRAHEDRON_ENDS = np.array([(1, 2, 3), (2, 0, 3), (0, 1, 3), (1, 0, 2)])
"""The same of a tetrahedron."""
_BRICK_CORNERS = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)])
_GAUSS_POINTS = np.array(list(product(np.polynomial.legendre.leggauss(2)[0].tolist(), repeat=3)))
_VOLUME_COORDINATES = np.vstack([
    0.05 * (5.0 - np.sqrt(5.0)) + np.sqrt(0.2) * np.eye(4), np.eye(4),
    0.5 * (np.eye(4)[[0, 1, 2, 0, 1, 2]] + np.eye(4)[[1, 2, 0, 3, 3, 3]]),
])  # fmt: skip
_TETRAHEDRON_POINTS = _VOLUME_COORDINATES[:, 1:]
"""The four integration points, then the nodes."""
_BRICK_EDGES = frozenset((a, b) for a, row in enumerate(EDGE_ENDS.tolist()) for b in row)


def collapsed(faces: Index) -> Flags:
    """Faces (k,) of fewer than three nodes."""
    return np.asarray((np.diff(np.sort(faces, axis=1), axis=1) == 0).sum(axis=1) > 1)


def face_keys(faces: Index) -> Index:
    """Rows (k, 4) that are equal for faces of the same nodes, whichever of a triangle's three stands twice."""
    rows = np.sort(faces, axis=1)
    rows[:, 1:][np.diff(rows, axis=1) == 0] = -1
    return np.sort(rows, axis=1)


def corner_edges(places: Array) -> Array:
    """Edges (m, 8, 3, 3) from the corners of bricks with nodes at ``places`` (m, 8, 3) to `EDGE_ENDS`, right-handed.

    A corner of a wedge that coincides with another has the edge of that one in the place of the collapsed one between the two, so
    that there are three edges of the wedge at each.
    """
    edges = np.asarray(places[:, EDGE_ENDS] - places[:, :, None])
    gone = np.asarray((edges == 0.0).all(axis=3))
    for corner, way in np.argwhere(gone.any(axis=0)).tolist():
        at = gone[:, corner, way]
        for end in EDGE_ENDS[EDGE_ENDS[corner, way]]:
            beyond = places[:, end] - places[:, corner]
            known = (beyond[:, None] == edges[:, corner]).all(axis=2).any(axis=1)
            new = at & beyond.any(axis=1) & ~known
            edges[new, corner, way] = beyond[new]
            at = at & ~new
    return edges


def jacobians(places: Array) -> Array:
    """Determinants (m, 8) at the 2 x 2 x 2 integration points of bricks with nodes at ``places`` (m, 8, 3)."""
    return np.asarray(np.linalg.det(_tangents(places)))


def scaled_jacobians(places: Array) -> Array:
    """Volumes (m, 8) spanned there by the directions of the three tangents: 1 of a box, 0 where they lie in a plane."""
    tangents = _tangents(places)
    return np.asarray(np.linalg.det(tangents / np.maximum(np.linalg.norm(tangents, axis=3, keepdims=True), SMALLEST)))


def _tangents(places: Array) -> Array:
    """Derivatives (m, 8, 3, 3) of the place along each coordinate of the bricks, at their integration points."""
    slopes = []
    for at in _GAUSS_POINTS:
        x, y, z = (1.0 + _BRICK_CORNERS * at).T
        slopes.append(0.125 * _BRICK_CORNERS * np.stack([y * z, x * z, x * y], axis=1))
    return np.asarray(np.swapaxes(slopes, 1, 2) @ places[:, None])


def tetrahedron_jacobians(places: Array) -> Array:
    """Determinants (m, 14) at the integration points and the nodes of tetrahedra with nodes at ``places`` (m, 10, 3)."""
    slopes = shapes(_TETRAHEDRON_POINTS, 10)[1]
    return np.asarray(np.linalg.det(np.swapaxes(slopes, 1, 2) @ places[:, None]))


def check_bricks(points: Array, cells: Index) -> None:
    """Raise MeshError for what no brick (m, 8) or tetrahedron (m, 10) can be computed on.

    That is: coordinates and node numbers that are none, nodes of no brick, nodes that a brick names twice otherwise than a wedge
    does, bricks that are turned over or left-handed, and bricks that overlap.
    """
    if not np.isfinite(points).all():
        raise MeshError(f"node {int(np.argwhere(~np.isfinite(points))[0, 0])} has a coordinate that is not a number")
    if len(cells) == 0 or cells.min() < 0 or cells.max() >= len(points):
        raise MeshError(f"bricks need nodes of the {len(points)} that there are")
    if len(unused := np.setdiff1d(np.arange(len(points)), cells)):
        raise MeshError(f"node {unused[0]} at {points[unused[0]].tolist()} belongs to no brick; remove it")
    if cells.shape[1] == 10:
        _check_tetrahedra(points, cells)
        return
    _check_repeated(points, cells)
    det = jacobians(points[cells])
    if (det <= 0.0).any():
        e = int(np.argmin((det / np.abs(det).max(axis=1, keepdims=True)).min(axis=1)))
        if (det[e] < 0.0).all():
            raise MeshError(
                f"brick {e} {near(points, cells[e])} is left-handed; list its lower four nodes counter-clockwise seen from "
                "above, then those above them"
            )
        raise MeshError(
            f"brick {e} {near(points, cells[e])} is turned over: its Jacobian is {det[e].min():.3g} at one of its points and "
            f"{det[e].max():.3g} at another; move its nodes, or mesh it again"
        )
    _check_faces(points, cells)


def _check_tetrahedra(points: Array, cells: Index) -> None:
    """Ten nodes of each, corners not turned over, and two at most at a face."""
    if len(twice := np.flatnonzero((np.diff(np.sort(cells, axis=1), axis=1) == 0).any(axis=1))):
        raise MeshError(f"tetrahedron {twice[0]} names a node twice: {cells[twice[0]].tolist()}")
    det = tetrahedron_jacobians(points[cells])
    if len(turned := np.flatnonzero((det <= 0.0).all(axis=1))):
        raise MeshError(
            f"tetrahedron {turned[0]} {near(points, cells[turned[0]])} is turned over; list its first three corners "
            "counter-clockwise seen from the fourth"
        )
    if (det <= 0.0).any():
        e = int(np.argmin((det / np.abs(det).max(axis=1, keepdims=True)).min(axis=1)))
        raise MeshError(f"tetrahedron {e} {near(points, cells[e])} is {bent_over(det)}")
    corners = np.sort(cells[:, [(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)]].reshape(-1, 3), axis=1)
    if np.unique(corners, axis=0, return_counts=True)[1].max() > 2:
        raise MeshError("three tetrahedra have a face in common: they overlap")


def bent_over(det: Array) -> str:
    """What is wrong with the tetrahedra of which one bends over itself, by their determinants (m, 14), and what to do."""
    wrong = (det <= 0.0).any(axis=1)
    worst = det[wrong][np.argmin((det[wrong] / np.abs(det[wrong]).max(axis=1, keepdims=True)).min(axis=1))]
    return (
        f"bent over by a node in the middle of a side: its Jacobian is {worst.min():.3g} at one of its nodes and "
        f"{worst.max():.3g} at another ({np.count_nonzero(wrong)} of {len(det)} are); use shorter elements along curved faces, "
        "or straighten them ('Mesh.HighOrderOptimize = 2;' or 'Mesh.SecondOrderLinear = 1;' in gmsh)"
    )


def near(points: Array, cell: Index) -> str:
    """Where a brick is."""
    return f"near ({', '.join(f'{c:g}' for c in points[cell].mean(axis=0))})"


def _check_repeated(points: Array, cells: Index) -> None:
    """Nodes named twice must be those of one edge or of the two edges of a wedge that collapsed."""
    for e in np.flatnonzero((np.diff(np.sort(cells, axis=1), axis=1) == 0).any(axis=1)).tolist():
        cell = cells[e].tolist()
        pairs = [(a, b) for a in range(8) for b in range(a + 1, 8) if cell[a] == cell[b]]
        ends = {n for pair in pairs for n in pair}
        if len(pairs) > 2 or len(ends) < 2 * len(pairs) or not _BRICK_EDGES.issuperset(pairs) or not _of_one_face(pairs):
            raise MeshError(
                f"brick {e} {near(points, cells[e])} names a node twice: {cell}; of a wedge, write the ends of two edges of one "
                "face, as in [a, b, c, c, d, e, f, f]"
            )


def _of_one_face(pairs: list[tuple[int, int]]) -> bool:
    """Whether one face has all the corners of the edges."""
    ends = {n for pair in pairs for n in pair}
    return any(ends <= set(face) for face in FACES.tolist())


def _check_faces(points: Array, cells: Index) -> None:
    """A face has two bricks at most, on either side of it."""
    faces = cells[:, FACES].reshape(-1, 4)
    kept = np.flatnonzero(~collapsed(faces))
    keys, number, count = np.unique(face_keys(faces[kept]), axis=0, return_inverse=True, return_counts=True)
    number = number.reshape(-1)
    if count.max() > 2:
        three = kept[number == int(np.argmax(count))] // len(FACES)
        raise MeshError(
            f"bricks {', '.join(map(str, three[:3]))} {near(points, cells[three[0]])} have a face in common: they overlap"
        )
    # Neighbours go round their common face in opposite directions, which turns once as often up as down in one of them.
    same = np.bincount(number, _directions(faces[kept]), len(keys))
    if len(wrong := np.flatnonzero((count == 2) & (same != 0.0))):
        a, b = (kept[number == wrong[0]] // len(FACES)).tolist()
        raise MeshError(f"bricks {a} and {b} {near(points, cells[a])} lie on the same side of a common face: they overlap")


def _directions(faces: Index) -> Array:
    """1 or -1 (k,): whether faces name their nodes from the least one on to the smaller of its neighbours, or the other way."""
    k, turned = np.arange(len(faces)), np.where(faces == np.roll(faces, -1, axis=1), -1, faces)
    # A triangle's double node is passed over: the node after it is the follower of the least one, or that before it.
    least = np.where(turned < 0, faces.max(initial=0) + 1, turned).argmin(axis=1)
    after, before = turned[k, (least + 1) % 4], turned[k, (least - 1) % 4]
    after = np.where(after < 0, turned[k, (least + 2) % 4], after)
    before = np.where(before < 0, turned[k, (least - 2) % 4], before)
    return np.where(after < before, 1.0, -1.0)


def check_joints(points: Array, faces: Index) -> None:
    """Raise MeshError for nodes of the outside faces (k, 4) at one place, or within a face or edge of another: it is open."""
    nodes = np.unique(faces)
    close = check_apart(points, nodes)
    x = points[faces]
    middle = x.mean(axis=1)
    i, j = within(points[nodes], middle, np.linalg.norm(x - middle[:, None], axis=2).max(axis=1))
    own = (faces[i] == nodes[j][:, None]).any(axis=1)
    i, j = i[~own], j[~own]
    on = np.zeros(len(i), dtype=bool)
    for corners in ((0, 1, 2), (0, 2, 3)):
        on |= _on_triangles(points[nodes[j]], x[i][:, corners], close)
    if on.any():
        k = int(np.argmax(on))
        raise MeshError(
            f"node {nodes[j[k]]} at {written(points[nodes[j[k]]])} hangs in the face of the nodes {faces[i[k]].tolist()}; "
            "split that element, or make two bodies"
        )


def _on_triangles(p: Array, x: Array, close: float) -> Flags:
    """Whether points p (k, 3) lie in triangles x (k, 3, 3), within a distance of their planes."""
    u, v, r = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0], p - x[:, 0]
    n = np.cross(u, v)
    twice = np.maximum(np.linalg.norm(n, axis=1), SMALLEST)
    n = n / twice[:, None]
    a = np.einsum("ki,ki->k", np.cross(r, v), n) / twice
    b = np.einsum("ki,ki->k", np.cross(u, r), n) / twice
    flat = np.abs(np.einsum("ki,ki->k", r, n)) <= close
    return np.asarray(flat & (a >= -DRAWN) & (b >= -DRAWN) & (a + b <= 1.0 + DRAWN) & (twice > close**2))
