"""Structure of the source as it states it: imports, lengths of functions, constants.  Nothing is imported to find out."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCES = (ROOT / "src" / "prensa", ROOT / "quality" / "prensa_bench")  # of the two distributions
LONGEST = 60  # lines of a function outside kernels
TABLE = "## Layers"  # heading of the table in CONTRIBUTING.md

Graph = dict[str, set[str]]


@dataclass(frozen=True)
class Import:
    """One module imports another; ``lazy`` inside a function."""

    importer: str
    imported: str
    line: int
    lazy: bool


def modules(*sources: Path) -> dict[str, Path]:
    """Dotted name of every module of the packages → its file; a package is named without ``__init__``."""
    found = {}
    for source, path in ((s, p) for s in sources or SOURCES for p in sorted(s.rglob("*.py"))):
        parts = path.relative_to(source.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def tree(path: Path) -> ast.Module:
    """Syntax tree of a file, read once."""
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


# -------------------------------------------------------------------------------------------------------------- imports
REGISTRY = "prensa.registry"


def imports(*sources: Path, types: bool = True) -> list[Import]:
    """Imports inside the packages, those under ``TYPE_CHECKING`` too unless `types` is false.

    Those in functions count, and so does a string that names a module: it is there to be imported by name. The version
    does not: it is a constant that the package binds before anything else. Nor does the registry's table of the packages in
    which laws are looked for (book, chapter 2): it stands in for arrows that point the other way, from the laws to it.
    """
    known = modules(*sources)
    found = []
    for name, path in known.items():
        for node, lazy in _statements(tree(path), False, types):
            base = _base(node, name, path)
            for target in _targets(node, base):
                module = _module(target, known)
                if module is not None and module != name and target != "prensa.__version__":
                    found.append(Import(name, module, node.lineno, lazy))
        if name != REGISTRY:
            found += [Import(name, module, line, True) for module, line in _named(tree(path)) if module in known]
    return found


def _named(module: ast.Module) -> Iterator[tuple[str, int]]:
    for node in ast.walk(module):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.startswith("prensa."):
            yield node.value, node.lineno


def _statements(node: ast.AST, lazy: bool, types: bool) -> Iterator[tuple[ast.Import | ast.ImportFrom, bool]]:
    """Import statements below a node, and whether each waits for a call; those under ``if TYPE_CHECKING:`` if `types`."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import | ast.ImportFrom):
            yield child, lazy
        elif isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test) and not types:
            for other in child.orelse:
                yield from _statements(other, lazy, types)
        else:
            inside = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
            yield from _statements(child, lazy or inside, types)


def _base(node: ast.Import | ast.ImportFrom, name: str, path: Path) -> str:
    """Module that ``from … import`` names, relative ones resolved."""
    if isinstance(node, ast.Import):
        return ""
    if not node.level:
        return node.module or ""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    parts = package.split(".")
    return ".".join([*parts[: len(parts) - node.level + 1], *([node.module] if node.module else [])])


def _targets(node: ast.Import | ast.ImportFrom, base: str) -> list[str]:
    return [f"{base}.{a.name}" if base else a.name for a in node.names]


def _module(target: str, known: dict[str, Path]) -> str | None:
    """The module that a dotted name leads to: itself, or the one that defines it."""
    for name in (target, target.rpartition(".")[0]):
        if name in known:
            return name
    return None


def circles(found: list[Import]) -> list[str]:
    """Shortest path around each group of modules that import one another, as ``a → b → a``."""
    graph: Graph = {}
    for i in found:
        graph.setdefault(i.importer, set()).add(i.imported)
        graph.setdefault(i.imported, set())
    return [" → ".join(_shortest(graph, group)) for group in _components(graph) if len(group) > 1]


def _components(graph: Graph) -> list[set[str]]:
    """Strongly connected components: modules that reach one another."""
    reach = {a: _reachable(graph, a) for a in graph}
    left, found = set(graph), []
    while left:
        a = min(left)
        group = {b for b in reach[a] if a in reach[b]} | {a}
        found.append(group)
        left -= group
    return found


def _reachable(graph: Graph, start: str) -> set[str]:
    seen: set[str] = set()
    front = [start]
    while front:
        for b in graph[front.pop()] - seen:
            seen.add(b)
            front.append(b)
    return seen


def _shortest(graph: Graph, group: set[str]) -> list[str]:
    """The shortest circle inside a component."""
    best: list[str] = []
    for start in sorted(group):
        paths = [[start]]
        seen = {start}
        while paths and not (best and len(paths[0]) + 1 >= len(best)):
            path = paths.pop(0)
            if start in graph[path[-1]]:
                best = [*path, start]
                break
            for b in sorted(graph[path[-1]] & group - seen):
                seen.add(b)
                paths.append([*path, b])
    return best


# --------------------------------------------------------------------------------------------------------------- layers
def layers(page: Path = ROOT / "CONTRIBUTING.md") -> dict[str, set[str]]:
    """Package → packages that it may import, as the table of the page says, from the top down."""
    text = page.read_text(encoding="utf-8")
    section = text[text.index(TABLE) :].split("\n## ")[0]
    rows = [line.split("|")[1:3] for line in section.splitlines() if line.startswith("| `")]
    return {name.strip(" `"): set(re.findall(r"`(\w+)`", may)) for name, may in rows}


def free(page: Path = ROOT / "CONTRIBUTING.md") -> set[str]:
    """Modules that every package may import, as the sentence under the table says."""
    found = re.search(r"^Every package may import (.*?)\.$", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert found is not None
    return set(re.findall(r"`(\w+)`", found[1]))


def package(module: str) -> str:
    """Layer of a module: the first name below ``prensa``, ``prensa`` for its own names; the second distribution is one layer."""
    first, *below = module.split(".")
    return below[0] if first == "prensa" and below else first


def arrows(found: list[Import]) -> dict[tuple[str, str], list[Import]]:
    """Imports between different packages."""
    between: dict[tuple[str, str], list[Import]] = {}
    for i in found:
        a, b = package(i.importer), package(i.imported)
        if a != b:
            between.setdefault((a, b), []).append(i)
    return between


def arrows_upward(found: list[Import]) -> list[str]:
    """Imports that the table does not allow, with their places; ``prensa`` itself names what it offers, lazily."""
    may, always = layers(), free()
    wrong = []
    for (a, b), several in arrows(found).items():
        if a == "prensa" or b in always or b in may.get(a, set()):
            continue
        wrong += [f"{i.importer}:{i.line} imports {i.imported}{' (in a function)' if i.lazy else ''}" for i in several]
    return wrong


# ------------------------------------------------------------------------------------------------------------ functions
def long_functions(*sources: Path, longest: int = LONGEST) -> list[str]:
    """Functions of more lines than that, docstring included, as ``module:line name (lines)``; kernels may be longer."""
    wrong = []
    for name, path in modules(*sources).items():
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not _is_kernel(node):
                lines = (node.end_lineno or node.lineno) - node.lineno + 1
                if lines > longest:
                    wrong.append(f"{name}:{node.lineno} {node.name} ({lines} lines)")
    return wrong


def _is_kernel(node: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Compiled by Numba: its decorator says so."""
    return any(re.search(r"\b(njit|jit|vectorize|guvectorize)\b", ast.unparse(d)) for d in node.decorator_list)


# ------------------------------------------------------------------------------------------------------------ constants
def constants_with_two_meanings(*sources: Path) -> list[str]:
    """UPPER_CASE names that two modules give different values, as ``NAME: module = value, …``."""
    meanings: dict[str, dict[str, str]] = {}
    for name, path in modules(*sources).items():
        for constant, value in _constants(tree(path)):
            meanings.setdefault(constant, {})[name] = value
    return [
        f"{constant}: " + ", ".join(f"{m} = {v[:60]}" for m, v in sorted(said.items()))
        for constant, said in sorted(meanings.items())
        if len(set(said.values())) > 1
    ]


def _constants(module: ast.Module) -> Iterator[tuple[str, str]]:
    """Names in capitals that a module binds at its top level (also by ``a, b = …`` and under ``if``), with the expression."""
    for node in _top_level(module.body):
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        value = ast.unparse(node.value) if node.value is not None else ""
        for target in targets:
            if isinstance(target, ast.Name):
                names = [(target.id, value)]
            elif isinstance(target, ast.Tuple):
                names = [(t.id, f"{value}[{k}]") for k, t in enumerate(target.elts) if isinstance(t, ast.Name)]
                if isinstance(node.value, ast.Tuple):
                    names = [(n, ast.unparse(v)) for (n, _), v in zip(names, node.value.elts)]
            else:
                continue
            yield from ((n, v) for n, v in names if re.fullmatch(r"_?[A-Z][A-Z0-9_]+", n))


def _top_level(body: list[ast.stmt]) -> Iterator[ast.Assign | ast.AnnAssign]:
    for node in body:
        if isinstance(node, ast.Assign | ast.AnnAssign):
            yield node
        elif isinstance(node, ast.If | ast.Try):
            yield from _top_level(node.body)
            yield from _top_level(node.orelse)
