# ruff: noqa: E501 (tables of odd values)
"""Broken calls: changes on the command line and arguments of Python that nobody would write on purpose.

Beside `prensa_bench.fuzz`, which breaks files: the same bounds, the same rule: an answer or a `PrensaError` in words.
"""

from __future__ import annotations

import dataclasses
import datetime
import decimal
import functools
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import prensa
from prensa.errors import PrensaError

Attempt = tuple[str, Callable[[], str]]
"""What was tried, in words that bring it back, and how to try it: 'read', or a `PrensaError`."""

ODD_PATHS = (
    "", "=", ".", "..", "0", "-1", "x", "tools", "steps", "0.0", "tools.", ".tools", "steps.0", "steps.-1", "steps.9999999999999",
    "steps.1e3", "contacts.²", "bodies.a.mesh", "bodies.a.mesh.points.0.0", "ö", "\u202e", "\U0001f528", "a" * 5000, "a." * 400,
    "tools.press.fillet", "numerics", "output", "numerics.solver", "fixed.a.bottom", "fixed.a.bottom.x", "units.length", "name",
    "steps.one.increments", "steps.0.move.press.y", "loads.a.end.pressure.1.1", "body_force.a.0", "contacts.0.surface.0",
    "contacts.0.friction.mu.mu0", "start.run", "ties.0.slave", "friction", "bodies.b.mesh.n", "bodies.b.mesh.size",
)  # fmt: skip
ODD_VALUES = (
    "", "1", "-1", "0", "1e400", "-1e400", "1e308", "5e-324", ".nan", ".inf", "true", "null", "~", "[", "]", "{", "}", "[]", "{}",
    "[[0, 0], [1, 1]]", "[1, [2, [3, [4]]]]", "[" * 200, "{a: " * 60, "*a", "&a [*a]", "&a 1", "2026-11-22", "0o17", "0x1F", "010", "1_000",
    "1:30", "!!python/object:os.system x", "!!binary aGk=", "<<: 1", "? x", "- 1", "a: 1", "a: {a: 1, a: 2}", "'", '"', "\u0000", "\ufeff",
    "\udcff", "ö" * 3000, "1" * 5000, "8 cm", "10 GPa", "-3 parsec", "1e400 mm", "mm", "1000000000", "[1000000000, 1000000000]", "[100000, 3]",
    "[-4, 3]", "[0, 0]", "[4.5, 3]", "/dev/zero", "/", ".", "x.csv", "x:Y", "os:path", "{type: x}", "{type: stamp}", "{type: [1]}",
    "{type: os:path}", "a.top", "a.", ".top", "held", "free", "xy", "gauss2", "[0, 1, 0]", "y\n", "#", "%", "@x", "`x", "|\n x", "--- 1\n--- 2",
)  # fmt: skip


def overrides(count: int, seed: int, folder: Path) -> Iterator[Attempt]:
    """One to three changes of good cases, most of them wrong."""
    from prensa.model import text as yaml
    from prensa_bench.fuzz import corpus, read

    rng = np.random.default_rng(seed)
    texts = corpus()
    paths = [[*ODD_PATHS, *paths_of(yaml.read(text, "<fuzz>")[0].plain())] for text in texts]
    for _ in range(count):
        k = int(rng.integers(len(texts))) if rng.random() < 0.3 else 0
        changes = [_change(rng, paths[k]) for _ in range(int(rng.choice([1, 1, 1, 2, 3])))]
        yield f"case {k}: --set {changes!r}", functools.partial(read, texts[k], folder, changes)


def paths_of(tree: Any, before: str = "") -> Iterator[str]:
    """Paths of all values of a case and of what they are in, as `--set` writes them."""
    entries = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, below in entries:
        yield f"{before}{key}"
        yield from paths_of(below, f"{before}{key}.")


def _change(rng: np.random.Generator, paths: list[str]) -> str:
    path = paths[rng.integers(len(paths))]
    if rng.random() < 0.5 and path:
        i = int(rng.integers(len(path)))
        letter = chr((int(rng.integers(33, 127)), int(rng.integers(1, 0x2FF)), ord("."))[rng.integers(3)])
        path = path[:i] + str(rng.choice(["", letter, letter + path[i]])) + path[i + 1 :]
    equals = "=" if rng.random() < 0.95 else str(rng.choice(["", "==", ":", " = "]))
    return f"{path}{equals}{ODD_VALUES[rng.integers(len(ODD_VALUES))]}"


# ---------------------------------------------------------------------------------------------------------------- calls
class _Odd:
    """An object that says nothing of itself, not even in words."""

    def __repr__(self) -> str:
        raise RuntimeError("no words")


def _hostile() -> tuple[Any, ...]:
    ring: list[Any] = []
    ring.append(ring)
    loop: dict[str, Any] = {}
    loop["x"] = loop
    wide: Any = [0.0]
    for _ in range(40):
        wide = [wide, wide]
    return (
        None, True, False, 0, -1, 1, 3, 10**400, -(10**400), 10**5000, 2**63, 10**9, 0.5, -0.5, float("nan"), float("inf"), -float("inf"), 1e308,
        5e-324, 1j, "", "x", "ö" * 5000, "\udcff", "\x00", "8 cm", "held", "xy", b"", b"x", [], (), {}, [[]], [1], (1, 2), [[0, 0], [1, 1]],
        [[1, 0], [0, 1]], (1, [2, [3]]), {"x": 1}, {1: 2}, {None: None}, {"type": "x"}, {"type": 1}, {"type": ["x"]}, {"type": "os:path"},
        {"type": "coulomb", "mu": -1}, set(), {1}, frozenset(), range(3), iter([1]), object, object(), int, dict, len, lambda: 1, ..., NotImplemented,
        _Odd(), np.float64(1), np.int64(-3), np.nan, np.array(1.0), np.ones(2), np.ones((2, 2)), np.array(["x"]), np.array([object()]),
        decimal.Decimal("1e999"), datetime.date(2026, 11, 22), Path("x"), ring, loop, wide, [0.0] * 10_000, "a" * 100_000, (10**9, 10**9), (10**9, 1),
        prensa.Circle, prensa.Circle(radius=1), prensa.Elastic(E=1, nu=0), prensa.Coulomb(0.1), prensa.Step("s"), prensa.Motion(y=1),
    )  # fmt: skip


def calls(count: int, seed: int, folder: Path) -> Iterator[Attempt]:
    """Good descriptions made again with some arguments wrong, and public functions with wrong ones."""
    rng = np.random.default_rng(seed)
    good, bad, functions = list(_descriptions()), _hostile(), _functions(folder)
    for _ in range(count):
        if rng.random() < 0.15:
            name, function = functions[rng.integers(len(functions))]
            some = [int(rng.integers(len(bad))) for _ in range(int(rng.choice([1, 1, 2])))]
            yield f"{name}, hostile values {some}", functools.partial(answer, function, [bad[k] for k in some], {})
            continue
        cls, named = good[rng.integers(len(good))]
        named = dict(named)
        positional: list[Any] = []
        wrong_with: list[str] = []
        for _ in range(int(rng.choice([1, 1, 2, 3]))):
            k, names = int(rng.integers(len(bad))), list(named)
            key = str(rng.choice(names)) if names else "x"
            match rng.integers(7):
                case 0:
                    named.pop(key, None)
                    wrong_with.append(f"without {key}")
                case 1:
                    named[key[:-1] + "x"] = named.pop(key, None)
                    wrong_with.append(f"{key} misspelt")
                case 2:
                    positional.append(bad[k])
                    wrong_with.append(f"hostile {k} in place")
                case 3 if isinstance(named.get(key), list | tuple) and len(named[key]):
                    items = list(named[key])
                    items[rng.integers(len(items))] = bad[k]
                    named[key] = items
                    wrong_with.append(f"{key}: an item hostile {k}")
                case 4 if isinstance(named.get(key), dict):
                    named[key] = {**named[key], str(rng.choice(["x", "a.top", ""])): bad[k]}
                    wrong_with.append(f"{key}: an entry hostile {k}")
                case _:
                    named[key] = bad[k]
                    wrong_with.append(f"{key} hostile {k}")
        yield f"{cls.__name__}: {', '.join(wrong_with)}", functools.partial(answer, cls, positional, named)


def answer(function: Callable[..., Any], positional: Sequence[Any] = (), named: Mapping[str, Any] | None = None) -> str:
    """'read' for a call that ends well and 'refused' for one that says why not in words; raises what is a defect."""
    named = named or {}
    try:
        function(*positional, **named)
    except PrensaError as error:
        if not str(error).strip() or "pydantic" in str(error):
            raise AssertionError("an error without words of its own") from error
        return "refused"
    return "read"


def _descriptions() -> Iterator[tuple[type, dict[str, Any]]]:
    """Classes and good arguments: everything inside the cases of the corpus, and the examples of the laws."""
    from prensa.model.schema import loads
    from prensa.registry import DOORS, examples
    from prensa_bench.fuzz import corpus

    cases = [loads(text) for text in corpus()[:6]]
    laws = itertools.chain.from_iterable(examples(kind).values() for kind, door in DOORS.items() if not door.named)
    for thing in itertools.chain(*(_inside(case) for case in cases), laws):
        yield type(thing), {f.name: getattr(thing, f.name) for f in dataclasses.fields(thing) if f.init}


def _inside(value: Any) -> Iterator[Any]:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        yield value
        for f in dataclasses.fields(value):
            yield from _inside(getattr(value, f.name))
    elif isinstance(value, dict | tuple | list):
        for below in value.values() if isinstance(value, dict) else value:
            yield from _inside(below)


def _functions(folder: Path) -> list[tuple[str, Callable[..., Any]]]:
    """Public functions, everything but one or two arguments given as they should be."""
    from prensa.analysis import solve
    from prensa.model.schema import dump, load, loads
    from prensa.output import history, vtk
    from prensa.output.report import read_summary
    from prensa.output.run import resume, run
    from prensa.solver.time_stepping import at_rest
    from prensa.system.discretise import discretise

    problem = prensa.Problem(
        "one",
        {"b": prensa.Body(prensa.Rectangle((1, 1), (1, 1)), prensa.Elastic(1, 0))},
        (prensa.Step("s"),),
        fixed={"b.bottom": "xy"},
    )
    increment = at_rest(discretise(problem))
    assert increment is not None

    def of(function: Callable[..., Any], *good: Any) -> Callable[..., Any]:
        return lambda first, *more: function(*good, first, *more[: 1 if good else 0])

    return [
        ("solve", of(solve)), ("solve numerics", lambda v, *_: solve(problem, numerics=v)),
        ("solve start", lambda v, *_: solve(problem, start=v)), ("solve policy", lambda v, *_: solve(problem, policy=v)),
        ("solve monitor", lambda v, *_: solve(problem, monitor=v)), ("solve timer", lambda v, *_: solve(problem, timer=v)),
        ("discretise", of(discretise)), ("discretise extensions", lambda v, *_: discretise(problem, v)),
        ("load", of(load)), ("loads", of(loads)), ("dump", of(dump)),
        ("loads overrides", lambda v, *_: loads("name: x", overrides=v)), ("measure", lambda v, *_: increment.measure(v)),
        ("force", lambda v, *_: increment.force(v)), ("derivative", lambda v, *_: increment.derivative(v)),
        ("solve derivatives", lambda v, *_: next(iter(prensa.solve(problem, derivatives=v)))),
        ("gradient", lambda v, *_: prensa.gradient(v, "b.width", ["bodies.b.material.E"])),
        ("gradient of", lambda v, *_: prensa.gradient(problem, v, ["bodies.b.material.E"])),
        ("gradient by", lambda v, *_: prensa.gradient(problem, "b.width", v)),
        ("gradient step", lambda v, *_: prensa.gradient(problem, "b.width", ["bodies.b.material.E"], step=v)),
        ("particles", lambda v, *_: prensa.particles(v, v, v)), ("results", of(prensa.results)),
        ("sweep", lambda v, w=None, *_: prensa.sweep(problem, {"bodies.b.material.E": v}, w, jobs=1, out=folder / "sweep")),
        ("converge", lambda v, w=None, *_: prensa.converge(problem, w, mesh=v, jobs=1, out=folder / "converge")),
        ("identify", of(prensa.identify)), ("calibrate", of(prensa.calibrate)), ("evaluate", of(prensa.evaluate)),
        ("run", lambda v, *_: run(v, folder / "none", quiet=True)), ("resume", of(resume)), ("read_history", of(history.read_history)),
        ("run out", lambda v, *_: run(prensa.Case(problem), v, quiet=True) if v is not None and not isinstance(v, str | Path) else None),
        ("read_summary", of(read_summary)), ("read_contact", of(history.read_contact)), ("read_collection", of(vtk.read_collection)),
    ]  # fmt: skip
