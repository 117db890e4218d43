"""Names of the sides of a mesh that was read: those of the file, and what stands in for names that it lacks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from prensa.importers.deck import Deck
from prensa.mesh.mesh import CORNERS, Mesh, boundary_edges, edges_between, keys, named
from prensa.mesh.places import SIDES, corners_between, sides_by_place
from prensa.types import Array, Index


@dataclass(frozen=True)
class SideNames:
    """How the sides of one body of a ``file`` with contents ``deck`` are called.

    ``chosen``: labels of the body's cells; ``parts``: those that were asked for, of several.
    """

    file: str
    deck: Deck
    chosen: list[int]
    parts: tuple[str, ...] = ()

    def of(self, points: Array, cells: Index, label: Mapping[int, int]) -> Mesh:
        """The mesh of points (n, 2) and cells of one kind with names; ``label``: label of a node in the file → its number.

        The file's own names come first. Curves by their numbers, sides by place and common sides with other parts are added
        where they are missing: names that a file has are not doubled.

        Raises
        ------
        MeshError
            If no element can be computed on it, of which no outline need be one.

        """
        mesh = Mesh(points, cells, {})
        lines = self.deck.lines
        edges = on_outline(lines, cells, label)
        corners = _points(self.deck.points, edges, cells, label)
        notes = self._own({**edges, **corners})
        curves = on_outline(self.deck.curves, cells, label)
        if not lines and curves:
            edges |= {name: e for name, e in curves.items() if name not in edges}
            vertices = _points(self.deck.vertices, edges, cells, label)
            corners |= {name: n for name, n in vertices.items() if name not in corners}
            notes.append(f"{listed([*curves, *vertices])} are its curves and points by their numbers")
        if len(common := self._common(edges, cells, label)):
            edges |= common
            notes.append(f"{listed(common)}: where that part of the file meets this one")
        taken = {name.casefold() for name in (*lines, *self.deck.points)}
        if taken.isdisjoint(SIDES):
            sides = sides_by_place(points, cells, curves)
            edges |= sides
            corners |= {name: n for name, n in corners_between(sides).items() if name not in taken}
            notes += _placed(points, sides)
        return named(mesh, edges, {k: v for k, v in corners.items() if k not in edges}, tuple(notes))

    def _own(self, found: Iterable[str]) -> list[str]:
        """What there is to say of the names in the file."""
        notes = names_of_file(self.file, self.deck, self.deck.lines, list(found), "outline")
        if not self.parts and not self.deck.parts and len(self.deck.surfaces) > 1:
            notes.append(f"one body of all its surfaces; 'part' takes some of {listed(self.deck.surfaces)}")
        return notes

    def _common(self, edges: Mapping[str, Index], cells: Index, label: Mapping[int, int]) -> dict[str, Index]:
        """Stretches of the outline along which other parts of the file lie, as far as they have no name yet."""
        own = set(self.chosen)
        known = self.deck.parts if any(p in self.deck.parts for p in self.parts) else self.deck.surfaces
        if not self.parts or not self.deck.exclusive:
            return {}
        out: dict[str, Index] = {}
        for name, labels in known.items():
            if own.isdisjoint(labels) and name not in self.parts:
                rings = [c[: CORNERS[len(c)]] for e in labels if (c := self.deck.cells.get(e))]
                pairs = [(a, b) for c in rings for a, b in zip(c, (*c[1:], c[0])) if a in label and b in label]
                out |= on_outline({f"interface-{name}": pairs}, cells, label)
        n = int(cells.max()) + 1
        named = np.concatenate([keys(e[:, :2], n) for e in edges.values()]) if edges else np.zeros(0, dtype=np.int64)
        return {name: e for name, e in out.items() if not np.isin(keys(e[:, :2], n), named).all()}


def on_outline(
    groups: Mapping[str, Iterable[tuple[int, ...]]], cells: Index, label: Mapping[int, int]
) -> dict[str, Index]:
    """Edges (k, 2|3) of the outline of cells that are in groups of lines, each the labels of its nodes."""
    outline = boundary_edges(cells)
    n = int(cells.max()) + 1
    known = keys(outline[:, :2], n)
    out = {}
    for name, lines in groups.items():
        # All pairs of a line's nodes: of these only the two ends are a side of the outline, wherever the file puts the middle
        # node.
        pairs = [
            (label[a], label[b]) for g in lines for i, a in enumerate(g) for b in g[:i] if a in label and b in label
        ]
        if pairs:
            rows = np.isin(known, keys(np.array(pairs, dtype=np.int64), n))
            if rows.any():
                out[name] = outline[rows]
    return out


def _points(
    groups: Mapping[str, Iterable[int]], edges: dict[str, Index], cells: Index, label: Mapping[int, int]
) -> dict[str, int]:
    """Named points, sets of a single node; sets of more nodes are put among the ``edges`` where they are on the outline."""
    outline = boundary_edges(cells)
    corners = {}
    for name, nodes in groups.items():
        some = np.array(sorted({label[k] for k in nodes if k in label}), dtype=np.int64)
        if len(some) == 1:
            corners[name] = int(some[0])
        elif name not in edges and len(found := edges_between(outline, some)):
            edges[name] = found
    return {k: v for k, v in corners.items() if k not in edges}


def names_of_file(file: str, deck: Deck, sides: Iterable[str], found: Sequence[str], where: str) -> list[str]:
    """What there is to say of the names in a file: of its ``sides`` and points, ``found`` on the outline or outside."""
    names = dict.fromkeys([*sides, *deck.points])
    notes = [f"{listed(found)}: {deck.source} of {file}"] if found else []
    if missing := [name for name in names if name not in found]:
        notes.append(f"{listed(missing)} of {file} is not on the {where} of this body")
    return notes if names else [*notes, f"{file} names no sides (names are its {deck.source})"]


def _placed(points: Array, sides: Mapping[str, Index]) -> list[str]:
    """What was taken for the sides by place, and which there are not."""
    taken = []
    for name, e in sides.items():
        low, high = points[e].reshape(-1, 2).min(axis=0), points[e].reshape(-1, 2).max(axis=0)
        at = ", ".join(f"{c} {a:g}" if a == b else f"{c} {a:g} … {b:g}" for c, a, b in zip("xy", low, high))
        taken.append(f"{name!r} ({at})")
    notes = [f"found by place: {', '.join(taken)}"] if taken else []
    if missing := [name for name in SIDES if name not in sides]:
        notes.append(
            f"{listed(missing)} could not be found by place: no stretch between corners lies or looks that way alone"
        )
    return notes


def listed(names: Iterable[str]) -> str:
    """Names in a message; of many the first and the last."""
    shown = [repr(name) for name in names]
    return ", ".join(shown) if len(shown) <= 12 else f"{', '.join(shown[:6])}, … {shown[-1]} ({len(shown)})"
