"""Every key of a case has words, a unit, a default and an example that is read; every number may be written with a unit."""

from __future__ import annotations

import dataclasses
import importlib.util
import math
from pathlib import Path
from typing import Any, get_args, get_origin

import pytest
from pydantic import TypeAdapter

from prensa.model import problem as vocabulary
from prensa.model.places import bare, chosen, hints, is_names, members
from prensa.model.problem import Case
from prensa.model.python_alone import in_files
from prensa.model.schema import _plain as plain
from prensa.model.text import Node
from prensa.model.units import RATIO, Dimension

DOCS = Path(__file__).parents[2] / "docs"
MESH = Path(vocabulary.__file__).parents[1] / "verify" / "meshes" / "block.msh"


def made() -> Any:
    spec = importlib.util.spec_from_file_location("make_reference", DOCS / "make_reference.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


REFERENCE = made()
CLASSES = [cls for classes in REFERENCE.SECTIONS.values() for cls in classes]


def given(cls: type, folder: Path) -> list[dict[str, Any]]:
    """The examples of a class, their files in place."""

    def placed(value: Any) -> Any:
        if isinstance(value, dict):
            return {k: placed(v) for k, v in value.items()}
        if isinstance(value, list):
            return [placed(v) for v in value]
        files = {"RUN": str(folder), "MESH": str(MESH), "SURFACE": str(MESH.with_name("tetrahedron.stl"))}
        return files.get(value, value) if isinstance(value, str) else value

    (folder / "checkpoint.h5").touch()
    (folder / "punch.dxf").touch()
    return [placed(REFERENCE._plain(one)) for one in REFERENCE.examples()[cls.__name__]]


def read(cls: type, value: dict[str, Any], folder: Path) -> Any:
    context = {"units": {"length": "mm", "force": "N", "thickness": 1.0}, "folder": folder}
    adapter = TypeAdapter(vocabulary.FixedValue if cls.__name__ == "Fixed" else cls)
    return adapter.validate_python(value, context=context)


def test_every_class_and_key_is_on_the_page():
    """All that a case may hold is described, in words and with an example, and only what it may hold."""
    assert REFERENCE.undocumented() == []
    names = {cls.__name__ for cls in CLASSES}
    assert set(REFERENCE.examples()) == names
    todo, seen = [Case], set()
    while todo:
        cls = todo.pop()
        if cls not in seen:
            seen.add(cls)
            todo += [c for hint in hints(cls).values() for c in classes_in(hint) if getattr(c, "offered", True)]
    assert {c.__name__ for c in seen} - names <= {"Case"}
    for cls in CLASSES:
        keys = {*in_files(cls)} - {"type"}
        assert keys == {key for one in REFERENCE.examples()[cls.__name__] for key in one}, cls


def classes_in(annotation: Any) -> list[type]:
    kind, _ = bare(annotation)
    own = [kind] if dataclasses.is_dataclass(kind) else []
    return own + [c for a in get_args(kind) if not isinstance(a, str) and a is not ... for c in classes_in(a)]


@pytest.mark.parametrize("cls", CLASSES, ids=lambda c: c.__name__)
def test_examples_are_read(cls, tmp_path):
    """What the page shows for a key is what the program takes."""
    for one in given(cls, tmp_path):
        assert read(cls, one, tmp_path) is not None


# ---------------------------------------------------------------------------------------------------------------- units
OTHER = {"force": ("kN", 1e3), "length": ("cm", 10.0), "time": ("ms", 1e-3)}


def quantity(number: float, of: Dimension, per_second: bool) -> str:
    """A number in mm, N and s as a text in kN, cm and ms."""
    if (of.force, of.length, of.time) == (0, 0, 0):
        text = f"{math.degrees(number):.17g} deg" if of.name == "an angle" else f"{100 * number:.17g} %"
    else:
        unit = [f"{OTHER[k][0]}^{getattr(of, k)}" for k in OTHER if getattr(of, k)]
        text = f"{number / math.prod(OTHER[k][1] ** getattr(of, k) for k in OTHER):.17g} {'*'.join(unit)}"
    return f"{text}/s" if per_second else text


def dimension_of(annotation: Any) -> Dimension | None:
    """Of a number that may stand somewhere; what is a share is a `RATIO`."""
    for option in (annotation, *members(annotation)):
        kind, meta = bare(option)
        if kind is float:
            return next((m for m in meta if isinstance(m, Dimension)), RATIO)
    return None


class Written:
    """A description as plain data with its numbers as texts; ``dimensions`` of those that were found."""

    def __init__(self) -> None:
        self.dimensions: list[Dimension] = []

    def texts(self, annotation: Any, value: Any, per_second: bool = False) -> Any:
        if isinstance(value, dict):
            if is_names(annotation):
                inner = get_args(bare(annotation)[0])[1]
                return {k: self.texts(inner, v, per_second) for k, v in value.items()}
            tag = {"type": Node(value["type"], None)} if "type" in value else {}
            known: dict[str, Any] = {}
            for cls in reversed(chosen(annotation, Node(tag, None))):
                if set(value) <= set(hints(cls)):
                    known = hints(cls)
            return {k: self.texts(known[k], v, per_second or k == "velocity") if k in known else v for k, v in value.items()}
        if isinstance(value, list):
            kinds = [bare(o)[0] for o in members(annotation)]
            nested = bool(value) and isinstance(value[0], list)
            for kind in kinds:
                args = get_args(kind)
                if get_origin(kind) is tuple and (args[-1] is ... or len(args) == len(value)):
                    inner = [args[0]] * len(value) if args[-1] is ... else args
                    if nested and not any(get_origin(bare(o)[0]) is tuple for o in members(inner[0])):
                        continue
                    return [self.texts(a, v, per_second) for a, v in zip(inner, value)]
            return value
        of = dimension_of(annotation) if isinstance(value, int | float) and not isinstance(value, bool) else None
        if of is None:
            return value
        self.dimensions.append(of)
        return quantity(value, of, per_second)


def same(a: Any, b: Any) -> bool:
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    if isinstance(a, list):
        return isinstance(b, list) and len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, float):
        return isinstance(b, float | int) and math.isclose(a, b, rel_tol=1e-13)
    return a == b


def dimensions_in(annotation: Any) -> set[Dimension]:
    """Of all numbers of a key, not of those in classes behind it."""
    kind, meta = bare(annotation)
    if dataclasses.is_dataclass(kind):
        return set()
    own = {m for m in meta if isinstance(m, Dimension)}
    return own.union(*(dimensions_in(a) for a in get_args(kind) if not isinstance(a, str) and a is not ...))


@pytest.mark.parametrize("cls", [c for c in CLASSES if c.__name__ not in ("Drawing", "Problem")], ids=lambda c: c.__name__)
def test_every_number_may_be_written_with_a_unit(cls, tmp_path):
    """Lengths, forces, moments, stresses, strains, angles, speeds, rates, times and shares in other units mean the same."""
    met: dict[str, set[Dimension]] = {}
    for one in given(cls, tmp_path):
        described = plain(read(cls, one, tmp_path))
        described = described if isinstance(described, dict) else one  # 'x' is short for a support
        written = {}
        for key, value in described.items():
            pen = Written()
            written[key] = pen.texts(hints(cls)[key], value, key == "velocity") if key in hints(cls) else value
            met.setdefault(key, set()).update(pen.dimensions)
        again = plain(read(cls, written, tmp_path))
        assert same(again if isinstance(again, dict) else written, described) or again == plain(read(cls, one, tmp_path)), written
    for key, hint in hints(cls).items():
        assert dimensions_in(hint) <= met.get(key, set()), (cls.__name__, key)


# ------------------------------------------------------------------------------------------------------------- promises
def test_a_ring_test_with_its_chart_is_short():
    """At most 12 lines of Python with the plot, or 20 of YAML and a command; the blocks are executed with their page."""
    page = (DOCS / "guide" / "ring-test.md").read_text(encoding="utf-8")

    def lines(language: str) -> list[str]:
        block = page.split(f"```{language}\n")[1].split("```")[0]
        return [line for line in block.splitlines() if line.strip()]

    assert len(lines("python")) <= 12 and "plot" in "".join(lines("python"))
    assert len(lines("yaml")) <= 20 and "--measure bore" in "".join(lines("console"))
