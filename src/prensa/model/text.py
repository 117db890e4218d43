"""YAML text ⇄ a tree of nodes that know their line and column: data only, no objects, no surprises.

The events of ruamel.yaml are turned into nodes here rather than by its constructors: every node keeps its mark, all the
mistakes of a file are collected, keys stay text (``y`` and ``on`` are no booleans), and what a case never needs
(tags, NaN, deep nesting, aliases that multiply, more text than a case has) is refused while it is still cheap.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from prensa.errors import CaseError, Mark, Mistake
from prensa.model.rows import Run, numbers, taken_out

MAX_NESTING = 50  # levels of a file; cases have less than ten
COPIES = 100_000  # values that aliases may stand for
# What is read in a second at its slowest. Cases have some thousand characters and some hundred keys and values; rows of
# numbers on lines of their own, '- [0, 1]', are cheap and come on top, enough for a mesh of seven thousand nodes.
SIZE = 100_000  # characters besides rows of numbers; cases have some thousand
VALUES = 8_000  # keys and values; cases have some hundred
MISTAKES = 200
NUMBERS = 40_000  # numbers in rows
MOVE_TO_FILES = "put a mesh into a file (.msh or .inp) and a table into a .csv file"
WIDTH = 110  # characters of a line that is written

_INT = re.compile(r"[-+]?[0-9]+")
_RADIX = re.compile(r"0o[0-7]{1,20}|0x[0-9a-fA-F]{1,16}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_BRACKETS = re.compile(rf"(?:[\[{{]\s*){{{MAX_NESTING + 1}}}")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_YAML_WORDS = {"": None, "~": None, "null": None, "Null": None, "NULL": None} | {
    w: v for v, words in ((True, "true True TRUE"), (False, "false False FALSE")) for w in words.split()
}


@dataclass
class Node:
    """A value of the file: a scalar, a list of nodes or a dict of nodes; ``text``: a scalar as it was written."""

    value: Any
    mark: Mark
    text: str = ""
    keys: dict[str, Mark] = field(default_factory=dict)
    height: int = 0
    size: int = 1

    @property
    def spread(self) -> bool:
        """Whether the value has no place of its own to point at: a block, or nothing."""
        return isinstance(self.value, dict | list) or (self.value is None and not self.text)

    def children(self) -> Iterator[Node]:
        """Nodes directly below."""
        if isinstance(self.value, dict):
            yield from self.value.values()
        elif isinstance(self.value, list):
            yield from self.value

    def plain(self) -> Any:
        """The value as dicts, lists and scalars."""
        if isinstance(self.value, dict):
            return {k: n.plain() for k, n in self.value.items()}
        if isinstance(self.value, list):
            return [n.plain() for n in self.value]
        return self.value

    def shown(self) -> str:
        """The value in a message: a scalar as written, else its kind."""
        if isinstance(self.value, dict):
            return "a mapping"
        if isinstance(self.value, list):
            return "a list"
        if self.value is None:
            return "empty"
        text = self.text if len(self.text) <= 60 else self.text[:57] + "…"
        return repr(text) if isinstance(self.value, str) else text


def resolve(text: str) -> Any:
    """Value of a plain scalar by the YAML 1.2 core schema, with ``10e3`` and ``1e-3`` numbers.

    Raises
    ------
    ValueError
        For ``.nan``, ``.inf`` and numbers too large for a float.

    """
    if _INT.fullmatch(text) and len(text) <= 20:
        return int(text)
    if _FLOAT.fullmatch(text):
        number = float(text)
        if abs(number) == float("inf"):
            raise ValueError(f"{text[:40]} is too large a number")
        return number
    if text in _YAML_WORDS:
        return _YAML_WORDS[text]
    if _NOT_FINITE.fullmatch(text):
        raise ValueError(f"{text} is not a finite number")
    if _RADIX.fullmatch(text):
        return int(text, 0)
    return text


def content_of(path: Path) -> str:
    """Text of a file of other data than a case.

    Raises
    ------
    CaseError
        If it cannot be read.

    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise CaseError([Mistake(Mark(str(path)), f"cannot be read: {error}")]) from None


def read(text: str, source: str, marked: bool = True, bounded: bool = True) -> tuple[Node, list[Mistake]]:
    """Tree of a YAML text and the mistakes that do not hinder reading on (duplicate keys, NaN).

    ``marked`` False gives every node the whole *source* as its place (a value on the command line); ``bounded`` False reads
    texts of any size (what this program has written itself).

    Raises
    ------
    CaseError
        If the text is not YAML, has several documents, tags, too deep nesting, runaway aliases, or is no case for its size.

    """
    if match := _BRACKETS.search(text):  # the scanner takes seconds over them before it yields its first event
        before = text[: match.start()]
        mark = Mark(source, before.count("\n") + 1, match.start() - before.rfind("\n"))
        raise CaseError([Mistake(mark, f"nested deeper than {MAX_NESTING} levels; a case needs less than ten")])
    short, runs = taken_out(text, NUMBERS if bounded else None)
    if bounded:
        _refuse_monsters(short, runs, source)
    reader = _Reader(short, source, marked, bounded, runs)
    try:
        root = reader.document()
    except CaseError as error:
        # A run inside a block of text is no list: taking it out may itself have made the mistake. Only those before it can
        # have.
        if not any(run.line < error.mistakes[-1].mark.line for run in reader.runs.values()):
            raise
    if reader.runs:  # some were no lists: lines of a text
        reader = _Reader(text, source, marked, bounded)
        root = reader.document()
    return root, reader.mistakes


def _refuse_monsters(short: str, runs: dict[str, Run], source: str) -> None:
    if sum(1 + row.count(",") for run in runs.values() for row in run.rows) > NUMBERS:
        raise CaseError([Mistake(Mark(source), f"more than {NUMBERS} numbers in rows; {MOVE_TO_FILES}")])
    size = len(short) - sum(len(run.rows) for run in runs.values())  # every row leaves its end of line behind
    if size > SIZE:
        message = (
            f"{size} characters besides rows of numbers; a case has some thousand: is this the right file? If so, "
        )
        raise CaseError([Mistake(Mark(source), message + MOVE_TO_FILES)])


_GLUED = re.compile(r"[\s-]*([A-Za-z_][\w.]*):(?![/\s])(\S.*)")
"""A line with a key whose value follows the colon at once."""


class _Reader:
    def __init__(self, text: str, source: str, marked: bool, bounded: bool, runs: dict[str, Run] | None = None) -> None:
        from ruamel.yaml import YAML

        self.source, self.marked, self.lines = source, marked, text.splitlines()
        self.left = VALUES if bounded else -1
        self.runs = dict(runs or {})
        self.mistakes: list[Mistake] = []
        self.anchors: dict[str, Node | None] = {}
        self.copies = 0
        self.events = YAML(typ="safe", pure=True).parse(text)

    def mark(self, place: Any) -> Mark:
        return Mark(self.source, place.line + 1, place.column + 1) if self.marked else Mark(self.source)

    def refuse(self, place: Any, message: str) -> CaseError:
        return CaseError([*self.mistakes, Mistake(self.mark(place), message)])

    def glued(self, place: Any) -> CaseError | None:
        """The error of a line before a place in which no blank follows the colon, so that it is no key; None if it has one."""
        for number in range(min(place.line, len(self.lines) - 1), max(place.line - 3, -1), -1):
            line = self.lines[number]
            if found := _GLUED.fullmatch(line):
                words = f"a blank is missing after the colon: write '{found[1]}: {found[2].strip()}'"
                at = Mark(self.source, number + 1, 1 + line.index(found[1])) if self.marked else Mark(self.source)
                return CaseError([*self.mistakes, Mistake(at, words)])
        return None

    def next(self) -> Any:
        from ruamel.yaml.error import MarkedYAMLError, YAMLError
        from ruamel.yaml.reader import ReaderError

        try:
            return next(self.events)
        except MarkedYAMLError as error:
            place = error.problem_mark or error.context_mark
            problem = str(error.problem or error.context)
            no_key = "mapping values are not allowed" in problem or "could not find expected ':'" in problem
            if no_key and (glued := self.glued(place)) is not None:
                raise glued from None
            raise self.refuse(place, _yaml_message(problem)) from None
        except ReaderError as error:
            message = f"the character U+{int(error.character):04X} is not allowed; is this a text file?"
            raise CaseError([Mistake(Mark(self.source), message)]) from None
        except YAMLError as error:
            raise CaseError([Mistake(Mark(self.source), f"not readable as YAML: {error}")]) from None

    def note(self, mark: Mark, message: str) -> None:
        """A mistake that does not hinder reading on; many of one kind do."""
        self.mistakes.append(Mistake(mark, message))
        if len(self.mistakes) >= MISTAKES:
            raise CaseError(self.mistakes)

    def count(self, event: Any) -> None:
        if self.left == 0:
            message = f"more than {VALUES} keys and values before this one; a case has some hundred: {MOVE_TO_FILES}, "
            raise self.refuse(event.start_mark, message + "or write rows of numbers on lines of their own, '- [0, 1]'")
        self.left -= 1

    def document(self) -> Node:
        from ruamel.yaml.events import DocumentEndEvent, DocumentStartEvent, StreamEndEvent, StreamStartEvent

        root = None
        while not isinstance(event := self.next(), StreamEndEvent):
            if isinstance(event, StreamStartEvent | DocumentEndEvent):
                continue
            if isinstance(event, DocumentStartEvent):
                if root is not None:
                    raise self.refuse(event.start_mark, "a second document begins here; a file holds one case")
                continue
            root = self.node(event, 0)
        return root or Node(None, Mark(self.source))

    def node(self, event: Any, depth: int) -> Node:
        from ruamel.yaml.events import AliasEvent, ScalarEvent, SequenceStartEvent

        if depth > MAX_NESTING:
            raise self.refuse(event.start_mark, f"nested deeper than {MAX_NESTING} levels; a case needs less than ten")
        self.count(event)
        if isinstance(event, AliasEvent):
            return self.alias(event, depth)
        if event.tag is not None:
            raise self.refuse(event.start_mark, f"the tag {_tag(event.tag)!r} is not allowed; write plain values")
        if event.anchor is not None:
            self.anchors[event.anchor] = None
        if isinstance(event, ScalarEvent):
            node = self.scalar(event)
        elif isinstance(event, SequenceStartEvent):
            node = self.sequence(event, depth)
        else:
            node = self.mapping(event, depth)
        node.height = 1 + max((n.height for n in node.children()), default=-1)
        node.size = 1 + sum(n.size for n in node.children())
        if event.anchor is not None:
            self.anchors[event.anchor] = node
        return node

    def scalar(self, event: Any) -> Node:
        mark = self.mark(event.start_mark)
        if event.style:  # quoted and block scalars are text
            return Node(event.value, mark, event.value)
        return self.plain(event.value, mark)

    def plain(self, text: str, mark: Mark) -> Node:
        try:
            return Node(resolve(text), mark, text)
        except ValueError as error:
            self.note(mark, f"{error}; every number of a case is finite")
            return Node(None, mark, text)

    def sequence(self, event: Any, depth: int) -> Node:
        from ruamel.yaml.events import ScalarEvent, SequenceEndEvent

        items: list[Node] = []
        while not isinstance(child := self.next(), SequenceEndEvent):
            if isinstance(child, ScalarEvent) and child.value in self.runs:
                items += self.rows(child)
            elif isinstance(child, ScalarEvent) and not child.style and ";" in child.value:
                items += self.semicolons(child)
            else:
                items.append(self.node(child, depth + 1))
        return Node(items, self.mark(event.start_mark))

    def semicolons(self, event: Any) -> list[Node]:
        """Entries of a list that semicolons separate, which is a mistake; what follows from it is not reported besides."""
        mark, parts = self.mark(event.start_mark), [part.strip() for part in event.value.split(";")]
        self.note(mark, f"commas separate the entries of a list, not semicolons; write {', '.join(filter(None, parts))}")
        return [self.plain(part, mark) for part in parts if part]

    def rows(self, event: Any) -> Iterator[Node]:
        """Items of the run that the event stands for; the numbers of a row have its place."""
        for k, row in enumerate(self.runs.pop(event.value).rows):
            place = event.start_mark
            mark = Mark(self.source, place.line + 1 + k, place.column + 1) if self.marked else Mark(self.source)
            found = [self.plain(number, mark) for number in numbers(row)]
            yield Node(found, mark, height=1, size=1 + len(found)) if row.endswith(("]", "]\r")) else found[0]

    def mapping(self, event: Any, depth: int) -> Node:
        from ruamel.yaml.events import MappingEndEvent, ScalarEvent

        node, last = Node({}, self.mark(event.start_mark)), None
        while not isinstance(child := self.next(), MappingEndEvent):
            if not isinstance(child, ScalarEvent) or child.tag is not None:
                raise self.refuse(child.start_mark, "a key is plain text here; write 'key: value'")
            self.count(child)
            key, mark = child.value, self.mark(child.start_mark)
            value = self.node(self.next(), depth + 1)
            if last is not None and _is_cut(last.value) and value.value is None:
                last.value += f", {key}"
                if not _is_cut(last.value):
                    self.note(last.mark, f"between braces a text with commas stands in quotes; write '{last.value}'")
                continue
            last = value
            if key == "<<" and not child.style:
                message = "merge keys ('<<') are not supported; repeat the entries or use an alias for the whole value"
                self.note(mark, message)
            elif key in node.value:
                first = f" (first at line {node.keys[key].line})" if self.marked else ""
                several = isinstance(value.value, list | dict) and isinstance(node.value[key].value, list | dict)
                remedy = f"put the entries of both under one '{key}:', or remove one" if several else "keep one"
                self.note(mark, f"the key {key!r} appears twice{first}; {remedy}")
            else:
                node.value[key], node.keys[key] = value, mark
        return node

    def alias(self, event: Any, depth: int) -> Node:
        if event.anchor not in self.anchors:
            raise self.refuse(
                event.start_mark, f"the alias '*{event.anchor}' has no anchor '&{event.anchor}' before it"
            )
        node = self.anchors[event.anchor]
        if node is None:
            raise self.refuse(event.start_mark, f"the alias '*{event.anchor}' contains itself; write the values out")
        # Aliases of aliases multiply: ten lines can stand for a billion values (the 'billion laughs').
        self.copies += node.size
        if self.copies > COPIES:
            raise self.refuse(
                event.start_mark, f"the aliases stand for more than {COPIES} values; write a smaller case"
            )
        if depth + node.height > MAX_NESTING:
            raise self.refuse(event.start_mark, f"nested deeper than {MAX_NESTING} levels; a case needs less than ten")
        return _copied(node)


def _copied(node: Node) -> Node:
    """A copy of its own, so that an override of one use leaves the others alone."""
    value = node.value
    if isinstance(value, dict):
        value = {k: _copied(n) for k, n in value.items()}
    elif isinstance(value, list):
        value = [_copied(n) for n in value]
    return Node(value, node.mark, node.text, dict(node.keys), node.height, node.size)


def _tag(tag: Any) -> str:
    return str(tag).replace("tag:yaml.org,2002:", "!!")[:40]


def _yaml_message(problem: str) -> str:
    if "\\t" in problem or "'\t'" in problem:
        return "a tab cannot indent in YAML; use spaces"
    if "mapping values are not allowed" in problem:
        return "unexpected ':'; check the indentation, and put quotes around text that contains ': '"
    if "could not find expected ':'" in problem:
        return "this line has no ':' where a key is expected; write 'key: value'"
    if "expected ',' or" in problem:
        return "a ',' or a closing bracket is missing; check the brackets from the line before"
    if "<block end>" in problem:
        return "unexpected indentation; align the keys of one mapping"
    return f"not readable as YAML: {problem}; check indentation, brackets and quotes"


# ------------------------------------------------------------------------------------------------------------- writing
_PLAIN = re.compile(r"[A-Za-z_][\w.+-]*( [\w.+-]+)*", re.ASCII)
_ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}


def write(data: dict[str, Any]) -> str:
    """YAML of nested dicts, lists and scalars: in one line what fits, keys in the order given, ready for `read`."""
    return "".join(f"{line}\n" for line in _block(data, 0, top=True))


def _scalar(value: Any) -> str:
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _string(value)
    text = repr(value)
    # −0 without its point would be read as the whole number 0, and lose its sign.
    return text.removesuffix(".0") if text != "-0.0" else text


def _string(text: str) -> str:
    # Names such as 'null' or 'true' would be read as other values: they are quoted.
    if _PLAIN.fullmatch(text) and isinstance(resolve(text), str):
        return text
    return '"' + "".join(_ESCAPES.get(c) or (c if c.isprintable() else _escape(ord(c))) for c in text) + '"'


def _escape(code: int) -> str:
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def line(value: Any) -> str:
    """One line of YAML, in brackets."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_string(k)}: {line(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(line, value)) + "]"
    return _scalar(value)


def _block(value: Any, indent: int, top: bool = False) -> Iterator[str]:
    pad = " " * indent
    if isinstance(value, dict):
        entries = ((f"{pad}{_string(k)}:", v) for k, v in value.items())
    else:
        entries = ((f"{pad}-", v) for v in value)
    for head, v in entries:
        flow = line(v)
        if not isinstance(v, dict | list) or not v or (len(head) + len(flow) < WIDTH and not (top and _nested(v))):
            yield f"{head} {flow}"
        else:
            yield head
            yield from _block(v, indent + 2)


def _nested(value: Any) -> bool:
    """Whether a top-level section reads better with one entry a line (bodies, steps, …)."""
    items = value.values() if isinstance(value, dict) else value
    return any(isinstance(v, dict | list) for v in items)


def _is_cut(text: Any) -> bool:
    """Whether a text ends within parentheses, after something else."""
    return isinstance(text, str) and not text.startswith("(") and text.count("(") > text.count(")")
