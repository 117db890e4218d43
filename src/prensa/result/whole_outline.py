"""The outline of a body together with its mirror images across lines of symmetry and the axis of revolution.

A half model has half of a notch: what its flank comes to is its own mirror image. The whole outline consists of the body's own
pieces, without those on the lines, and of their images across each line and across two lines that cross.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from prensa.mesh.mesh import segments
from prensa.precision import NEGLIGIBLE
from prensa.system.symmetry_planes import Mirror, free_faces, mirrors_of
from prensa.system.system import System
from prensa.types import Array, Flags, Index


class WholeOutline(NamedTuple):
    """Straight pieces ``ends`` (k, 2) between nodes of a body of n nodes and of its images, the body on the left of each.

    Node i of image number c is c n + i; image 0 is the body, and what lies on a line is there alone. ``images``: the lines that
    each is mirrored across. ``modelled`` (l,): which pieces of the body's own outline are in it, those on no line. ``loops``:
    nodes of its closed parts in walking order, of which each has some of the body; ``own``: those of the body's outline alone.
    """

    n: int
    images: list[tuple[Mirror, ...]]
    ends: Index
    modelled: Flags
    loops: list[Index]
    own: list[Index]

    @property
    def lines(self) -> list[Mirror]:
        """All lines."""
        return [image[0] for image in self.images if len(image) == 1]

    def placed(self, nodes: Index, x: Array) -> Array:
        """Places (m, 2) of nodes (m,) of the whole outline, those of the body being at x (n, 2)."""
        out, image = x[nodes % self.n], nodes // self.n
        for number, lines in enumerate(self.images):
            for line in lines:
                there = image == number
                out[there] = line.plane.image(out[there])
        return out

    def image_of(self, node: int, line: Mirror) -> int:
        """The image of a node of the body across one line."""
        return node + self.images.index((line,)) * self.n

    def across(self, nodes: Index) -> Mirror | None:
        """A line that lies between nodes (m,) of the body and of an image; None if all are of the body."""
        return next(iter(self.images[int(nodes.max()) // self.n]), None)

    def modelled_side(self, x: Array) -> Array:
        """Places (m, 2), mirrored to the side of each line on which the body lies."""
        for line in self.lines:
            beyond = line.distance(x) < 0.0
            x = x.copy()
            x[beyond] = line.plane.image(x[beyond])
        return x


_KNOWN: WeakKeyDictionary[System, dict[str, WholeOutline]] = WeakKeyDictionary()
"""Of each system those that have been asked for: meshes and lines of symmetry of a system do not change."""


def whole_outline(system: System, body: str) -> WholeOutline:
    """The whole outline of a body in the plane; its own without lines of symmetry (see `mirrors_of`)."""
    known = _KNOWN.setdefault(system, {})
    if body not in known:
        known[body] = _whole(system, body)
    return known[body]


def _whole(system: System, body: str) -> WholeOutline:
    first, mesh = system.first or system, system.meshes[body]
    n, ends = len(mesh.points), segments(mesh.boundary)
    # what is free on a line of symmetry, as a crack is, may open: the outline is not one with its image there
    lines = [line for line in mirrors_of(first, body, first.X) if not len(free_faces(first, line, body, first.X)[1])]
    if not lines:
        own = _loops(ends)
        return WholeOutline(n, [()], ends, np.ones(len(ends), dtype=bool), own, own)
    X = system.X[system.span(body)]
    on = {
        line: np.asarray((np.abs(line.distance(X[ends])) <= NEGLIGIBLE * system.length).all(axis=1)) for line in lines
    }
    across = [[(), *((line,) for line in lines if line.plane.axis == axis)] for axis in (0, 1)]
    images: list[tuple[Mirror, ...]] = [a + b for a, b in product(*across)]
    parts = [_mirrored(images, image, on, ends, n) for image in images]
    modelled = ~np.any(list(on.values()), axis=0)
    whole = np.concatenate(parts)
    loops = [nodes for nodes in _loops(whole) if (nodes < n).any()]
    return WholeOutline(n, images, whole, np.asarray(modelled), loops, _loops(ends))


def _loops(ends: Index) -> list[Index]:
    """Nodes of closed outlines in walking order, from straight pieces (k, 2)."""
    after, out = dict(ends.tolist()), []
    while after:
        at, loop = next(iter(after)), []
        while at in after:
            loop.append(at)
            at = after.pop(at)
        out.append(np.array(loop))
    return out


def _mirrored(
    images: Sequence[tuple[Mirror, ...]], image: tuple[Mirror, ...], on: dict[Mirror, Flags], ends: Index, n: int
) -> Index:
    """Pieces (k, 2) of one image; of pieces on a line only those of which no other image lies on the far side."""
    keep, nodes = np.ones(len(ends), dtype=bool), images.index(image) * n + np.arange(n)
    for line, there in on.items():
        if line in image:
            beside = tuple(other for other in image if other != line)
            shared = np.unique(ends[there])
            nodes[shared] -= (images.index(image) - images.index(beside)) * n
        if line in image or all(other.plane.axis != line.plane.axis for other in image):
            keep &= ~there
    out = nodes[ends[keep]]
    return out[:, ::-1] if len(image) % 2 else out
