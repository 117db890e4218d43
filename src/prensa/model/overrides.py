"""Changes of a case from outside its file, ``tools.cylinder.radius=20``, made on the tree before it is validated."""

from __future__ import annotations

from prensa.errors import CaseError, Mark, Mistake
from prensa.model.names import suggest
from prensa.model.places import Place, child, fields_of, is_names
from prensa.model.text import Node, read

# Names under these keys are defined there: an override changes what exists, a new name is a typing error. Names under
# the others refer to something and are checked with the rest of the case.
_DEFINING = ("bodies", "tools", "boundaries")
_DOTTED = ("fixed", "loads", "friction")


def override(root: Place, text: str) -> list[Mistake]:
    """Set one value of the tree; *text* is ``path=value``, the value in YAML, the path in dots, indices from 0 or names.

    Returns the mistakes inside the value (NaN, duplicate keys).

    Raises
    ------
    CaseError
        If the path leads nowhere or the value cannot be read.

    """
    path, equals, value = text.partition("=")
    mark = Mark(f"--set {text}")
    if not equals or not path.strip():
        raise CaseError([Mistake(mark, "write it as path=value, for example tools.punch.radius=20")])
    node, mistakes = read(value, mark.source, marked=False)
    # Mistakes in the value then point at the command line, where it was written, and not at a line of the file.
    _paint(node, mark)
    _set(root, path.strip().split("."), node, mark)
    return mistakes


def _paint(node: Node, mark: Mark) -> None:
    """Keys inside the value are in the command line too."""
    node.mark = mark
    node.keys = dict.fromkeys(node.keys, mark)
    for below in node.children():
        _paint(below, mark)


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
    if key not in here.value or here.value[key].value is None:
        here.value[key], here.keys[key] = Node({}, mark), mark
    _set(child(place, key), rest, new, mark)


def _index(place: Place, parts: list[str], mark: Mark) -> tuple[int, list[str]]:
    """Number of the entry that the path names here, by number or by its own name (which may have dots), and the rest."""
    assert place.node is not None
    part, count, name = parts[0], len(place.node.value), ".".join(map(str, place.path))
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
        raise CaseError([Mistake(mark, f"unknown key {parts[0]!r}{where}{suggest(parts[0], known)}")])
    return parts[0], parts[1:]
