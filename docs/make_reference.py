"""Write ``guide/reference.md``: every key of a case file, from the classes that define it.

Run it after any change of ``prensa.model.problem``; a test says when the page is behind.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import typing
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from prensa.model import problem as model
from prensa.model import text
from prensa.model.doors import NameOf
from prensa.model.places import bare, hints, is_names, members, type_name
from prensa.model.python_alone import in_files
from prensa.model.units import RATIO, Dimension
from prensa.registry import public

PAGE = Path(__file__).parent / "guide" / "reference.md"

SECTIONS: dict[str, tuple[type, ...]] = {
    "The problem": (model.Problem, model.Units, model.Start, model.Remesh, model.Sizes, model.When, model.Step, model.Until,
                    model.ToolForce, model.ToolTravel),
    "Bodies and meshes": (
        model.Body, model.Rectangle, model.Grade, model.Strip, model.Wire, model.Nose,
        model.Disc, model.Annulus, model.Patch, model.ArcSide, model.SplineSide,
        model.Outline, model.Points, model.File, model.Box, model.Cylinder, model.Extrusion, model.Revolution, model.Bricks,
        model.Tetrahedra,
        model.Tie,
    ),
    "Materials": tuple(dict(public("material")).values()),
    "Flow curves": tuple(dict(public("flow")).values()),
    "Damage laws": tuple(dict(public("damage")).values()),
    "Wear laws": tuple(dict(public("wear")).values()),
    "Tools": (*(cls for _, cls in public("tool") if getattr(cls, "offered", True)), model.Springs, model.Press),
    "Contacts": (model.Contact, model.NoContact, model.Interference, *dict(public("enforcement")).values()),
    "Friction": tuple(dict(public("friction")).values()),
    "Supports, motions and loads": (model.Fixed, model.Motion, model.Crank, model.Feed, model.Push, model.Load),
    "How it is solved, and what is written": (model.Numerics, model.Output),
}  # fmt: skip

# What the types do not tell.
VALUES = {
    **{(c, "surface"): "body, boundary `body.name` or list of them" for c in ("Contact", "NoContact")},
    **{(c, "against"): "name of a tool" for c in ("Contact", "NoContact")},
    ("Press", "capacity"): "number > 0, list of [stroke, force], or the name of a CSV file of them",
    ("Until", "press"): "name of a tool, or a list of them",
    ("Coulomb", "mu"): "{}, or the name of a CSV file of κ, μ",
    **{(t, "of"): "name of a metal or of a file, or {}" for t in ("J2", "Hill")},
    ("FlowTable", "points"): "{}, or the name of a CSV file of ε̄, σ_y",
    ("Profile", "points"): "{}, or the name of a DXF or CSV file, or [Drawing](#drawing)",
    **{(t, "fillet"): "number ≥ 0, or a list with one for each point" for t in ("Profile", "Polygon")},
    **{(t, "axis"): "`x`, `y`, `z` or {}" for t in ("Extruded", "Revolved", "Swept")},
    ("Stl", "unit"): "{}, or a unit alone, such as `inch`",
    ("Step", "friction"): "names of contacts: a friction law or `null`",
    **{(t, "section"): "[Rectangle](#rectangle) or another mesh of the plane" for t in ("Extrusion", "Revolution")},
    **{(t, "section"): "[Circle](#circle) or another tool of the plane" for t in ("Extruded", "Revolved", "Swept")},
    ("Swept", "plan"): "[Polygon](#polygon), [Circle](#circle), [Ellipse](#ellipse) or a closed [Profile](#profile)",
    **{(t, k): "boundary `body.name`" for t in dict(public("tool")) for k in ("touching", "above", "below")},
}
UNITS = {
    ("Step", "velocity"): "per second",
    ("Push", "m"): "force × length",
}
EXAMPLES = Path(__file__).parent / "reference_examples.yaml"
DEFAULTS = {
    **{(t, "radius"): "automatic" for t in ("Pyramid", "Polyhedron")},
    ("Step", "increments"): "automatic", ("Profile", "fillet"): "automatic", ("Polygon", "fillet"): "automatic",
    **{("Hill", k): "of `r`, or of von Mises" for k in "FGHN"}, ("Hill", "rolling"): "`angle`", ("Hill", "normal"): "z",
    ("Load", "follower"): "`true`, or as before",
}  # fmt: skip

OPENING = """\
# Reference of the case file

Every key, as the program checks it. This page is written by `docs/make_reference.py` from the classes that
describe a case; [Writing a case](cases.md) explains how they go together.

A file holds the keys of [Problem](#problem) at its top level and, if wanted, the sections `numerics` and `output`. A class
is the `type` of a mapping, a field is its key. *Unit* is the dimension of a number: a plain number is in the case's own
units, a string such as `8 cm` is converted. *Default* is what holds when the key is left out; "required" keys cannot be. A
*value over time* is a number, reached by a ramp over the step, or a table `[[time, value], …]` in global time. *Example*: what
may stand behind the key.

A plain dimensionless number may be written as a share too, `12 %`.

The keys `at`, `touching`, `above` and `below` place a tool, and all of these mean the same for all tools:

| key | meaning |
|---|---|
| `at` | initial place of the reference point; without another key of this table it is the place itself |
| `touching` | a boundary: the tool is moved along the boundary's mean normal until it just touches the boundary |
| `above`, `below` | a boundary: the same, coming down along −y or up along +y |
| `spring` | [Springs](#springs) on which it is mounted |
| `press` | [Press](#press) that drives it; a number alone, such as `400 kN`, is its capacity |

With `touching`, `above` or `below`, `at` says only where the tool is across that direction (default: the origin).
A curved or kinked boundary is touched against the first travel or push of the tool, if that leads towards it, not along its mean
normal.
"""


def page() -> str:
    """The whole page as text."""
    return OPENING + "".join(_sections())


def _sections() -> Iterator[str]:
    for title, classes in SECTIONS.items():
        yield f"\n## {title}\n"
        for cls in classes:
            yield "\n".join(["", *_described(cls), ""])


def _described(cls: type) -> Iterator[str]:
    """Lines of one class: heading, how it is named in a file, docstring, table of its fields."""
    kind = type_name(cls)
    yield f"### {cls.__name__}"
    yield ""
    if kind is not None:
        yield f"`type: {kind}`"
        yield ""
    doc = inspect.getdoc(cls) or ""
    yield doc.replace("``", "`")
    yield ""
    yield "| key | value | unit | default | example |"
    yield "|---|---|---|---|---|"
    known = in_files(cls)
    for f in dataclasses.fields(cls):
        if f.name != "type" and f.name in known:
            annotation, at = hints(cls)[f.name], (cls.__name__, f.name)
            what = VALUES.get(at, "{}").format(value(annotation))
            cells = (
                f"`{f.name}`", what, UNITS.get(at, unit(annotation)), DEFAULTS.get(at, default(f)), f"`{example(cls, f.name)}`",
            )  # fmt: skip
            yield "| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |"


# ------------------------------------------------------------------------------------------------------------ examples
@lru_cache
def examples() -> dict[str, list[dict[str, Any]]]:
    """By class, mappings that can be read as they stand; every key is in one of them, or the page is not made."""
    from ruamel.yaml import YAML

    found: dict[str, list[dict[str, Any]]] = YAML(typ="safe", pure=True).load(EXAMPLES)
    return found


def example(cls: type, key: str) -> str:
    """What may stand behind a key, as it is written in a file."""
    for given in examples().get(cls.__name__, ()):
        if key in given:
            shown = re.sub(r'"([-\w.][-\w .^/*%]*)"', r"\1", text.line(_plain(given[key])))  # quantities need no quotes
            return shown.replace("RUN", "results/press").replace("MESH", "block.msh").replace("SURFACE", "punch.stl")
    raise KeyError(f"{EXAMPLES.name} has no example of '{cls.__name__}.{key}'")


def undocumented() -> list[str]:
    """Keys that neither the docstring of their class nor the table of shared keys names."""
    shared = set(re.findall(r"`(\w+)`", "".join(row for row in OPENING.splitlines(True) if row.startswith("| `"))))
    return [
        f"{cls.__name__}.{name}"
        for classes in SECTIONS.values()
        for cls in classes
        for name in in_files(cls)
        if name not in {"type", *shared} and not re.search(rf"(?<!\w){name}(?!\w)", inspect.getdoc(cls) or "")
    ]


def _plain(value: Any) -> Any:
    """Numbers of YAML 1.1 as the reader of cases has them: ``1e-5`` is one."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_plain(v) for v in value]
    try:
        return text.resolve(value) if isinstance(value, str) else value
    except ValueError:
        return value


# -------------------------------------------------------------------------------------------------------------- values
def value(annotation: Any) -> str:
    """What may stand behind a key, in words."""
    kind, meta = bare(annotation)
    if names := [m for m in meta if isinstance(m, NameOf)]:
        return ", ".join([*(f"`{name}`" for name in names[0].names), "`module:Class`"])
    if _is_over_time(annotation):
        held = any(_literals(m) == ["held"] for m in members(annotation))
        return "value over time" + (" or `held`" if held else "")
    if dataclasses.is_dataclass(kind):
        short = "`x`, `y`, `xy`, `free` or " if kind is model.Fixed else ""
        return f"{short}[{kind.__name__}](#{kind.__name__.lower()})"
    if len(options := [m for m in members(annotation) if getattr(bare(m)[0], "offered", True)]) > 1:
        return " or ".join(dict.fromkeys(value(o) for o in options))
    if kind is Any:
        return "`module:Class`"
    if literals := _literals(kind):
        return ", ".join(f"`{str(v).lower() if isinstance(v, bool) else v}`" for v in literals)
    if is_names(annotation):
        return f"names: {value(typing.get_args(kind)[1])}"
    if typing.get_origin(kind) is tuple:
        return _tuple(typing.get_args(kind))
    if typing.get_origin(kind) is Mapping:
        raise TypeError(f"a mapping that is not of names: {kind!r}")
    plain = {float: "number", int: "whole number", bool: "`true`, `false`", str: "text"}[kind]
    return plain + _bounds(meta)


def _tuple(items: tuple[Any, ...]) -> str:
    if items[-1] is Ellipsis:
        return f"list of {value(items[0])}"
    one = {value(i) for i in items}
    return f"{len(items)} × {one.pop()}" if len(one) == 1 else f"[{', '.join(map(value, items))}]"


def _is_over_time(annotation: Any) -> bool:
    """Whether it is a number or a table of pairs (time, number)."""
    kinds = [bare(m)[0] for m in members(annotation)]
    return float in kinds and any(typing.get_origin(k) is tuple for k in kinds)


def _literals(annotation: Any) -> list[Any]:
    kind, _ = bare(annotation)
    return list(typing.get_args(kind)) if typing.get_origin(kind) is Literal else []


def _bounds(meta: tuple[Any, ...]) -> str:
    """Limits of a number, such as `` > 0``."""
    signs = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
    found = [
        f"{sign} {getattr(limit, name):g}"
        for m in meta
        for limit in getattr(m, "metadata", ())
        for name, sign in signs.items()
        if hasattr(limit, name)
    ]
    return " " + ", ".join(found) if found else ""


# --------------------------------------------------------------------------------------------------- units and defaults
def unit(annotation: Any) -> str:
    """Dimensions of the numbers behind a key, without article."""
    return ", ".join(dict.fromkeys(d.name.split(" ", 1)[1] for d in _dimensions(annotation)))


def _dimensions(annotation: Any) -> Iterator[Dimension]:
    kind, meta = bare(annotation)
    yield from (m for m in meta if isinstance(m, Dimension) and m != RATIO)
    if dataclasses.is_dataclass(kind):
        return
    inner = members(annotation) if len(members(annotation)) > 1 else [a for a in typing.get_args(kind) if a is not ...]
    for option in inner:
        if not isinstance(option, str):
            yield from _dimensions(option)


def default(f: dataclasses.Field[Any]) -> str:
    """What holds without the key."""
    if f.default_factory is not dataclasses.MISSING:
        made = f.default_factory()
        if isinstance(made, model.Units):
            return f"`{made.length}`, `{made.force}`"
        return f"`{made.type}`" if hasattr(made, "type") else "none"
    if f.default is dataclasses.MISSING:
        return "required"
    if f.default is None or f.default == ():
        return "none"
    given = f.default
    if isinstance(given, bool):
        return f"`{str(given).lower()}`"
    if isinstance(given, tuple):
        return f"`[{', '.join(f'{v:g}' for v in given)}]`"
    return f"`{given:g}`" if isinstance(given, float) else f"`{given}`"


if __name__ == "__main__":
    if missing := undocumented():
        raise SystemExit(f"not documented: {', '.join(missing)}")
    PAGE.write_text(page(), encoding="utf-8")
    print(f"{PAGE.name} written")
