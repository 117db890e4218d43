"""The house stands straight: no import circles, arrows that point down, functions that fit on a screen, one meaning a name."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import pytest
import structure


@cache
def known_imports() -> list[structure.Import]:
    """Imports of the packages; not when tests are collected, which every process of them does."""
    return structure.imports()


def test_no_modules_import_one_another() -> None:
    """No module reaches itself along imports, those inside functions and those for types counted."""
    assert structure.circles(known_imports()) == []


def test_imports_point_down() -> None:
    """No package imports another that its row of the table in CONTRIBUTING.md does not name, not even inside a function."""
    assert structure.arrows_upward(known_imports()) == []


def test_the_table_of_layers_is_in_order_and_says_no_more_than_needed() -> None:
    """Every package has a row, a row names only rows below it, and every arrow that it allows is used."""
    may, always = structure.layers(), structure.free()
    used = structure.arrows(known_imports())
    rows = list(may)
    assert {structure.package(m) for m in structure.modules()} - {"prensa"} - always == set(rows)
    for k, name in enumerate(rows):
        assert may[name] - {"prensa"} <= set(rows[k + 1 :]), f"{name} names a package above it"
    assert [(a, b) for a in rows for b in sorted(may[a]) if (a, b) not in used] == []


def test_rooms_stand_in_their_order() -> None:
    """From kernels up to derivatives, laws below what is discretised, and that below the solver."""
    order = ["kernels", "geometry", "mesh", "friction", "materials", "elements", "tools", "contact", "system", "linear"]
    order += ["result", "measures", "checks", "solver", "remeshing", "sensitivity"]
    assert [row for row in reversed(structure.layers()) if row in order] == order


def test_functions_fit_on_a_screen() -> None:
    """No function outside kernels is longer than 60 lines."""
    assert structure.long_functions() == []


@pytest.mark.parametrize("room", ["system", "linear", "contact", "solver", "result", "checks"])
def test_signatures_of_the_rooms_of_numerics_have_no_any(room: str) -> None:
    """Parameters and results of functions have real types there."""
    found = []
    for module, path in structure.modules().items():
        for node in ast.walk(structure.tree(path)) if structure.package(module) == room else ():
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                signature = [node.args, *([node.returns] if node.returns else [])]
                names = {n.id for part in signature for n in ast.walk(part) if isinstance(n, ast.Name)}
                found += [f"{module}:{node.lineno} {node.name}"] * ("Any" in names)
    assert found == []


def test_a_constant_has_one_meaning() -> None:
    """No name in capitals has two values in two modules."""
    assert structure.constants_with_two_meanings() == []


# --------------------------------------------------------------------------------------------- the checks find what they seek
@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package with one fault of each kind."""
    many = "    x = 1\n" * 60
    files = {
        "prensa/__init__.py": "",
        "prensa/model/__init__.py": "",
        "prensa/model/a.py": "LIMIT = 1\ndef f():\n    from prensa.solver import b\n    return b\n",
        "prensa/solver/__init__.py": "",
        "prensa/solver/b.py": "from prensa.model.a import f\nif True:\n    LIMIT, OTHER = 2, 3\n",
        "prensa/solver/c.py": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from . import d\nOTHER = 3\n",
        "prensa/solver/d.py": "from . import c\ndef long():\n" + many + "@njit\ndef k():\n" + many,
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path / "prensa"


def test_a_lazy_import_that_closes_a_circle_is_found(package: Path) -> None:
    """A circle through a function counts and is reported by its path; so does one for types only, unless these are left out."""
    found = structure.imports(package)
    lazy, types = "prensa.model.a → prensa.solver.b → prensa.model.a", "prensa.solver.c → prensa.solver.d → prensa.solver.c"
    assert structure.circles(found) == [lazy, types]
    assert structure.circles(structure.imports(package, types=False)) == [lazy]
    assert structure.Import("prensa.solver.d", "prensa.solver.c", 1, False) in found
    assert structure.arrows_upward(found) == ["prensa.model.a:3 imports prensa.solver.b (in a function)"]


def test_long_functions_and_ambiguous_constants_are_found(package: Path) -> None:
    """A function of 61 lines is too long, a kernel of 61 is not; ``a, b = …`` defines two constants."""
    assert structure.long_functions(package) == ["prensa.solver.d:2 long (61 lines)"]
    assert structure.constants_with_two_meanings(package) == ["LIMIT: prensa.model.a = 1, prensa.solver.b = 2"]


def test_shortest_circle_is_reported() -> None:
    """Of several ways round, the shortest is shown."""
    edges = ["ab", "bc", "cd", "da", "cb"]
    assert structure.circles([structure.Import(a, b, 1, False) for a, b in edges]) == ["b → c → b"]
