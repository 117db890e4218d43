"""Loads on bodies in Abaqus decks: pressures on sides, forces per volume, nodal forces that are those of an even traction."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import hypot, pi
from typing import Any

from numpy.polynomial.legendre import leggauss

from prensa.importers.abaqus_keywords import Keyword, Scope
from prensa.importers.abaqus_places import Side, faces_alike, is_face
from prensa.importers.deck import LABELS, FileError
from prensa.precision import DRAWN

OF_VOLUME: dict[int, dict[str, tuple[float, ...]]] = {
    2: {"BX": (1.0, 0.0), "BY": (0.0, 1.0), "BR": (1.0, 0.0), "BZ": (0.0, 1.0)},
    3: {"BX": (1.0, 0.0, 0.0), "BY": (0.0, 1.0, 0.0), "BZ": (0.0, 0.0, 1.0)},
}
"""Directions of forces per volume, by the dimension."""
REMEDY = (
    "nodal forces are read on reference nodes of rigid bodies, and where together they are an even traction on sides; "
    "write the traction as *DSLOAD, or press with a rigid surface"
)


@dataclass
class Loads:
    """Loads of a step: what a deck leaves as it is holds on, ``OP=NEW`` takes away what it does not say again.

    ``faces`` names the boundaries that rows of sides of elements are, ``volumes`` the bodies of an element set with their
    density, ``forced`` the boundaries and the traction that nodal forces are, ``nodes`` those of a set or number.
    """

    faces: Callable[[Scope, list[tuple[int, list[str]]]], list[str]]
    volumes: Callable[[int, str, Scope], list[tuple[str, float | None]]]
    forced: Callable[[int, dict[int, float]], list[tuple[str, float]]]
    nodes: Callable[[int, str, Scope], list[int]]
    dimension: int = 2
    pressed: dict[tuple[str, str], float] = field(default_factory=dict)  # (keyword, boundary) → pressure
    pulled: dict[tuple[str, int], float] = field(default_factory=dict)  # (boundary, component) → traction
    pulled_by: dict[tuple[str, int], str] = field(default_factory=dict)  # the same → keyword
    per_volume: dict[tuple[str, str], list[Any]] = field(default_factory=dict)  # (body, kind of load) → x, y
    on_nodes: dict[tuple[int, int], str] = field(default_factory=dict)  # (node, component) → boundary of its force
    stale: dict[str, set[Any]] = field(default_factory=dict)

    def renewed(self, k: Keyword) -> None:
        """Note what a keyword with OP=NEW has to say again."""
        if k.parameters.get("OP", "MOD").upper() != "NEW":
            return
        holding: set[tuple[Any, ...]] = {("p", *key) for key in self.pressed if key[0] == k.name}
        holding |= {("v", *key) for key in self.per_volume} if k.name == "DLOAD" else set()
        holding |= {("t", *key) for key, by in self.pulled_by.items() if by == k.name and key in self.pulled}
        self.stale.setdefault(k.name, holding)

    def said(self, k: Keyword, *what: Any) -> None:
        """Note that it has said something again."""
        self.stale.get(k.name, set()).discard(what)

    def close(self, step: dict[str, Any]) -> None:
        """End a step: loads that OP=NEW has not said again go to zero."""
        for kind, *key in (what for whats in self.stale.values() for what in whats):
            if kind == "p":
                del self.pressed[key[0], key[1]]
                step["loads"][key[1]] = {"pressure": 0.0}
            elif kind == "v":
                del self.per_volume[key[0], key[1]]
                self._sum(step, key[0], 0)
            else:
                self.pulled[key[0], key[1]] = 0.0
                self._traction(step, key[0], key[1], 0.0)
                del self.pulled[key[0], key[1]]
        self.stale = {}

    def press(self, k: Keyword, step: dict[str, Any], boundary: str, value: float, table: list[list[float]] | None) -> None:
        """A pressure on a boundary."""
        self._one_kind(k, boundary, any(key[0] == boundary and t for key, t in self.pulled.items()))
        self.said(k, "p", k.name, boundary)
        step["loads"][boundary] = {"pressure": table or value}
        self.pressed[k.name, boundary] = value

    def _one_kind(self, k: Keyword, boundary: str, other: bool) -> None:
        if other:
            raise FileError.at(
                k.line, f"{boundary!r} has a pressure and a traction: a side has one of them here; write both as *DSLOAD, TRVEC"
            )

    def pull(
        self, k: Keyword, step: dict[str, Any], boundary: str, values: Iterable[tuple[int, float]],
        table: Callable[[Keyword, float], Any],
    ) -> None:  # fmt: skip
        """A traction on a boundary, by its components (0, 1[, 2])."""
        for c, value in values:
            self._one_kind(k, boundary, any(key[1] == boundary and p for key, p in self.pressed.items()))
            self.said(k, "t", boundary, c)
            self.pulled[boundary, c], self.pulled_by[boundary, c] = value, k.name
            self._traction(step, boundary, c, table(k, value) or value)

    def dload(self, k: Keyword, scope: Scope, step: dict[str, Any], table: Callable[[Keyword, float], Any]) -> None:
        """Pressures on sides of elements, gravity and forces per volume.

        Raises
        ------
        FileError
            For loads of other kinds, with their line.

        """
        for rows in faces_alike(k):
            value = k.number(rows[0][1], 2)
            for name in self.faces(scope, rows):
                self.press(k, step, name, value, table(k, value))
        for line, row in k.data:
            kind = row[1].upper() if len(row) > 1 else ""
            if is_face(kind):
                continue
            if kind != "GRAV" and kind not in OF_VOLUME[self.dimension]:
                known = "P1 … P4, GRAV, BX and BY" if self.dimension == 2 else "P1 … P6, GRAV, BX, BY and BZ"
                raise FileError.at(line, f"of *DLOAD pressures {known} are read, not {kind or 'nothing'!r}")
            for body, density in self.volumes(line, row[0], scope):
                if kind == "GRAV" and density is None:
                    raise FileError.at(line, f"gravity on {body!r}, whose material has no *DENSITY")
                given = tuple(k.number(row, 3 + i, 0.0) for i in range(self.dimension))
                way = given if kind == "GRAV" else OF_VOLUME[self.dimension][kind]
                if kind == "GRAV" and self.dimension == 2 and k.number(row, 5, 0.0):
                    raise FileError.at(line, "gravity points out of the plane of x and y")
                size = k.number(row, 2) * (density or 0.0 if kind == "GRAV" else 1.0) / (hypot(*way) or 1.0)
                self.said(k, "v", body, kind)
                self.per_volume[body, kind] = [table(k, size * w) or size * w + 0.0 for w in way]
                self._sum(step, body, line)

    def _sum(self, step: dict[str, Any], body: str, line: int) -> None:
        parts = [value for (of, _), value in self.per_volume.items() if of == body]
        total: list[Any] = [0.0] * self.dimension
        for c in range(self.dimension):
            acting = [p[c] for p in parts if p[c]]
            if len(acting) > 1 and not all(isinstance(a, float) for a in acting):
                raise FileError.at(line, f"two forces per volume on {body!r}, one with an amplitude: write them as one")
            total[c] = acting[0] if len(acting) == 1 else sum(acting)
        step["body_force"][body] = total

    def cload(
        self, k: Keyword, scope: Scope, step: dict[str, Any], rows: list[tuple[int, list[str]]],
        table: Callable[[Keyword, float], Any],
    ) -> None:  # fmt: skip
        """Forces on nodes of bodies, where together they are an even traction."""
        for c, dof in enumerate("123"[: self.dimension]):
            forces: dict[int, float] = {}
            mine = [(line, row) for line, row in rows if row[1:2] == [dof]]
            for line, row in mine:
                nodes = self.nodes(line, row[0], scope)
                if not nodes:
                    raise FileError.at(line, f"{row[0]!r} is not a node or set of nodes of this deck")
                if twice := next((n for n in nodes if n in forces), None):
                    raise FileError.at(line, f"node {twice % LABELS} has two forces along {'xyz'[c]}; write their sum")
                forces |= dict.fromkeys(nodes, k.number(row, 2))
            for name, traction in self.forced(mine[0][0], forces) if mine else ():
                for n in forces:
                    other = self.on_nodes.setdefault((n, c), name)
                    if other != name and self.pulled.get((other, c)):
                        raise FileError.at(
                            mine[0][0], f"node {n % LABELS} has a force along {'xyz'[c]} already, together with other nodes; "
                            "write the forces of all of them again, each time under one keyword"
                        )  # fmt: skip
                    self.on_nodes[n, c] = name
                self.pull(k, step, name, [(c, traction)], table)

    def _traction(self, step: dict[str, Any], name: str, c: int, value: Any) -> None:
        now = step["loads"].setdefault(name, {"traction": [self.pulled.get((name, i), 0.0) for i in range(self.dimension)]})
        now["traction"][c] = value


def even_traction(
    line: int, forces: dict[int, float], sides: Iterable[Side], nodes: dict[int, tuple[float, float, float]], depth: float | None,
    solid: bool = False,
) -> float:  # fmt: skip
    """Traction of which nodal forces are the consistent ones.

    line: where they stand. forces: by node. sides: of which the nodes are these. depth: thickness, None around an axis (forces
    are then of the whole circumference). solid: whether sides are faces in space.

    Raises
    ------
    FileError
        If they are those of no even traction.

    """
    weights = dict.fromkeys(forces, 0.0)
    for side in sides:
        for n, w in (_shares_of_face(side, nodes) if solid else _shares(side, nodes, depth)).items():
            weights[n] += w
    area = sum(weights.values())
    traction = sum(forces.values()) / area if area else 0.0
    worst = max(forces, key=lambda n: abs(forces[n] - traction * weights[n]))
    largest = max(abs(f) for f in forces.values())
    if not area or abs(forces[worst] - traction * weights[worst]) > DRAWN * largest:
        share = traction * weights[worst]
        even = f"it carries {forces[worst]:g}, of an even traction {share:g}" if area else "it is on no side"
        raise FileError.at(line, f"the force on node {worst % LABELS}: {even}; {REMEDY}")
    return traction


def _shares_of_face(face: Side, nodes: dict[int, tuple[float, float, float]]) -> dict[int, float]:
    """Area of a face of straight sides that each of its nodes carries under an even traction."""
    x = [nodes[n] for n in face]

    def area(u: Sequence[float], v: Sequence[float]) -> float:
        return hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])

    def between(weights: Sequence[float]) -> list[float]:
        return [sum(w * p[i] for w, p in zip(weights, x)) for i in range(3)]

    if len(face) in (3, 6):  # of six nodes those in the middle of the sides alone
        third = area(between((-1.0, 1.0, 0.0)), between((-1.0, 0.0, 1.0))) / 6.0
        return dict.fromkeys(face, third) if len(face) == 3 else dict.fromkeys(face[:3], 0.0) | dict.fromkeys(face[3:], third)
    share, signs = dict.fromkeys(face, 0.0), ((-1, -1), (1, -1), (1, 1), (-1, 1))
    for s, t in product(leggauss(2)[0].tolist(), repeat=2):
        at = area(between([0.25 * a * (1 + b * t) for a, b in signs]), between([0.25 * b * (1 + a * s) for a, b in signs]))
        for n, (a, b) in zip(face, signs):
            share[n] += 0.25 * (1 + a * s) * (1 + b * t) * at
    return share


def _shares(side: Side, nodes: dict[int, tuple[float, float, float]], depth: float | None) -> dict[int, float]:
    """Area of a side that each of its nodes carries under an even traction."""
    share = dict.fromkeys(side, 0.0)
    shapes: tuple[float, ...]
    slopes: tuple[float, ...]
    # Three Gauss points are exact for straight quadratic sides and their radius.
    for s, weight in zip(*(x.tolist() for x in leggauss(3))):
        if len(side) == 3:
            shapes, slopes = (s * (s - 1) / 2, s * (s + 1) / 2, 1 - s * s), (s - 0.5, s + 0.5, -2 * s)
        else:
            shapes, slopes = ((1 - s) / 2, (1 + s) / 2), (-0.5, 0.5)
        dx, dy = (sum(g * nodes[n][i] for g, n in zip(slopes, side)) for i in (0, 1))
        radius = sum(g * nodes[n][0] for g, n in zip(shapes, side))
        area = weight * hypot(dx, dy) * (2 * pi * radius if depth is None else depth)
        for g, n in zip(shapes, side):
            share[n] += g * area
    return share
