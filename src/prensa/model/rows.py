"""Rows of numbers in a YAML text: meshes and tables written out, thousands of lines of one form that need no YAML parser.

A run of lines ``- 1.5`` or ``- [0, 1, 2]`` of one indentation is taken out of the text before it is parsed and put back into
the tree: the parser takes some fifty microseconds a value, this two.
"""

from __future__ import annotations

import re
from itertools import islice
from typing import NamedTuple

RUN = 50  # lines from which on a run is taken out
STANDS = "\ue000"  # begins what stands for a run in the text; private use, so that nothing else does
_YAML_NUMBER = r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
_ROW_LINE = re.compile(rf"^( *)- (?:{_YAML_NUMBER}|\[ *{_YAML_NUMBER}(?: *, *{_YAML_NUMBER})* *\])\r?$", re.MULTILINE)


class Run(NamedTuple):
    """Lines of a run as written, and the number of the first, from 1."""

    line: int
    rows: list[str]


def taken_out(text: str, most: int | None = None) -> tuple[str, dict[str, Run]]:
    """The text with one item in place of each run, and the runs by what stands for them.

    Every line keeps its number. The last line of a run stays where it is: what follows may belong to it. No more than
    about ``most`` rows are looked at.
    """
    parts: list[str] = []
    runs: dict[str, Run] = {}
    done, line = 0, 1
    for spans in _runs(text, most) if STANDS not in text else []:
        name, rows = f"{STANDS}{len(runs)}", [text[a:b] for a, b in spans[:-1]]
        line += text.count("\n", done, spans[0][0])
        runs[name] = Run(line, rows)
        # Empty lines stay in place of the rows, so that line numbers in messages behind them are right.
        parts += [text[done : spans[0][0]], rows[0].partition("-")[0], "- ", name, "\n" * (len(rows) - 1)]
        line += len(rows) - 1
        done = spans[-2][1]
    return "".join([*parts, text[done:]]), runs


def _runs(text: str, most: int | None) -> list[list[tuple[int, int]]]:
    """Where each line of each run begins and ends."""
    runs: list[list[tuple[int, int]]] = []
    spans: list[tuple[int, int]] = []
    indent = None
    for row in islice(_ROW_LINE.finditer(text), most and most + RUN):
        # A run goes on only on the next line with the same indentation: another indentation belongs to another list.
        if not spans or row.start() != spans[-1][1] + 1 or row[1] != indent:
            spans, indent = [], row[1]
            runs.append(spans)
        spans.append(row.span())
    return [spans for spans in runs if len(spans) >= RUN]


def numbers(row: str) -> list[str]:
    """Numbers of a line of a run, as written."""
    return re.findall(_YAML_NUMBER, row.partition("- ")[2])
