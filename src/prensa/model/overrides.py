"""Changes of a case from outside its file, ``tools.cylinder.radius=20``, made on the tree before it is validated."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from typing import get_args, get_origin

from prensa.errors import CaseError, Mark, Mistake
from prensa.model.names import suggest, suggest_key
from prensa.model.places import Place, bare, below, child, fields_of, is_names
from prensa.model.text import Node, read

# Names under these keys are defined there: an override changes what exists, a new name is a typing error. Names under
# the others refer to something and are checked with the rest of the case.
_DEFINING = ("bodies", "tools", "boundaries")
_DOTTED = ("fixed", "loads", "friction")
OPTION = "--set "


def override(root: Place, text: str) -> list[Mistake]:
    """Set one value of the tree; *text* is ``path=value``, the value in YAML, the path in dots, indices from 0 or names.

    Returns the mistakes inside the value (NaN, duplicate keys).

    Raises
    ------
    CaseError
        If the path leads nowhere or the value cannot be read.

    """
    path, equals, value = text.partition("=")
    mark = Mark(f"{OPTION}{text}")
    if not equals or not path.strip():
        raise CaseError([Mistake(mark, f"write it as path=value, {_example(path)}")])
    node, mistakes = read(value, mark.source, marked=False)
    # Mistakes in the value then point at the command line, where it was written, and not at a line of the file.
    _paint(node, mark)
    _set(root, path.strip().split("."), node, mark)
    return mistakes


def _example(text: str) -> str:
    """The change that was meant by a path and a value with a blank between them, or one of another path."""
    path, _, value = text.strip().partition(" ")
    return f"{path}={value.strip()}" if value else "for example tools.punch.radius=20"


def _paint(node: Node, mark: Mark) -> None:
    """Keys inside the value are in the command line too."""
    node.mark = mark
    node.keys = dict.fromkeys(node.keys, mark)
    for part in node.children():
        _paint(part, mark)


def _set(place: Place, parts: list[str], new: Node, mark: Mark) -> None:
    """Walk down, through mappings that are made when the vocabulary has them, and put the value at the end."""
    here = place.node
    assert here is not None
    if isinstance(here.value, list):
        index, rest = _index(place, parts, mark)
        if not rest:
            here.value[index] = new
        else:
            _set(child(place, index), rest, new, mark)
        return
    if here.value is None:  # an empty section, 'numerics:' with everything below commented out
        here.value = {}
    if not isinstance(here.value, dict):
        name = ".".join(map(str, place.path))
        message = (
            f"{name!r} is {here.shown()} in the file and has no {parts[0]!r}; give its whole value, --set {name}=…"
        )
        raise CaseError([Mistake(mark, message)])
    key, rest = _key(place, parts, mark)
    if not rest:
        here.value[key], here.keys[key] = new, mark
        return
    if key not in here.value or here.value[key].value in (None, []):
        here.value[key], here.keys[key] = _begun(place, key, mark), mark
    _set(child(place, key), rest, new, mark)


def _begun(place: Place, key: str, mark: Mark) -> Node:
    """What stands at a key that the file does not have, before something in it is set: what counts without it."""
    top = place
    while top.parent is not None:
        top = top.parent
    assert top.node is not None
    case: dict[str, Node] = top.node.value
    if not place.path and key == "contacts":
        return Node([*_every_contact(case, mark)], mark)
    if place.path[:1] == ("contacts",) and key == "friction" and key in case and isinstance(case[key].value, dict):
        return deepcopy(case[key])
    kind, _ = bare(below(place.kind, key, place.node))
    listed = get_origin(kind) is tuple and get_args(kind)[-1] is Ellipsis
    return Node([] if listed else {}, mark)


def _every_contact(case: dict[str, Node], mark: Mark) -> Iterator[Node]:
    """The contacts of a file that has none: every tool against every body, without the pairs of ``no_contact``."""

    def names(key: str) -> list[str]:
        value = case[key].value if key in case else None
        return list(value) if isinstance(value, dict) else []

    listed = case["no_contact"].value if "no_contact" in case else None
    entries = [e.value for e in listed] if isinstance(listed, list) else []
    none = set()
    for entry in (e for e in entries if isinstance(e, dict) and {"surface", "against"} <= set(e)):
        of = entry["surface"].value
        sides = [n.value for n in of] if isinstance(of, list) else [of]
        none |= {(str(side), str(entry["against"].value)) for side in sides}
    for tool in names("tools"):
        for body in names("bodies"):
            if (body, tool) not in none:
                parts = {k: Node(v, mark, text=v) for k, v in (("surface", body), ("against", tool))}
                yield Node(parts, mark, keys=dict.fromkeys(parts, mark))


def _index(place: Place, parts: list[str], mark: Mark) -> tuple[int, list[str]]:
    """Number of the entry that the path names here, by number or by its own name (which may have dots), and the rest."""
    assert place.node is not None
    part, count, name = parts[0], len(place.node.value), ".".join(map(str, place.path))
    if part == str(count) and place.node.mark.source.startswith(OPTION):  # a list that is not in the file grows entry by entry
        place.node.value.append(Node({}, place.node.mark))
        return count, parts[1:]
    own = [str(item.value["name"].value) if _is_named(item) else None for item in place.node.value]
    for length in range(len(parts), 0, -1):
        if own.count(called := ".".join(parts[:length])) == 1:
            return own.index(called), parts[length:]
    if any(own) and not part.isdecimal():
        near = suggest(part, [n for n in own if n])
        raise CaseError([Mistake(mark, f"no entry {part!r} in {name!r}{near}, or a number from 0 to {count - 1}")])
    if not part.isdecimal() or int(part) >= count:
        known = f"numbers 0 to {count - 1}" if count > 1 else "only number 0" if count else "none"
        raise CaseError([Mistake(mark, f"no entry {part!r} in {name!r}; the file has {known}")])
    return int(part), parts[1:]


def _is_named(item: Node) -> bool:
    return isinstance(item.value, dict) and "name" in item.value


def _key(place: Place, parts: list[str], mark: Mark) -> tuple[str, list[str]]:
    """The key that the path names here (names such as ``block.bottom`` have dots of their own) and the rest."""
    assert place.node is not None
    # The longest name first: names may have dots, which the path has too.
    for length in range(len(parts), 0, -1):
        key = ".".join(parts[:length])
        if key in place.node.value:
            return key, parts[length:]
    section = str(place.path[-1]) if place.path else ""
    if is_names(place.kind):
        if section in _DEFINING:
            what = {"bodies": "body", "tools": "tool"}.get(section, "boundary")
            message = f"unknown {what} {parts[0]!r}{suggest(parts[0], place.node.value)}"
            raise CaseError([Mistake(mark, message)])
        length = 2 if section in _DOTTED else 1
        return ".".join(parts[:length]), parts[length:]
    known = fields_of(place.kind, place.node)
    if parts[0] not in known:
        where = f" in {place.owner or place.path[-1]}" if place.path else ""
        for section in ("tools", "bodies") if not place.path else ():  # the name of a thing, without what it is
            if section in place.node.value and parts[0] in place.node.value[section].value:
                raise CaseError([Mistake(mark, f"unknown key {parts[0]!r}; did you mean {'.'.join((section, *parts))!r}?")])
        raise CaseError([Mistake(mark, f"unknown key {parts[0]!r}{where}{suggest_key(parts[0], known)}")])
    return parts[0], parts[1:]
