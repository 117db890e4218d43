"""Resolution of paths through the types of the vocabulary and through the nodes of a file at the same time.

Error messages need both, the type for what is expected (`fields`, `expected`) and the node for line and column.
"""

from __future__ import annotations

import types
import typing
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, is_dataclass
from functools import lru_cache
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Tag
from pydantic.fields import FieldInfo

from prensa.errors import Mark
from prensa.model import problem as vocabulary
from prensa.model.python_alone import in_files
from prensa.model.text import Node
from prensa.model.units import Dimension

SECTIONS = ("numerics", "output")
SEVERAL: dict[str, str | int] = {"bodies": "", "tools": "", "contacts": 0, "steps": 0}
"""Things of which a case has several, with a key of one."""
_ONE = {
    "bodies": "body",
    "damage": "damage law",
    "tools": "tool",
    "contacts": "contact",
    "ties": "tie",
    "steps": "step",
    "loads": "load",
    "fixed": "support",
}


@lru_cache
def hints(cls: type) -> dict[str, Any]:
    """Annotations of a class of the vocabulary, by field."""
    return typing.get_type_hints(cls, include_extras=True)


def bare(annotation: Any) -> tuple[Any, tuple[Any, ...]]:
    """The type without ``Annotated`` and ``| None``, and the metadata that was around it."""
    meta: tuple[Any, ...] = ()
    while True:
        if typing.get_origin(annotation) is Annotated:
            meta += annotation.__metadata__
            annotation = annotation.__origin__
        elif _is_union(annotation):
            rest = [a for a in typing.get_args(annotation) if a is not type(None)]
            # A true union stays; one with None alone beside a type is that type, and the loop goes on into it.
            if len(rest) == len(typing.get_args(annotation)):
                return annotation, meta
            annotation = typing.Union[tuple(rest)]  # noqa: UP007 (built at run time)
        else:
            return annotation, meta


def _is_union(annotation: Any) -> bool:
    return typing.get_origin(annotation) in (typing.Union, types.UnionType)


def members(annotation: Any) -> list[Any]:
    """The alternatives of a type (itself where there is one only)."""
    kind, _ = bare(annotation)
    return list(typing.get_args(kind)) if _is_union(kind) else [annotation]


def tags(annotation: Any) -> dict[str, Any]:
    """The alternatives by the tag that pydantic puts into error locations; empty where it puts none."""
    kind, meta = bare(annotation)
    if not _is_union(kind):
        return {}
    if not any(isinstance(m, Discriminator) or (isinstance(m, FieldInfo) and m.discriminator) for m in meta):
        return {}
    return {_tag(m): m for m in members(annotation)}


def offered(annotation: Any) -> list[str]:
    """Those of the `tags` that a file may give."""
    return [tag for tag, member in tags(annotation).items() if getattr(bare(member)[0], "offered", True)]


def _tag(member: Any) -> str:
    kind, meta = bare(member)
    return next((m.tag for m in meta if isinstance(m, Tag)), None) or str(type_name(kind))


def type_name(cls: Any) -> str | None:
    """The ``type`` by which a file names a class."""
    hint = hints(cls).get("type") if isinstance(cls, type) and is_dataclass(cls) else None
    return str(typing.get_args(hint)[0]) if hint is not None else None


def chosen(annotation: Any, node: Node | None) -> list[type]:
    """Classes that may stand at a place, narrowed by the ``type`` that the file gives."""
    classes = [k for k in (bare(m)[0] for m in members(annotation)) if is_dataclass(k) and isinstance(k, type)]
    if len(classes) > 1 and node is not None and isinstance(node.value, dict) and "type" in node.value:
        given = node.value["type"].value
        # An unknown 'type' leaves all of them: keys are then looked for in every one.
        classes = [c for c in classes if type_name(c) == given] or classes
    return classes


def fields_of(annotation: Any, node: Node | None = None) -> list[str]:
    """Keys that a mapping at this place may have (none where the keys are names)."""
    names = [name for c in chosen(annotation, node) for name in in_files(c)]
    return list(dict.fromkeys(names))


def below(annotation: Any, key: str | int, node: Node | None) -> Any:
    """Type behind *key*; None where the vocabulary has none."""
    for cls in chosen(annotation, node):
        if key in (known := hints(cls)):
            return known[str(key)]
    kind, _ = bare(annotation)
    for option in members(annotation):
        inner, _ = bare(option)
        args = typing.get_args(inner)
        if typing.get_origin(inner) is tuple and isinstance(key, int):
            return args[0] if args[-1] is Ellipsis else args[key] if key < len(args) else None
    return typing.get_args(kind)[1] if is_names(annotation) else None


def is_names(annotation: Any) -> bool:
    """Whether the keys of the mapping at this place are names, not fields."""
    return typing.get_origin(bare(annotation)[0]) is Mapping


@dataclass(frozen=True)
class Place:
    """The end of a path: ``kind`` of value expected, ``node`` found (None: missing), ``parent``, name of the owner."""

    path: tuple[str | int, ...]
    kind: Any
    node: Node | None
    parent: Place | None
    owner: str

    @property
    def label(self) -> str:
        """The place in words: ``radius of tool 'cylinder' (circle)``; a name by the key above it: ``'punch' in energy``."""
        if self.parent is None or not self.path:
            return self.owner or "the case"
        if chosen(self.kind, self.node) and self.owner:
            return self.owner
        index = ""
        at = self
        while isinstance(at.path[-1], int) and at.parent is not None:
            index, at = f"[{at.path[-1]}]{index}", at.parent
        owner = at.parent.owner if at.parent else ""
        if not owner and at.parent is not None and at.parent.path and is_names(at.parent.kind):
            return f"{str(at.path[-1])!r}{index} in {at.parent.path[-1]}"
        return f"{at.path[-1]}{index}" + (f" of {owner}" if owner else "")

    def mark(self, at_key: bool = False) -> Mark:
        """Where to look: the value, the key when the value is a block or is empty, else the nearest place around."""
        if self.parent is not None and self.parent.node is not None:
            key = self.parent.node.keys.get(str(self.path[-1]))
            # A block begins on the line below its key, where nothing says what it is.
            if key is not None and (at_key or self.node is None or self.node.spread):
                return key
        if self.node is not None and not at_key:
            return self.node.mark
        return self.parent.mark() if self.parent is not None else self.node.mark if self.node else Mark("<case>")


def child(place: Place, key: str | int) -> Place:
    """One step down a path."""
    node = None
    if key == 0 and place.node is not None and isinstance(place.node.value, dict):  # one that is written for a list of one
        kind = below(place.kind, key, place.node)
        owner = _owner(place.parent, place.path[-1], kind, place.node) if place.parent is not None else ""
        return Place((*place.path, key), kind, place.node, place, owner)
    if place.node is not None:
        value = place.node.value
        if isinstance(value, dict):
            node = value.get(str(key))
        elif isinstance(value, list) and isinstance(key, int) and key < len(value):
            node = value[key]
    kind = below(place.kind, key, place.node)
    return Place((*place.path, key), kind, node, place, _owner(place, key, kind, node))


def _owner(place: Place, key: str | int, kind: Any, node: Node | None) -> str:
    """Name of the thing at a key: "tool 'cylinder' (circle)", "flow of body 'block' (voce)"; '' for sections."""
    if kind is None or not chosen(kind, node):
        return place.owner if isinstance(key, int) or not is_names(kind) else ""
    section = str(place.path[-1]) if place.path else ""
    name: Any = repr(key)
    if isinstance(key, int):
        label = node.value.get("name") if node is not None and isinstance(node.value, dict) else None
        name = repr(label.value) if label is not None and isinstance(label.value, str) else key
    if is_names(place.kind) or isinstance(key, int):
        if section in ("move", "by", "velocity", "crank", "feed", "push", "control", "body_force"):
            noun = f"{section} of {name}"
        else:
            noun = f"{_ONE.get(section, section)} {name}"
    else:
        noun = str(key)
        if place.owner:
            noun += f" of {place.owner.partition(' (')[0]}"
    kinds = chosen(kind, node)
    tag = type_name(kinds[0]) if len(kinds) == 1 and len(members(kind)) > 1 else None
    return f"{noun} ({tag})" if tag else noun


def having(key: str) -> list[str]:
    """What of a case may have a key: 'a tool', 'a step'."""
    kinds = ((f"a {_ONE[section]}", below(below(Root, section, None), one, None)) for section, one in SEVERAL.items())
    return [words for words, kind in kinds if kind is not None and key in fields_of(kind)]


def root(node: Node) -> Place:
    """The whole file: the fields of `Problem` with ``numerics`` and ``output`` beside them."""
    return Place((), Root, node, None, "")


def in_space(place: Place) -> bool:
    """Whether the file says `space: solid`."""
    while place.parent is not None:
        place = place.parent
    top = place.node.value if place.node is not None else None
    space = top.get("space") if isinstance(top, dict) else None
    return space is not None and space.value == "solid"


def follow(start: Place, path: Iterable[str | int], tagged: bool = False) -> Place:
    """The place at the end of *path*; ``tagged`` paths are pydantic's, with the tags of unions in between."""
    place = start
    for key in path:
        options = tags(place.kind) if tagged and place.kind is not None else {}
        if key in options:
            # What is no list is tagged as one of the plane.
            member = options["solid" if "solid" in options and in_space(place) else str(key)]
            place = Place(place.path, member, place.node, place.parent, place.owner)
        else:
            place = child(place, key)
    return place


@vocabulary.described
class Root(vocabulary.Problem):
    """The top level of a file."""

    numerics: vocabulary.Numerics = vocabulary.Numerics()
    output: vocabulary.Output = vocabulary.Output()


# ---------------------------------------------------------------------------------------------------- what is expected
_PLURAL = {"length": "lengths", "stress": "stresses", "number": "numbers", "whole number": "whole numbers"}


def expected(annotation: Any) -> str:
    """The kind of value that belongs at a place, in words: ``a length``, ``a list of 2 lengths``, …"""
    kind, meta = bare(annotation)
    for m in meta:
        if isinstance(m, Dimension):
            return m.name
        if isinstance(m, FieldInfo) and m.description:
            return m.description
    if _is_union(kind):
        return _expected_of_union(annotation)
    if is_dataclass(kind):
        return f"a mapping with {_listed(fields_of(annotation))}"
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if origin is Literal:
        return _listed([repr(a) for a in args], "or")
    if origin is Mapping:
        return "a mapping of names"
    if origin is tuple:
        if args[-1] is Ellipsis:
            return "a list"
        words = [expected(a).removeprefix("a ") for a in args]
        if len(set(words)) == 1 and words[0] in _PLURAL:
            return f"a list of {len(args)} {_PLURAL[words[0]]}"
        return "a list [" + ", ".join(w.partition(" or ")[0] for w in words) + "]"
    return {int: "a whole number", float: "a number", str: "text", bool: "true or false"}.get(kind, "another value")


def _expected_of_union(annotation: Any) -> str:
    named = tags(annotation)
    if "number" in named and "table" in named:
        one = expected(named["number"])
        if "linear" in named:
            return "a number, a mapping of a hardening law or the name of a CSV file"
        held = "'held', " if "held" in named else ""
        return f"{held}{one} or a table [[time, value], …]"
    if "arc" in named:
        return "a point [x, y] or an arc with through and to"
    if "each" in named:
        return "a length or a list with one for each point"
    if "grade" in named:
        return "the name of an edge or a corner, or a mapping with x, y and ratio"
    if "solid" in named:
        return expected(named["plane"])
    return f"a mapping with 'type' ({_listed(offered(annotation), 'or')})"


def _listed(words: list[str], last: str = "and") -> str:
    shown = [w for w in words if w != "type"]
    return " ".join([", ".join(shown[:-1]), last, shown[-1]]) if len(shown) > 1 else "".join(shown)
