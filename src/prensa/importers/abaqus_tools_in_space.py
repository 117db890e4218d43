"""Rigid surfaces of Abaqus decks in space: analytical ones as swept profiles, those of elements as triangles of an STL file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from prensa.geometry.sections import section_axes
from prensa.importers import stl
from prensa.importers.abaqus_keywords import Keyword, Scope
from prensa.importers.abaqus_places import Side, ends
from prensa.importers.abaqus_tools import RigidTool, segments
from prensa.importers.deck import FileError
from prensa.precision import DRAWN
from prensa.types import Array

SWEPT = ("CYLINDER", "REVOLUTION")


@dataclass
class SpatialTool(RigidTool):
    """A rigid surface in space.

    Of an analytical one ``kind`` is a word of `SWEPT`, ``origin`` (3,) that of its profile, ``frame`` (3, 3): in rows the two
    axes of the profile and the direction along which it is extruded; of a revolution the axis, three times. Of one of elements
    ``faces`` are their sides, by the labels of nodes.
    """

    kind: str = ""
    origin: Array = field(default_factory=lambda: np.zeros(3))
    frame: Array = field(default_factory=lambda: np.eye(3))
    faces: list[Side] = field(default_factory=list)

    def draw(self, nodes: dict[int, tuple[float, float, float]], symmetry: list[tuple[int, float]]) -> None:
        """Nothing: a surface in space has no vertices but those that it is given."""

    def swept(self, reference: Array, bodies: Array) -> dict[str, Any]:
        """An analytical surface as a case has it, with the bodies, by the middles (k, 3) of their elements, outside.

        Raises
        ------
        FileError
            If a surface of revolution has its reference node off its axis.

        """
        if self.kind == "CYLINDER":
            axis = self.frame[2]
            across = section_axes(axis)
            into, shift = self.frame[:2] @ across, (self.origin - reference) @ across
            near = (bodies - reference) @ across
        else:
            axis, apart = self.frame[2], self.origin - reference
            off = apart - (apart @ axis) * axis
            if np.linalg.norm(off) > DRAWN * np.abs(np.array(_coordinates(self.vertices))).max():
                raise FileError.at(self.line, f"the reference node of {self.name!r} is off the axis of revolution: put it there")
            into, shift = np.eye(2), np.array([0.0, apart @ axis])
            height = (bodies - reference) @ axis
            near = np.column_stack([np.linalg.norm(bodies - reference - height[:, None] * axis, axis=1), height])

        def placed(x: Sequence[float]) -> tuple[float, float]:
            u, v = np.array(x) @ into + shift
            return float(u), float(v)

        walk = [{key: placed(x) for key, x in v.items()} if isinstance(v, dict) else placed(v) for v in self.vertices]
        profile = RigidTool(self.name, self.line, walk, self.fillet, self.sided)
        rows = profile.walk([(float(x), float(y)) for x, y in near])
        section: dict[str, Any] = {"type": "profile", "points": [_rounded(v) for v in rows]}
        if self.fillet is not None:
            section["fillet"] = self.fillet
        if profile.closed:
            section["closed"] = True
        along = [round(float(c), 12) + 0.0 for c in axis]
        return {"type": "extruded" if self.kind == "CYLINDER" else "revolved", "section": section, "axis": along}

    def triangles(self, nodes: dict[int, tuple[float, float, float]], reference: Array, bodies: Array) -> str:
        """Text of an STL file of the sides of rigid elements about the reference node, with the bodies outside.

        Raises
        ------
        FileError
            If they bound no tool.

        """
        rows = [t for face in self.faces for t in _split(ends(face, True))]
        used = sorted({n for row in rows for n in row})
        number = {n: k for k, n in enumerate(used)}
        points = np.array([nodes[n] for n in used]) - reference
        try:
            s = stl.joined(self.name, points, np.array([[number[n] for n in row] for row in rows], dtype=np.int64))
        except ValueError as error:
            raise FileError.at(self.line, str(error)) from None
        if (s.volume if s.closed else _outside(s, bodies - reference)) < 0.0:
            s = s.reversed()
        return stl.text(s, self.name)


def analytical(k: Keyword, name: str, scope: Scope) -> SpatialTool:
    """The surface of *SURFACE, TYPE=CYLINDER or REVOLUTION: in a part its axes are those of the part, moved with the instance.

    A cylinder is extruded along c − a, the negative of its third axis, a revolution turns about b − a, in a part about y
    (Abaqus keywords reference, *SURFACE).

    Raises
    ------
    FileError
        If its axes or its profile are none.

    """
    kind = k.parameters["TYPE"].upper()
    first = next((i for i, (_, row) in enumerate(k.data) if row[0].upper() == "START"), 0)
    given = [k.number(row, i) for _, row in list(k.data)[:first] for i, word in enumerate(row) if word]
    a, b, c = np.zeros(3), np.eye(3)[0 if kind == "CYLINDER" else 1], -np.eye(3)[2]
    if given:
        if len(given) != (9 if kind == "CYLINDER" else 6):
            what = "a, b on its x axis, c along which it is extruded" if kind == "CYLINDER" else "a and b on its axis"
            raise FileError.at(k.line, f"a surface {kind} is given by points, {what}, before START; or by none of them in a part")
        a, b = np.array(given[:3]), np.array(given[3:6])
        c = np.array(given[6:]) if kind == "CYLINDER" else c
    else:
        b, c = a + b, a + c
    origin, one, other = (np.array(scope.moved_in_space(*map(float, x))) for x in (a, b, c))
    way = one - origin
    if not np.linalg.norm(way):
        raise FileError.at(k.line, f"the points a and b of the surface {name!r} are one: they give no axis")
    way = way / np.linalg.norm(way)
    frame = np.stack([way, way, way])
    if kind == "CYLINDER":
        along = other - origin
        if not np.linalg.norm(along) or abs(along @ way) > DRAWN * np.linalg.norm(along):
            raise FileError.at(k.line, f"the surface {name!r} is extruded along c − a, which has to be across its x axis, b − a")
        along = along / np.linalg.norm(along)
        frame = np.stack([way, np.cross(-along, way), along])
    walk = list(segments(replace(k, lines=list(k.lines)[first:])))
    if len(walk) < 2:
        raise FileError.at(k.line, f"the rigid surface {name!r} has no segment: write START, then LINE or CIRCL")
    fillet = k.number([k.parameters.get("FILLET RADIUS", "")], 0, 0.0)
    return SpatialTool("", k.line, walk, fillet, True, kind=kind, origin=origin, frame=frame)


def _coordinates(walk: Iterable[Any]) -> list[tuple[float, float]]:
    return [x for v in walk for x in (v.values() if isinstance(v, dict) else [v])]


def _rounded(v: Any) -> Any:
    if isinstance(v, dict):
        return {key: _rounded(x) for key, x in v.items()}
    return [round(v[0], 12) + 0.0, round(v[1], 12) + 0.0]


def _split(face: Side) -> list[Side]:
    """A face as triangles."""
    return [face] if len(face) == 3 else [face[:3], (face[0], face[2], face[3])]


def _outside(s: stl.Surface, bodies: Array) -> float:
    """Whether bodies, by the middles (k, 3) of their elements, lie where the normals look: near ones count more; in −1 … 1."""
    if not len(bodies):
        return 1.0
    corners = s.points[s.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    middle = corners.mean(axis=1)
    total = sides = 0.0
    for x in bodies:
        far = np.linalg.norm(middle - x, axis=1)
        nearest = int(far.argmin())
        weight = 1.0 / max(float(far[nearest]), DRAWN * float(np.ptp(middle, axis=0).max())) ** 2
        total += weight
        sides += weight * float(np.sign((x - middle[nearest]) @ normal[nearest]))
    return sides / total
