"""Errors of pydantic and of the cross-references, as mistakes with a place and a remedy in the project's words."""

from __future__ import annotations

import difflib
import re
import sys
import typing
from collections.abc import Iterable
from typing import Any

from prensa.errors import Mistake, shown
from prensa.model.checks import FindingsError
from prensa.model.names import Finding, elsewhere, meant, of_a_slip, of_the_trade, suggest, suggest_key
from prensa.model.places import Place, Root, bare, expected, fields_of, follow, having, in_space, is_names, offered
from prensa.model.units import ANGLE
from prensa.registry import DOORS

MOST = 200  # errors that are explained: a table in the wrong place has thousands
_BOUNDS = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}
_ELEMENT_SIZES = ("h", "lc", "esize", "element_size", "mesh_size", "seed", "elements")
_KINDS = {
    "mesh": "mesh", "material": "material", "flow": "flow", "enforcement": "enforcement", "friction": "friction",
    "damage": "damage law",
}  # fmt: skip


def mistakes(errors: Iterable[Any], findings: Iterable[Finding], root: Place, known: list[Mistake]) -> list[Mistake]:
    """All the mistakes of a file in its order; *known* ones come from reading and hide what follows of them."""
    errors = [e for e in errors if not findings_of(e)][:MOST]
    places = [follow(root, _path(e["loc"]), tagged=True) for e in errors]
    said = {m.mark for m in known}
    found = set(known)
    for error, place in zip(errors, places):
        if not _follows(error, place, errors, places):
            mistake = explain(error, place)
            if mistake.mark not in said:
                found.add(mistake)
    found |= {_of_finding(f, root) for f in findings}
    return sorted(found)


def findings_of(error: Any) -> tuple[Finding, ...]:
    """What an error of pydantic's list says of a description as a whole, if it does."""
    cause = error.get("ctx", {}).get("error")
    return cause.findings if isinstance(cause, FindingsError) else ()


def _path(loc: tuple[str | int, ...]) -> tuple[str | int, ...]:
    return loc[1:] if loc and loc[0] == "problem" else loc


def _of_finding(finding: Finding, root: Place) -> Mistake:
    return Mistake(follow(root, finding.path).mark(finding.at_key), finding.message)


def _follows(error: Any, place: Place, errors: list[Any], places: list[Place]) -> bool:
    """Whether a mistake is only the consequence of another: a key missing for a typo, a list short of bad items."""
    if error["type"] == "too_short":
        return any(len(p.path) > len(place.path) and p.path[: len(place.path)] == place.path for p in places)
    if error["type"] == "unexpected_keyword_argument" and place.parent is not None:
        # the second length of 'size: 15 mm, 40 mm' has become a key
        lists = [p for p in places if p.parent is not None and p.parent.path == place.parent.path and _scalar_for_list(p)]
        if str(place.path[-1])[:1].isdigit() and lists:
            return True
    if error["type"] == "missing" and isinstance(place.path[-1], str):
        typos = [
            str(p.path[-1])
            for e, p in zip(errors, places)
            if e["type"] == "unexpected_keyword_argument" and p.path[:-1] == place.path[:-1]
        ]
        near = difflib.get_close_matches(place.path[-1], typos, n=1) or place.path[-1] in map(of_the_trade, typos)
        fields = fields_of(place.parent.kind, place.parent.node) if place.parent is not None else []
        named = any(repr(place.path[-1]) in _of_another_shape(t, fields) for t in typos)
        return bool(near) or named or place.path[-1] in [t.partition(":")[0] for t in typos]
    return False


def explain(error: Any, place: Place) -> Mistake:
    """One mistake of pydantic's list (``type``, ``loc``, ``input``, ``ctx``) at its place in the file."""
    kind, ctx = error["type"], error.get("ctx", {})
    key = place.path[-1] if place.path else ""
    above = place.parent or place
    if kind == "unexpected_keyword_argument":
        where = f" in {above.owner}" if above.owner else ""
        given = above.node.value if above.node is not None and isinstance(above.node.value, dict) else {}
        fields = fields_of(above.kind, above.node)
        options = [f for f in fields if f not in given]
        remedy = suggest_key(str(key), options)
        if not options and of_a_slip(str(key), fields) is None:
            remedy = f"; it takes {' and '.join(map(repr, fields))} alone"
        if above.parent is not None and meant(str(key), options) is None and key in fields_of(Root):
            remedy = f"; {key!r} is a key of the case, at its outermost level"
        if above.parent is None and (things := having(str(key))):
            remedy = f"; {key!r} is a key of {' or of '.join(things)}"
        if "type" not in given and of_a_slip(str(key), fields) is None:
            meant_here = remedy if meant(str(key), options) is not None else ""
            remedy = f"{others}{meant_here}" if (others := _of_another_type(str(key), above)) else remedy
        remedy = _of_another_shape(str(key), fields) or remedy
        if instead := elsewhere(str(key)):
            remedy = f"; {instead}"
        if key in ("z", "r") and "y" in fields_of(above.kind, above.node) and not in_space(place):
            remedy += " In axisymmetry x is the radius and y the axis"
        return Mistake(place.mark(at_key=True), f"unknown key {key!r}{where}{remedy}")
    if kind == "missing":
        return _missing(place, above)
    if kind == "union_tag_not_found" and place.node is not None and not isinstance(place.node.value, dict):
        return Mistake(place.mark(), _wrong(error, place))
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        return _type(place, ctx.get("tag"))
    if kind == "literal_error":
        return _choice(error, place, above)
    if kind in _BOUNDS:
        name, words = _BOUNDS[kind]
        written = _shown(error, place)
        in_degrees = words.startswith(("at most", "less")) and ANGLE in bare(place.kind)[1] and "deg" not in written
        remedy = f"; for degrees write '{written} deg'" if in_degrees else ""
        return Mistake(place.mark(), f"{place.label} is {written}; it must be {words} {ctx[name]:g}{remedy}")
    if kind in ("too_short", "too_long"):
        return Mistake(place.mark(), _length(place, ctx))
    if kind == "value_error":
        return Mistake(place.mark(), f"{place.label}: {ctx['error']}")
    if kind == "metal":  # names what is unknown itself
        return Mistake(place.mark(), f"{above.owner or 'the material'}: {ctx['words']}")
    return Mistake(place.mark(), _wrong(error, place))


def _of_another_shape(key: str, fields: list[str]) -> str:
    """What to write for a key whose number stands elsewhere: in the flow curve, in 'size', in 'radius'; '' of others."""
    if of_the_trade(key) == "s0" and "flow" in fields:
        return "; the yield stress is one of 'flow', such as {type: perfect, s0: 250 MPa}"
    if key.casefold() in _ELEMENT_SIZES and {"size", "n"} <= set(fields):
        return "; give 'n', the numbers of elements along the sides"
    if key == "diameter" and "radius" in fields:
        return "; give 'radius', half of it"
    if key == "turn" and (direction := next((f for f in ("axis", "normal") if f in fields), "")):
        return f"; its {direction!r} says how it stands, and a step turns it: by 'rz', in space 'rx' and 'ry' too"
    if key == "size" and {"radius", "height"} <= set(fields):
        return "; give 'radius' and 'height'"
    if key in ("diameter", "radius", "height", "width", "length") and "size" in fields:
        return "; lengths are given as 'size', one for each axis (in axisymmetry radius and height)"
    return ""


def _of_another_type(key: str, above: Place) -> str:
    """What to write for a key of other laws of its kind than the default one; '' of a key that none has."""
    mine = bare(above.kind)[0]
    for door in DOORS.values():
        if mine in door.own().values():
            types = [repr(f"type: {name}") for name, cls in door.own().items() if key in fields_of(cls)]
            return f"; {key!r} needs {' or '.join(types)} beside it" if types else ""
    return ""


def _scalar_for_list(place: Place) -> bool:
    """Whether one value stands where a list of a known number of them belongs."""
    args = typing.get_args(bare(place.kind)[0])
    is_list = typing.get_origin(bare(place.kind)[0]) is tuple and args[-1] is not Ellipsis
    return is_list and place.node is not None and not isinstance(place.node.value, list | dict)


def _as_list(place: Place) -> str:
    """How to write as a list what stands there as one value: '15x40', '15 40', 20, or 15 mm, 40 mm without brackets."""
    count, text = len(typing.get_args(bare(place.kind)[0])), str(place.node.value).strip("( ") if place.node else ""
    given = place.parent.node.value if place.parent is not None and place.parent.node is not None else {}
    rest = [str(k).strip(") ") for k in given if str(k)[:1].isdigit()] if isinstance(given, dict) else []
    values = [text, *rest]
    if len(values) == 1 and text[:1].isdigit():
        values = re.findall(r"\d[\d.]*(?: ?[a-z]+\b)?", re.sub(r"(?<=\d) ?[x×;] ?(?=\d)", " ", text))
        values = values * count if len(values) == 1 else values
    return f"; write [{', '.join(values)}]" if len(values) == count and text[:1].isdigit() else ""


def _missing(place: Place, above: Place) -> Mistake:
    key = place.path[-1]
    if isinstance(key, int):
        entries = len(above.node.value) if above.node is not None and isinstance(above.node.value, list) else 0
        return Mistake(above.mark(), f"{above.label} has {_values(entries)}; {expected(above.kind)} is expected")
    return Mistake(above.mark(), f"{above.owner or 'the case'} needs {key!r}, {expected(place.kind)}")


def _type(place: Place, tag: Any) -> Mistake:
    known = offered(place.kind)
    if tag is None:
        return Mistake(place.mark(), f"{place.label} needs a 'type'; known: {', '.join(map(repr, known))}")
    written = place.node.value.get("type") if place.node is not None and isinstance(place.node.value, dict) else None
    mark = written.mark if written is not None else place.mark()
    return Mistake(mark, f"unknown {_noun(place)} {tag!r}{suggest(str(tag), known)}")


def _noun(place: Place) -> str:
    """What a thing with a ``type`` is called: tool, material, flow, …"""
    key = str(next(k for k in reversed(place.path) if isinstance(k, str)))
    if key in _KINDS:
        return _KINDS[key]
    if place.parent is not None and is_names(place.parent.kind):
        section = str(place.parent.path[-1])
        return {"tools": "tool", "friction": "friction"}.get(section, section)
    return key


def _choice(error: Any, place: Place, above: Place) -> Mistake:
    value, key = error["input"], place.path[-1]
    # pydantic gives the choices as one sentence.
    words = error["ctx"]["expected"].replace(" or ", ", ").replace("'", "").split(", ")
    options = [w.lower() if w in ("True", "False") else w for w in words if w]
    if not isinstance(value, str):
        return Mistake(place.mark(), _wrong(error, place))
    noun = _noun(above) if key == "type" and above.path else str(key)
    if isinstance(key, int):  # an entry of a list
        last = value.rpartition(".")[2]
        remedy = f"; write {last!r}" if last in options else suggest(value, options)
        return Mistake(place.mark(), f"{place.label} is {value!r}{remedy}")
    if key == "of":
        noun = f"'of' of {above.owner}"
    if 1 < len(options) <= 3:
        return Mistake(place.mark(), f"unknown {noun} {value!r}; write {' or '.join(map(repr, options))}")
    return Mistake(place.mark(), f"unknown {noun} {value!r}{suggest(value, options)}")


def _length(place: Place, ctx: Any) -> str:
    actual = ctx.get("actual_length")
    if "min_length" in ctx and place.path[-1] == "surface":
        return f"{place.label} is empty; name at least one boundary, 'body.boundary'"
    if "min_length" in ctx:
        return f"{place.label} has {_values(actual)}; at least {ctx['min_length']} are needed"
    slip = "; numbers have a decimal point, and a comma parts two entries" if _has_numbers(place) else ""
    return f"{place.label} has {_values(actual)}; {expected(place.kind)} is expected{slip}"


def _has_numbers(place: Place) -> bool:
    """Whether a list holds numbers, or begins of entries such as the 5 mm of 15,5 mm."""
    entries = place.node.value if place.node is not None and isinstance(place.node.value, list) else []
    return any(str(e.value)[:1].isdigit() for e in entries)


def _values(count: int) -> str:
    return "1 value" if count == 1 else f"{count} values"


def _shown(error: Any, place: Place) -> str:
    if place.node is not None:
        return place.node.shown()
    return shown(error["input"])


def _wrong(error: Any, place: Place) -> str:
    wanted = "a finite number" if error["type"] == "finite_number" else expected(place.kind)
    remedy = ""
    # A name such as 1018 is a number in YAML.
    if error["type"] == "string_type" and isinstance(error["input"], int | float):
        remedy = "; put it in quotes"
    if wanted == "a list" and isinstance(error["input"], dict):
        remedy = "; begin each entry with '- '"
    if "table" in offered(place.kind) and _written(error["input"]).lower().endswith((".csv", ".txt")):
        remedy = f"; a curve from a file is {{type: table, points: {error['input']}}}"
    remedy = _by_example(error["input"], place, wanted) or remedy
    return f"{place.label} is {_shown(error, place)}; {wanted} is expected{remedy}"


def _written(value: object) -> str:
    """Text or a number as it stands in a file; '' of all else, which may have no words or too many."""
    if isinstance(value, str):
        return value
    return str(value) if isinstance(value, int | float) and abs(value) < sys.maxsize else ""


def _by_example(value: Any, place: Place, wanted: str) -> str:
    """How to write what was written too shortly: '; such as {y: -20 mm}'; '' where that is not known."""
    key, text = place.path[-1] if place.path else "", _written(value)
    number = text.lstrip("+-")[:1].isdigit()
    if not text:
        return ""
    if _scalar_for_list(place):
        return _as_list(place)
    if key == "increments" and value == "auto":
        return "; leave it out, and their number is found on the way"
    if key == "fixed" and isinstance(value, str) and "." in value:
        return f"; such as {{{value}: x}}"
    if key == "force" and number and wanted == "a mapping of names":
        return f"; name the tool and the axis, such as {{punch: {{y: {value}}}}}"
    if key == "until" and number:
        return f"; such as {{force: {{punch: {{y: {value}}}}}}}"
    if number and {"x", "y"} <= set(fields_of(place.kind, place.node)):
        return f"; name the axis, such as {{y: {value}}}"
    if "j2" in offered(place.kind) and isinstance(value, str):
        return f"; a metal of the library is {{type: j2, of: {value}}}, and 'prensa materials' lists them"
    if {"perfect", "table"} <= set(offered(place.kind)) and number:
        return f"; a constant flow stress is {{type: perfect, s0: {value}}}"
    return ""
