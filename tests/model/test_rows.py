"""Rows of numbers are read apart from the rest of a text, quickly, and nobody sees a difference."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

import prensa as pr
from prensa.errors import CaseError
from prensa.mesh.generate import mesh_of
from prensa.model import rows, text
from prensa.model.schema import dump, loads

RUN = rows.RUN
NUMBERS = st.sampled_from(["0", "-1", "+7", "1.5", ".5", "2.", "1e3", "-1E-3", "123456789012345678901", "1e999", "007"])
LINES = st.one_of(
    NUMBERS.map(lambda n: f"- {n}"),
    st.lists(NUMBERS, min_size=1, max_size=3).map(lambda n: f"- [{', '.join(n)}]"),
    st.sampled_from(
        ["- [1 , 2 ]", "- a", "- []", "- [1,]", "-", "- - 1", "  - 1", "# c", "", "- 1 # c", "- &a 1", "  x"]
    ),
)


def tree(node: text.Node) -> object:
    """Values of a tree with the lines they stand in."""
    if isinstance(node.value, dict):
        return node.mark.line, {k: tree(n) for k, n in node.value.items()}
    if isinstance(node.value, list):
        return node.mark.line, [tree(n) for n in node.value], node.size, node.height
    return node.mark.line, node.value, node.text


def outcome(case: str) -> object:
    try:
        root, mistakes = text.read(case, "x")
    except CaseError as error:
        return [(m.mark.line, m.message) for m in error.mistakes]
    return tree(root), [(m.mark.line, m.message) for m in mistakes]


@given(
    st.lists(st.tuples(LINES, st.integers(1, 8)), min_size=1, max_size=8),
    st.sampled_from(["a:\n", "", "a:\n  b: |\n", "a: word\n", "a: 'quoted\n", "a: [\n", "- 1\n", "a: >\n\n", "? \n"]),
    st.sampled_from(["", "  ", "    "]),
    st.sampled_from(["b: 1\n", "", "  x\n", "'\n", "      deep\n", "]\n", "\ue0000\n"]),
    st.sampled_from(["\n", "\r\n"]),
)
def test_rows_read_apart_are_those_read_with_the_rest(lines, start, indent, end, newline):
    """Whatever stands before, between and after runs of rows: the tree, its lines and the mistakes are the same."""
    body = "".join(f"{indent}{line}{newline}" * count for line, count in lines)
    case = start + body + end
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rows, "RUN", 3)
        apart = outcome(case)
        patch.setattr(rows, "RUN", 10**9)
        assert apart == outcome(case)


def test_lines_of_a_text_that_look_like_rows_stay_text():
    """A description with a column of numbers is what was written."""
    lines = "".join(f"- [{k}, 0.5]\n" for k in range(RUN + 5))
    name = text.read("name: |\n" + "".join(f"  {line}\n" for line in lines.splitlines()), "x")[0].value["name"]
    assert name.value == lines


def test_a_mesh_written_out_is_read_and_its_mistakes_have_their_lines():
    """Thousands of nodes come back as they were, and an error in a row names its line."""
    mesh = mesh_of(pr.Rectangle(size=(1.0, 1.0), n=(60, 60)))
    points = pr.Points(
        tuple(map(tuple, mesh.points.tolist())), tuple(map(tuple, mesh.cells.tolist())),
        {name: tuple(mesh.nodes(name).tolist()) for name in mesh.edges},
    )  # fmt: skip
    problem = pr.Problem("a", {"b": pr.Body(points, pr.Elastic(1.0, 0.3))}, (pr.Step("s"),))
    written = dump(problem)
    assert loads(written).problem == problem
    lines = written.splitlines()
    at = next(k for k, line in enumerate(lines) if "cells:" in line) + 100
    lines[at] = lines[at].replace("[", "[0.5, ")
    with pytest.raises(CaseError, match=rf"^x:{at + 1}:\d+: cells\[99\]\[0\] .* is 0.5; a whole number"):
        loads("\n".join(lines), "x")


def test_a_case_of_any_size_that_was_written_by_the_program_is_read_back(monkeypatch):
    """The case in a checkpoint has no limit, so that a run whose mesh came from a script can be resumed."""
    monkeypatch.setattr(text, "NUMBERS", 500)
    points = pr.Points(tuple((float(k), 0.0) for k in range(500)), ((0, 1, 2),), {})
    problem = pr.Problem("a", {"b": pr.Body(points, pr.Elastic(1.0, 0.3))}, (pr.Step("s"),))
    with pytest.raises(CaseError, match="numbers in rows; put a mesh into a file"):
        loads(dump(problem))
    assert loads(dump(problem), bounded=False).problem == problem
