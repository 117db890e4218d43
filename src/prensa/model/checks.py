"""Cross-references of a description: every name that is used exists, and every combination written makes sense."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from prensa.model.problem import Problem


def suggest(name: str, known: Iterable[str]) -> str:
    """'; did you mean …?' for the nearest known name, or the list of the known ones."""
    known = list(known)
    close = difflib.get_close_matches(name, known, n=1)
    if close:
        return f"; did you mean {close[0]!r}?"
    return f"; known: {', '.join(map(repr, known))}" if known else "; none is defined"


def _unknown(what: str, name: str, known: Iterable[str], where: str) -> ValueError:
    return ValueError(f"{where}: unknown {what} {name!r}{suggest(name, known)}")


def check_names(p: Problem) -> None:
    """Raise ValueError for an unknown body, tool or contact name, or a motion that the space does not have."""
    bodies, tools = list(p.bodies), list(p.tools)
    if not bodies:
        raise ValueError("bodies: at least one body is needed")
    if not p.steps:
        raise ValueError("steps: at least one step is needed")

    def boundary(name: str, where: str) -> None:
        body, dot, edge = name.partition(".")
        if not dot or not edge:
            raise ValueError(f"{where}: {name!r} is not of the form 'body.boundary'")
        if body not in bodies:
            raise _unknown("body", body, bodies, where)

    for key, tool in p.tools.items():
        where = f"tools.{key}"
        placed = [w for w in ("touching", "above", "below") if getattr(tool, w) is not None]
        if len(placed) > 1:
            raise ValueError(f"{where}: give only one of {', '.join(placed)}")
        if not placed and tool.at is None:
            raise ValueError(f"{where}: the tool has no place; give 'at', 'touching', 'above' or 'below'")
        for w in placed:
            boundary(getattr(tool, w), f"{where}.{w}")
        if tool.type == "ring" and p.space != "axisymmetric":
            raise ValueError(f"{where}: a ring stamp needs 'space: axisymmetric' (use stamps in plane problems)")
        direction = getattr(tool, "facing", getattr(tool, "normal", None))
        if direction is not None and direction[0] == 0 and direction[1] == 0:
            raise ValueError(f"{where}: the direction (0, 0) has no length")
        if p.space == "axisymmetric":
            if direction is not None and tool.type == "stamp" and direction[0] != 0:
                raise ValueError(f"{where}.facing: in axisymmetry a stamp faces along the axis, (0, 1) or (0, -1)")
            if tool.type in ("circle", "stamp", "ring") and tool.at is not None and tool.at[0] != 0 and tool.type != "circle":
                raise ValueError(f"{where}.at: in axisymmetry a {tool.type} is centred on the axis, x = 0")
    names = [c.name for c in p.contacts]
    if len(set(names)) < len(names):
        raise ValueError("contacts: the same surface and tool appear twice")
    for i, c in enumerate(p.contacts):
        for s in c.surface:
            boundary(s, f"contacts.{i}.surface")
        if len({s.partition(".")[0] for s in c.surface}) > 1:
            raise ValueError(f"contacts.{i}.surface: one contact surface belongs to one body; write two contacts")
        if c.against not in tools:
            raise _unknown("tool", c.against, tools, f"contacts.{i}.against")
    for key in p.fixed:
        boundary(key, "fixed")
    for key in p.loads:
        boundary(key, "loads")
    for key in p.body_force:
        if key not in bodies:
            raise _unknown("body", key, bodies, "body_force")
    seen = set()
    for i, s in enumerate(p.steps):
        where = f"steps.{i}"
        if s.name in seen:
            raise ValueError(f"{where}.name: two steps are called {s.name!r}")
        seen.add(s.name)
        for kind in ("move", "velocity", "push"):
            for key, m in getattr(s, kind).items():
                if key not in tools:
                    raise _unknown("tool", key, tools, f"{where}.{kind}")
                turn = "m" if kind == "push" else "rz"
                if p.space == "axisymmetric" and (m.x is not None or getattr(m, turn) is not None):
                    raise ValueError(f"{where}.{kind}.{key}: in axisymmetry a tool moves along y only")
        for key in tools:
            for c in ("x", "y", "rz"):
                given = [
                    k for k in ("move", "velocity", "push")
                    if key in getattr(s, k) and getattr(getattr(s, k)[key], "m" if k == "push" and c == "rz" else c) is not None
                ]
                if len(given) > 1:
                    raise ValueError(f"{where}: {c} of tool {key!r} is given by {' and '.join(given)}; keep one")
        for key in s.fixed:
            boundary(key, f"{where}.fixed")
        for key in s.loads:
            boundary(key, f"{where}.loads")
        for key in s.body_force:
            if key not in bodies:
                raise _unknown("body", key, bodies, f"{where}.body_force")
        for key in s.friction:
            if key not in names:
                raise _unknown("contact", key, names, f"{where}.friction")
    for key, b in p.bodies.items():
        if b.material.type == "neo_hooke" and p.kinematics == "small":
            raise ValueError(f"bodies.{key}.material: neo_hooke is a finite-strain law; use 'elastic' or 'kinematics: finite'")
    if p.kinematics == "finite" and p.contact_geometry == "reference":
        raise ValueError("contact_geometry: 'reference' is the linear Signorini problem and needs 'kinematics: small'")
