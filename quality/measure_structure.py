"""Measure how the source is built: circles, arrows, numbers that tune, types, comments, one increment traced.

    python quality/measure_structure.py [SOURCE]              of src/prensa, or of another one, such as that of an older checkout
    python quality/measure_structure.py [SOURCE] --no-trace   without running anything
    python quality/measure_structure.py --moves 40            the calls between files that the easiest increment makes most, alone

Definitions
-----------
Only files below SOURCE count, and imports between them. Imports under ``TYPE_CHECKING`` count, and so do those inside
functions and strings that name a module; the registry's table of packages does not.

*Circles between files*: strongly connected components of the graph of imports with more than one file. *Circles between
rooms*: the same of rooms. *Arrows up*: imports of a room above one's own, in ``ORDER``, by a file of a room in it; a room
that is not in the list is above all of them. A *room* is the folder below SOURCE, or the file that stands there itself.
``ROOMS`` is for checkouts from before the rooms were sorted (November 2026), in which several shared the folders `fem` and
`solver`: it names the room of each file that has moved to another one since, so that the same rooms are compared. It changes
nothing in the layout as it is now.

*Numbers that tune*, outside the rooms of ``UNTUNED``, of four kinds:
1. constants: single names in capitals bound at the top level of a module to arithmetic of numbers alone (``1 << 14``, ``2.0
   / 3``);
2. policy: fields with a number in their default of the classes of policy.py, and of the groups that follow it there;
3. defaults: floats, whatever their value, as defaults of parameters of functions;
4. literals: floats inside functions (their bodies) other than 0, 1, 2, 3, 4 and the fractions 1/4, 1/2, 3/2.
Two more are printed beside the sum, so that a number that hides there is seen: constants bound several at once, and number
defaults of the fields of dataclasses outside policy.py.

*Any*: lines of code in which the name stands (imports of it not counted), and functions with it in their signature
(parameters or result; of methods too). *Copies*: top-level assignments ``Name = NDArray[...]`` beyond the first of each
name, and those of ``Array`` alone. *Comments*: lines with nothing but a comment, over all lines. *Lines of code*: lines with
a token other than comments and docstrings. *Newton state*: annotated fields of the class ``NewtonState``, and with those of
the classes of its module that it holds in their place.

*Trace*: an elastic block of 2 × 1 elements under a plane without friction, three increments, with the predictor (whose
extrapolation may be exact: no iteration is left then) and without (one iteration); the last one is followed by
``sys.setprofile`` from the request for it to its being yielded: calls of functions defined below SOURCE, functions, files,
lines of these functions, and moves between files: calls from a function of one file into one of another, and the returns
from them.
"""

from __future__ import annotations

import argparse
import ast
import io
import re
import sys
import tokenize
from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "docs"))

import structure  # noqa: E402

ORDER = [
    "types", "precision", "errors", "registry", "layout", "derivatives", "policy", "timer", "reference", "model", "kernels",
    "geometry", "importers", "mesh", "friction", "materials", "tools", "testing", "elements", "contact", "system", "linear",
    "result",
    "measures", "checks", "solver", "remeshing", "conduction", "analysis", "dies", "sensitivity", "output", "study", "verify",
    "inverse", "bench", "cli", "__main__",
]  # fmt: skip
"""Rooms from below upwards, those of older checkouts (`bench`) among them."""
UNTUNED = {"verify", "bench", "output"}
ROOMS = {
    "system": "fem/assembly fem/contacts fem/contact_interaction fem/context fem/control fem/determinate fem/discretise "
    "fem/element_sizes fem/failure fem/interaction fem/letting_go fem/loads fem/mirrors fem/mortar fem/outlines fem/planning "
    "fem/remeshed fem/saved fem/schedule fem/spatial fem/start fem/state fem/strings fem/symmetry fem/system fem/ties "
    "fem/time_rule solver/failure solver/outcome",
    "contact": "fem/passing fem/surface",
    "mesh": "fem/sizes",
    "importers": "mesh/abaqus mesh/abaqus_case mesh/abaqus_steps mesh/abaqus_tools mesh/abaqus_words mesh/deck mesh/gmsh "
    "mesh/imported tools/drawing",
    "linear": "fem/modes solver/condensation solver/condensed_bodies solver/eliminated solver/linear solver/multipliers "
    "solver/reduced solver/threads",
    "result": "solver/assembled solver/increment solver/ledger solver/results solver/views",
    "checks": "fem/doubts fem/feeding fem/folds fem/inside fem/limits fem/motions fem/overlap fem/passing_ahead fem/preflight "
    "solver/acceptance solver/distortion solver/folding solver/passages solver/quality solver/tipping solver/validity",
    "remeshing": "fem/renewal fem/transfer solver/remeshing",
    "policy": "solver/policy",
    "timer": "solver/timer",
}
"""Room → files that stood in the folder of another one."""
_ROOM = {f"prensa.{file.replace('/', '.')}": room for room, files in ROOMS.items() for file in files.split()}
SIMPLE = {0.0, 1.0, 2.0, 3.0, 4.0, 0.25, 0.5, 1.5}


def room(module: str) -> str:
    """Room of a module."""
    return _ROOM.get(module) or structure.package(module)


@cache
def files(source: Path) -> dict[str, Path]:
    """Module → file."""
    return structure.modules(source)


# -------------------------------------------------------------------------------------------------------------- imports
def graph_of(source: Path) -> None:
    """Print circles and arrows."""
    found = structure.imports(source)
    between = {(room(i.importer), room(i.imported)) for i in found}
    rooms = [structure.Import(a, b, 0, False) for a, b in between if a != b and "prensa" not in (a, b)]
    circles = structure.circles(found)
    print(f"circles between files: {len(circles)}")
    print(*(f"    {c}" for c in circles), sep="\n", end="\n" if circles else "")
    circles = structure.circles(rooms)
    print(f"circles between rooms: {len(circles)}")
    print(*(f"    {c}" for c in circles), sep="\n", end="\n" if circles else "")
    rank = {name: k for k, name in enumerate(ORDER)}
    above = len(rank)
    ranked = {(i.importer, i.imported) for i in found if room(i.importer) in rank and room(i.imported) != "prensa"}
    up = sorted((a, b) for a, b in ranked if rank.get(room(b), above) > rank[room(a)])
    print(f"arrows up: {len(up)} between files, {len({(room(a), room(b)) for a, b in up})} between rooms")
    print(*(f"    {room(a)} → {room(b)}: {a} imports {b}" for a, b in up), sep="\n", end="\n" if up else "")


# -------------------------------------------------------------------------------------------------------------- numbers
def _numbers(node: ast.AST) -> list[float]:
    """Numbers in an expression."""
    return [n.value for n in ast.walk(node) if isinstance(n, ast.Constant) and type(n.value) in (int, float)]  # type: ignore[misc]


_ARITHMETIC = (ast.Constant, ast.BinOp, ast.UnaryOp, ast.operator, ast.unaryop)


def _arithmetic(node: ast.AST) -> bool:
    """Whether an expression is arithmetic of numbers alone."""
    return all(isinstance(n, _ARITHMETIC) for n in ast.walk(node)) and bool(_numbers(node))


def _is_float(node: ast.AST | None) -> bool:
    """Whether an expression is a float, with or without a sign."""
    if isinstance(node, ast.UnaryOp):
        node = node.operand
    return isinstance(node, ast.Constant) and type(node.value) is float


def constants(tree: ast.Module) -> tuple[int, int]:
    """Module constants bound by themselves to arithmetic of numbers, and those bound several at once."""
    single = several = 0
    for node in tree.body:
        if not isinstance(node, ast.Assign):
            continue
        (target, *_), value = node.targets, node.value
        if isinstance(target, ast.Name):
            single += bool(re.fullmatch(r"_?[A-Z][A-Z0-9_]*", target.id)) and _arithmetic(value)
        elif isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            several += sum(_arithmetic(v) for v in value.elts)
    return single, several


def _fields(tree: ast.Module) -> int:
    """Fields of classes with numbers in their defaults."""
    fields = [n for c in ast.walk(tree) if isinstance(c, ast.ClassDef) for n in c.body if isinstance(n, ast.AnnAssign)]
    return sum(1 for n in fields if n.value is not None and _numbers(n.value))


def defaults(tree: ast.Module) -> int:
    """Float defaults of parameters."""
    made = [n.args for n in ast.walk(tree) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)]
    return sum(_is_float(d) for a in made for d in (*a.defaults, *a.kw_defaults))


def literals(tree: ast.Module) -> int:
    """Floats inside functions that are no simple fractions."""
    inside: set[ast.AST] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            for statement in node.body:
                inside.update(ast.walk(statement))
    return sum(1 for n in inside if isinstance(n, ast.Constant) and type(n.value) is float and n.value not in SIMPLE)


def numbers_of(source: Path) -> None:
    """Print the numbers that tune by kind and room."""
    total: Counter[str] = Counter()
    by_room: dict[str, Counter[str]] = defaultdict(Counter)
    for module, path in files(source).items():
        if structure.package(module) in UNTUNED:
            continue
        tree, at = structure.tree(path), by_room[room(module)]
        single, several = constants(tree)
        kind = "policy" if path.name == "policy.py" else "fields"
        at.update({"constants": single, "several": several, "defaults": defaults(tree), "literals": literals(tree)})
        at[kind] += _fields(tree)
    for at in by_room.values():
        total.update(at)
    kinds = ("constants", "policy", "defaults", "literals")
    print(f"numbers that tune: {' + '.join(f'{total[k]} {k}' for k in kinds)} = {sum(total[k] for k in kinds)}")
    print(f"beside these: {total['several']} constants bound several at once, {total['fields']} fields of dataclasses")
    for name, at in sorted(by_room.items(), key=lambda item: -sum(item[1][k] for k in kinds)):
        if sum(at[k] for k in kinds):
            print(f"    {name:12} " + "  ".join(f"{at[k]:4} {k}" for k in kinds))


# ---------------------------------------------------------------------------------------------------------- types, lines
def _named(node: ast.AST | None, name: str) -> bool:
    return node is not None and any(isinstance(n, ast.Name) and n.id == name for n in ast.walk(node))


def signatures(tree: ast.Module) -> int:
    """Functions with `Any` in their signature."""
    count = 0
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            a = node.args
            parts = [x.annotation for x in (*a.posonlyargs, *a.args, *a.kwonlyargs, a.vararg, a.kwarg) if x is not None]
            count += any(_named(p, "Any") for p in (*parts, node.returns))
    return count


def lines_of(path: Path) -> tuple[int, int, int]:
    """Lines, those with nothing but a comment, those of code."""
    text = path.read_text(encoding="utf-8")
    comments: set[int] = set()
    code: set[int] = set()
    lines = text.splitlines()
    skip = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)
    docs: set[int] = set()
    for node in ast.walk(structure.tree(path)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            docs.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            if lines[token.start[0] - 1].strip().startswith("#"):
                comments.add(token.start[0])
        elif token.type not in skip:
            code.update(range(token.start[0], token.end[0] + 1))
    return len(lines), len(comments), len(code - docs)


def types_and_lines(source: Path) -> None:
    """Print `Any`, aliases, comments and lines by room."""
    count: dict[str, Counter[str]] = defaultdict(Counter)
    names: Counter[str] = Counter()
    for module, path in files(source).items():
        tree, at = structure.tree(path), count[room(module)]
        used = [n.lineno for n in ast.walk(tree) if isinstance(n, ast.Name) and n.id == "Any"]
        lines, comments, code = lines_of(path)
        at.update(files=1, code=code, all=lines, comments=comments, any=len(set(used)), signatures=signatures(tree))
        names.update(re.findall(r"^([A-Z]\w*) = NDArray\[", path.read_text(encoding="utf-8"), re.MULTILINE))
    total: Counter[str] = Counter()
    for at in count.values():
        total.update(at)
    print(f"lines with Any: {total['any']}, functions with Any in their signature: {total['signatures']}")
    print(f"aliases of arrays: {sum(names.values())}, of {len(names)} names; of Array {names['Array']}")
    print(f"comments: {100 * total['comments'] / total['all']:.1f} % of {total['all']} lines")
    print(f"lines of code: {total['code']} in {total['files']} files")
    print(f"    {'room':12} files   code  comments  Any lines  Any in signatures")
    for name, at in sorted(count.items(), key=lambda item: -item[1]["code"]):
        print(f"    {name:12} {at['files']:5} {at['code']:6} {at['comments']:9} {at['any']:10} {at['signatures']:18}")


def newton_state(source: Path) -> None:
    """Print the fields of the Newton state."""
    for path in files(source).values():
        classes = {node.name: node for node in ast.walk(structure.tree(path)) if isinstance(node, ast.ClassDef)}
        if "NewtonState" in classes:
            own = _annotated(classes["NewtonState"])
            held = [classes[name] for line in own for name in classes if name in re.findall(r"\w+", ast.unparse(line.annotation))]
            whole = len(own) - len(held) + sum(len(_annotated(c)) for c in held)
            print(f"fields of the Newton state: {len(own)}, {whole} with those of the objects that it holds")


def _annotated(node: ast.ClassDef) -> list[ast.AnnAssign]:
    return [n for n in node.body if isinstance(n, ast.AnnAssign)]


# ---------------------------------------------------------------------------------------------------------------- trace
class Trace:
    """Calls between functions of the source while an increment is computed."""

    def __init__(self, source: Path) -> None:
        self.prefix = str(source)
        self.calls = self.moves = 0
        self.functions: dict[tuple[str, str, int], int] = {}
        self.between: Counter[tuple[str, str]] = Counter()
        self.pairs: Counter[str] = Counter()

    def __call__(self, frame: object, event: str, _: object) -> None:
        """See `sys.setprofile`."""
        code = frame.f_code  # type: ignore[attr-defined]
        if event != "call" or not code.co_filename.startswith(self.prefix):
            return
        self.calls += 1
        self.functions[code.co_filename, code.co_name, code.co_firstlineno] = len({n for *_, n in code.co_lines() if n})
        caller = frame.f_back  # type: ignore[attr-defined]
        while caller is not None and not caller.f_code.co_filename.startswith(self.prefix):
            caller = caller.f_back
        if caller is not None and caller.f_code.co_filename != code.co_filename:
            self.moves += 2  # there and back
            self.between[caller.f_code.co_filename, code.co_filename] += 1
            ends = (caller.f_code, code)
            self.pairs["{} → {}".format(*(f"{c.co_filename[len(self.prefix) + 1 :]}:{c.co_qualname}" for c in ends))] += 1


def easiest(predictor: bool) -> Iterator[object]:
    """Increments of a block that a plane presses: no friction, one iteration each without the ``predictor``."""
    import prensa as pr

    problem = pr.Problem(
        "easiest increment",
        bodies={"block": pr.Body(pr.Rectangle(size=(2, 1), n=(2, 1)), pr.Elastic(E=1000.0, nu=0.3))},
        tools={"plane": pr.Plane(touching="block.top")},
        contacts=[pr.Contact("block.top", "plane")],
        fixed={"block.bottom": "y", "block.left": "x"},
        steps=[pr.Step("press", move={"plane": {"y": -1e-4}}, increments=3)],
        kinematics="small",
    )
    return pr.solve(problem, pr.Numerics(condense=False, threads=1, predictor=predictor))


def trace(source: Path, most: int = 0) -> None:
    """Print what the last of three easy increments runs through: files, or the ``most`` frequent calls between them."""
    if "prensa" not in sys.modules:
        sys.path.insert(0, str(source.parent))
    import prensa

    assert Path(prensa.__file__).parent == source, f"another prensa is imported: {prensa.__file__}"
    for predictor in (True, False):
        _trace(source, predictor, most)


def _trace(source: Path, predictor: bool, most: int) -> None:
    list(easiest(predictor))  # imports and compilation
    run, watch = easiest(predictor), Trace(source)
    next(run), next(run)
    sys.setprofile(watch)
    increment = next(run)
    sys.setprofile(None)
    own = {name for name, *_ in watch.functions}
    print(
        f"easiest increment, predictor {'on' if predictor else 'off'} "
        f"({increment.statistics.iterations} iteration): {watch.calls} calls, "  # type: ignore[attr-defined]
        f"{len(watch.functions)} functions in {len(own)} files, {sum(watch.functions.values())} lines, "
        f"{watch.moves} moves between files"
    )
    for pair, times in watch.pairs.most_common(most):
        print(f"    {times:4} {pair}")
    for name in sorted(own) if not most else ():
        functions = sum(1 for f, *_ in watch.functions if f == name)
        into = sum(n for (_, b), n in watch.between.items() if b == name)
        print(f"    {Path(name).relative_to(source)}: {functions} functions, {into} moves into it")


def main() -> None:
    """Print everything."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", nargs="?", type=Path, default=ROOT / "src" / "prensa")
    parser.add_argument("--no-trace", action="store_true")
    parser.add_argument("--moves", type=int, default=0, metavar="N", help="print the N most frequent calls between files alone")
    given = parser.parse_args()
    source = given.source.resolve()
    if given.moves:
        trace(source, given.moves)
        return
    graph_of(source)
    numbers_of(source)
    types_and_lines(source)
    newton_state(source)
    if not given.no_trace:
        trace(source)


if __name__ == "__main__":
    main()
