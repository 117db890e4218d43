"""YAML ⇄ `Case`: the same vocabulary as in Python, every mistake with file, line, column and remedy.

A file holds the fields of `Problem` at its top level and, optionally, the sections ``numerics`` and ``output``.
"""

from __future__ import annotations

import dataclasses
import difflib
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from pydantic import TypeAdapter, ValidationError
from pydantic.json_schema import GenerateJsonSchema

from prensa.errors import ArgumentError, CaseError, Mark, Mistake, shown, take
from prensa.model import constructors  # noqa: F401  (says what is wrong with the arguments of descriptions)
from prensa.model import text as yaml
from prensa.model.checks import find
from prensa.model.messages import findings_of, mistakes
from prensa.model.overrides import override
from prensa.model.places import SECTIONS, bare, hints, is_names, root
from prensa.model.plausibility import warnings_of
from prensa.model.problem import SPATIAL_AXES, Case, Fixed, Problem, Units
from prensa.model.python_alone import of_python_alone
from prensa.model.units import Length

__all__ = ["CaseError", "brief", "dump", "in_short", "load", "loads", "warnings_of"]

CASE_LIMIT = 4 << 20
CUT = "…"
_HALVES = re.compile("[\ud800-\udfff]")
_TESTS = re.compile(r"[\"']?\btests\b")


def load(path: str | Path, overrides: Iterable[str] = ()) -> Case:
    """Read the case of a YAML file.

    Parameters
    ----------
    path
        The file, UTF-8; friction tables named in it are relative to its folder.
    overrides
        Changes ``path=value`` made before validation, such as ``steps.0.increments=40`` or
        ``bodies.block.mesh.n=[20, 30]``.

    Returns
    -------
    Case
        Numbers in the case's own units; strings such as ``8 cm`` are converted.

    Raises
    ------
    CaseError
        With all the mistakes of the file, one a line: ``file.yaml:12:5: message; remedy``.

    """
    take("load", "path", path, (str, os.PathLike), "give the path of a case file")
    path = Path(path)
    return loads(_read(path), str(path), path.parent, overrides)


def loads(
    text: str, name: str = "<text>", folder: str | Path | None = None, overrides: Iterable[str] = (), bounded: bool = True
) -> Case:  # fmt: skip
    """Read the case of a YAML text; *name* stands in messages, friction tables are relative to *folder*.

    ``bounded`` False reads texts of any size: those that `dump` wrote.

    Raises
    ------
    CaseError
        As `load`.

    """
    take("loads", "text", text, str, "give the text of a case file")
    overrides = _changes(overrides)
    for given, place in ((text, name), *((item, f"--set {item!a}") for item in overrides)):
        if not given.isascii() and _HALVES.search(given):
            raise CaseError([Mistake(Mark(place), "the text has halves of characters (surrogates), which no file can hold")])
    tree, known = yaml.read(text, name, bounded=bounded)
    if tree.value is None:
        raise CaseError([*known, Mistake(Mark(name), "the file is empty; a case needs 'name', 'bodies' and 'steps'")])
    if not isinstance(tree.value, dict):
        message = f"the file is {tree.shown()}; a case is a mapping with 'name', 'bodies' and 'steps'"
        raise CaseError([*known, Mistake(tree.mark, message)])
    start = root(tree)
    for item in overrides:
        known = known + override(start, item)
    # A section left empty (all of it commented out) is a section not given.
    data = {key: value for key, value in tree.plain().items() if value is not None}
    sections = {k: data.pop(k) for k in SECTIONS if k in data}
    # The system of units comes first: every other number is converted to it while it is read.
    context = {"units": _units(data), "folder": folder}
    try:
        case = _adapter(Case).validate_python({"problem": data, **sections}, context=context)
    except ValidationError as error:
        errors = error.errors(include_url=False)
        # of a problem that could be made what is wrong with it is known, defaults included; of others what can be read is asked
        findings = next((f for e in errors if (f := findings_of(e))), ()) or tuple(find(_sketch(data, context)))
        raise CaseError(mistakes(errors, findings, start, known)) from None
    if known:
        raise CaseError(sorted(known))
    # what `dump` wrote of a problem that a script described is read again
    if bounded and (alone := tuple(of_python_alone(case.problem))):
        raise CaseError(mistakes([], alone, start, []))
    object.__setattr__(case.problem, "stated", frozenset(data))
    return case


def _changes(overrides: Iterable[str]) -> list[str]:
    """Changes as a list; a text alone is one of them."""
    if isinstance(overrides, str):
        return [overrides]
    remedy = "give a list of texts 'path=value'"
    take("load", "overrides", overrides, Iterable, remedy)
    try:
        changes = list(overrides)
    except TypeError:  # an array of no dimension calls itself iterable
        raise ArgumentError(f"load: overrides is {shown(overrides)}; {remedy}") from None
    for change in changes:
        take("load", "an override", change, str, "write it as 'path=value'")
    return changes


def _read(path: Path) -> str:
    def wrong(message: str) -> CaseError:
        return CaseError([Mistake(Mark(str(path)), message)])

    try:
        if path.is_dir():
            raise wrong("this is a folder; name the case file in it")
        with path.open("rb") as file:
            return text_of(file.read, str(path))
    except FileNotFoundError:
        raise wrong(f"there is no such file{_neighbour(path)}") from None
    except (OSError, ValueError) as error:
        if isinstance(error, CaseError):
            raise
        raise wrong(f"cannot be read: {error}") from None


def text_of(read: Callable[[int], bytes], name: str) -> str:
    """Text of a case file from what reads so many of its bytes; *name* stands in messages.

    Raises
    ------
    CaseError
        If it is too large for a case, or not UTF-8.

    """
    # One byte more than allowed shows that there is more, without reading a file of gigabytes.
    raw = read(CASE_LIMIT + 1)
    if len(raw) > CASE_LIMIT:
        message = "larger than 4 MiB; a case file is short, is this the right file? If so, put its mesh into a .msh or .inp file"
        raise CaseError([Mistake(Mark(name), message)])
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        message = f"not UTF-8 text (line {line}); is this a case file? Save it as UTF-8"
        raise CaseError([Mistake(Mark(name), message)]) from None


def has_tests(path: str | Path) -> bool:
    """Whether a file describes a calibration rather than a case: it has tests and no bodies. What cannot be read has none."""
    try:
        text = _read(Path(path))
        # A look at the text saves a parse of every case.
        if _TESTS.search(text) is None:
            return False
        tree, _ = yaml.read(text, str(path))
    except CaseError:
        return False
    return isinstance(tree.value, dict) and "tests" in tree.value and "bodies" not in tree.value


class _Marked(GenerateJsonSchema):
    """Marks the classes that are described in Python alone."""

    def dataclass_schema(self, schema: Any) -> dict[str, Any]:
        """The schema of a class, with ``offered`` false where a file may not name it."""
        made = super().dataclass_schema(schema)
        # what another key of the same mapping gives may be left out
        if filled := getattr(schema["cls"], "filled", ()):
            made["required"] = [key for key in made.get("required", ()) if key not in filled]
        return made if getattr(schema["cls"], "offered", True) else {**made, "offered": False}


def _without(node: Any, left_out: set[str]) -> Any:
    """A schema without the references *left_out*."""
    if isinstance(node, dict):
        return {key: _without(below, left_out) for key, below in node.items()}
    if isinstance(node, list):
        return [_without(below, left_out) for below in node if not (isinstance(below, dict) and below.get("$ref") in left_out)]
    return node


def json_schema() -> dict[str, Any]:
    """JSON schema of a case file for editors: it knows every key and type, and accepts all that is read.

    It accepts more than that: which names exist and what goes together is for `load` to say.
    """
    made = _adapter(Problem).json_schema(schema_generator=_Marked, mode="validation")
    alone = [name for name, about in made["$defs"].items() if about.get("offered") is False]
    made["$defs"] = {name: about for name, about in made["$defs"].items() if name not in alone}
    made = _without(made, {f"#/$defs/{name}" for name in alone})
    for name in SECTIONS:
        section = _adapter(hints(Case)[name]).json_schema(mode="validation")
        made.setdefault("$defs", {}).update(section.pop("$defs", {}))
        made["properties"][name] = section
    _with_texts(made)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **made}


def _with_texts(node: Any) -> None:
    """Allow what is read beside the types themselves: units, names for lists and objects, tables, one for several."""
    if isinstance(node, dict):
        if "oneOf" in node:  # laws of one's own have any keys
            node["anyOf"] = node.pop("oneOf")
            node.pop("discriminator", None)
        if node.get("type") in ("number", "integer"):
            node["type"] = [node["type"], "string"]
        for below in node.values():
            _with_texts(below)
        for key, value in node.get("properties", {}).items():
            if isinstance(value, dict) and "const" not in value and "enum" not in value:
                lists = any(option.get("type") == "array" for option in (value, *value.get("anyOf", ())))
                also = ["string"] if lists else ["string", "array"]
                node["properties"][key] = {"anyOf": [value, {"type": also}], **_words_of(value)}
        extra = node.get("additionalProperties")
        if isinstance(extra, dict):
            node["additionalProperties"] = {"anyOf": [extra, {"type": ["string", "null"]}]}
    elif isinstance(node, list):
        for below in node:
            _with_texts(below)


def _words_of(node: dict[str, Any]) -> dict[str, Any]:
    return {key: node[key] for key in ("description", "title", "default") if key in node}


def located(messages: str, path: str | Path, overrides: Iterable[str] = ()) -> str:
    """Put the place in the file before each line that starts with a path, as ``tools.punch.radius: …`` does.

    Lines that name no place in it stay as they are, all of them where the file or an override cannot be read.
    """
    try:
        return located_in(messages, _read(Path(path)), str(path), overrides)
    except CaseError:  # what cannot be read is in the messages already
        return messages


def located_in(messages: str, text: str, name: str, overrides: Iterable[str] = ()) -> str:
    """As `located`, in the *text* of a case that is called *name*."""
    try:
        tree, _ = yaml.read(text, name)
        start = root(tree)
        for item in overrides:
            override(start, item)
    except CaseError:
        return messages
    lines = []
    for line in messages.splitlines():
        dotted, colon, _ = line.partition(": ")
        mark = _dotted(tree, dotted) if colon and " " not in dotted else None
        lines.append(f"{mark}: {line}" if mark is not None else line)
    return "\n".join(lines)


def _dotted(node: yaml.Node, dotted: str) -> Mark | None:
    """Place of a path whose keys, which may have dots themselves, are joined by dots: its key, or the value in a list."""
    mark = None
    while dotted:
        options = node.value if isinstance(node.value, dict) else {}
        if isinstance(node.value, list):
            options = {str(i): n for i, n in enumerate(node.value)}
        found = [k for k in options if dotted == k or dotted.startswith(f"{k}.")]
        if not found:
            break
        key = max(found, key=len)
        mark = node.keys.get(key, options[key].mark)
        node, dotted = options[key], dotted[len(key) + 1 :]
    return mark


def _neighbour(path: Path) -> str:
    """A file beside a missing one that may have been meant."""
    try:
        names = {p.stem: p.name for p in path.parent.iterdir() if p.suffix in (".yaml", ".yml")}
    except OSError:
        return f" (there is no folder {str(path.parent)!r})"
    near = difflib.get_close_matches(path.stem, names, n=1)
    return f"; did you mean {str(path.with_name(names[near[0]]))!r}?" if near else ""


@lru_cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def _units(data: dict[str, Any]) -> dict[str, Any]:
    """The system to convert to and the thickness of plane problems; mm and N where those are wrong, to check the rest."""
    try:
        units = _adapter(Units).validate_python(data.get("units", {}))
    except ValidationError:
        units = Units()
    known: dict[str, Any] = {"length": units.length, "force": units.force}
    if data.get("space") != "axisymmetric":
        try:
            known["thickness"] = _adapter(Length).validate_python(data.get("thickness", 1.0), context={"units": known})
        except ValidationError:
            known["thickness"] = 1.0
    return known


# ----------------------------------------------------------------------------------- what can be said of a broken case
class _Any(Mapping[str, Any]):
    """Names of a section that could not be read: all are there, so that nothing is called unknown."""

    def __contains__(self, key: object) -> bool:
        return True

    def __getitem__(self, key: str) -> Any:
        raise KeyError(key)

    def __iter__(self) -> Iterator[str]:
        return iter(())

    def __len__(self) -> int:
        return 1


def _sketch(data: dict[str, Any], context: Any) -> Any:
    """The problem as far as it can be read, entry by entry, with None for what cannot: enough to check its names."""
    sketch: Any = SimpleNamespace(**{name: _part(kind, data, name, context) for name, kind in hints(Problem).items()})
    named = isinstance(sketch.tools, dict) and isinstance(sketch.bodies, dict) and None not in sketch.no_contact
    if not sketch.contacts and named:
        sketch.contacts = Problem.every_contact(sketch)
        sketch.contacts_filled_in = bool(sketch.contacts)
    return sketch


def _part(kind: Any, data: dict[str, Any], name: str, context: Any) -> Any:
    names, items = is_names(kind), bare(kind)[0]
    value = data.get(name)
    if names:
        if not isinstance(value, dict):
            return _Any() if name in data or name == "bodies" else {}
        return {k: _valid(items.__args__[1], v, context) for k, v in value.items()}
    if name in ("steps", "contacts", "no_contact", "ties"):
        if not isinstance(value, list):
            return (None,) if name in data or name == "steps" else ()
        return tuple(_valid(items.__args__[0], v, context) for v in value)
    if name not in data:
        return next((_default(f) for f in dataclasses.fields(Problem) if f.name == name), None)
    return _valid(kind, value, context)


def _default(f: dataclasses.Field[Any]) -> Any:
    """What a field is where it is not given; None where it has to be."""
    if f.default_factory is not dataclasses.MISSING:
        return f.default_factory()
    return None if f.default is dataclasses.MISSING else f.default


def _valid(kind: Any, value: Any, context: Any) -> Any:
    try:
        return _adapter(kind).validate_python(value, context=context)
    except ValidationError:
        return None


# ------------------------------------------------------------------------------------------------------------- writing
def dump(case: Problem | Case) -> str:
    """YAML of a problem or a case, defaults left out: ``loads(dump(problem)).problem == problem``."""
    take("dump", "case", case, (Problem, Case), "give a Problem or a Case")
    if isinstance(case, Problem):
        return yaml.write(_plain(case))
    sections = {"numerics": _plain(case.numerics), "output": _plain(case.output)}
    return yaml.write(_plain(case.problem) | {k: v for k, v in sections.items() if v})


def _plain(value: Any) -> Any:
    """Dicts, lists and scalars of a description, with the short forms of the vocabulary."""
    if isinstance(value, Fixed):
        return _short(value)
    if dataclasses.is_dataclass(value):
        # 'type' first: it says what the other keys mean.
        fields = sorted(dataclasses.fields(value), key=lambda f: f.name != "type")
        by_class = hasattr(value, "type") and all(f.name != "type" for f in fields)  # a user's own law
        users = {"type": getattr(value, "type", "")} if by_class else {}
        return users | {f.name: _entry(f.name, getattr(value, f.name)) for f in fields if _needed(value, f)}
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return value


def _needed(value: Any, field: dataclasses.Field[Any]) -> bool:
    given = getattr(value, field.name)
    if field.default_factory is not dataclasses.MISSING:
        return bool(given != field.default_factory())
    if isinstance(value, Problem) and field.name == "space" and "space" in value.stated:
        return True  # checks ask whether it was stated, of resumed runs and of points of studies too
    return field.name == "type" or field.default is dataclasses.MISSING or bool(given != field.default)


def _entry(name: str, value: Any) -> Any:
    return value[0] if name == "surface" and len(value) == 1 else _plain(value)


def _short(support: Fixed) -> Any:
    """'x', 'y', 'xy', …, 'normal' or 'free' where that says it all."""
    given = {c: getattr(support, c) for c in (*SPATIAL_AXES, "normal") if getattr(support, c) is not None}
    if support.free and not given:
        return "free"
    together = "normal" not in given or len(given) == 1
    if given and together and not support.free and all(v == "held" for v in given.values()):
        return "".join(given)
    return {c: _plain(v) for c, v in given.items()} | ({"free": True} if support.free else {})


def plain(value: Any) -> Any:
    """A part of a description as dicts, lists and scalars, as it may be written in a file."""
    return _plain(value)


def brief(value: Any) -> str:
    """A part of a description as it may be written in a file, in one line."""
    return yaml.line(_plain(value))


def in_short(value: Any) -> str:
    """`brief` for reading: of lists of more than four the first two and the last one."""
    return yaml.line(_shortened(_plain(value))).replace(f'"{CUT}"', CUT)


def _shortened(data: Any) -> Any:
    """Plain data without the middle of long lists."""
    if isinstance(data, dict):
        return {key: _shortened(v) for key, v in data.items()}
    if isinstance(data, list | tuple):
        short = [*data[:2], CUT, *data[-1:]]
        return [_shortened(v) for v in (data if len(data) <= len(short) else short)]
    return data
