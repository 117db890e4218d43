"""The cases of a convergence study: the mesh, the increments or the penalties of a case in several finenesses."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from prensa.errors import PrensaError, shown
from prensa.model import text as yaml
from prensa.model.meshes import pieces_around
from prensa.model.problem import Case, Problem
from prensa.model.remeshing import remeshing_of
from prensa.precision import NEGLIGIBLE
from prensa.study.plan import Plan, Point
from prensa.study.values import Values

Kind = Literal["mesh", "step", "penalty"]
REFINED: tuple[Kind, ...] = ("mesh", "step", "penalty")
DEFAULTS: dict[Kind, tuple[float, ...]] = {
    "mesh": (0.25, 0.5, 1, 2),  # nodes of a mesh are nodes of the next: contact edges move less from one to the other
    "step": (0.5, 1, 2, 4),
    "penalty": (0.1, 1, 10, 100),
}
_STIFFNESSES = ("beta", "beta_T", "k_n", "k_T")
_SIZES = {"far": -1, "near_tools": -1, "least": -1, "per_radius": 1, "per_strain": 1}
"""Of `prensa.Sizes`, with the power of the fineness that they go with."""


@dataclass(frozen=True)
class Level:
    """One fineness: ``factor`` times the case's, the ``size`` that goes to zero, relative to the case's, and the changes."""

    kind: Kind
    factor: float
    size: float
    changes: dict[str, str]


@dataclass(frozen=True)
class Levels(Plan):
    """The plan of a convergence study: its levels in place of all combinations; every other quantity is that of the case."""

    levels: tuple[Level, ...] = field(default=(), kw_only=True)

    @property
    def count(self) -> int:
        """Number of levels."""
        return len(self.levels)

    def points(self) -> Iterator[Point]:
        """The levels, in order."""
        first = {f.path: f.texts[0] for f in self.varied}
        for level in self.levels:
            yield Point(first | level.changes)


def plan_of(case: Case, asked: dict[Kind, Sequence[float]], increments: dict[str, int]) -> Levels:
    """The plan of studies of the kinds *asked* for with their factors; *increments*: of the steps that choose them themselves.

    Raises
    ------
    PrensaError
        If the case cannot be refined so.

    """
    levels: list[Level] = []
    for kind, factors in asked.items():
        _check(kind, factors)
        levels += _levels(kind, case.problem, sorted(float(f) for f in factors), increments)
    paths = dict.fromkeys(path for level in levels for path in level.changes)
    base = {path: _base(case.problem, path, increments) for path in paths}
    factors_of = tuple(
        Values(path, tuple(dict.fromkeys([base[path], *(v.changes[path] for v in levels if path in v.changes)])))
        for path in paths
    )
    return Levels(factors_of, levels=tuple(levels))


def numbers_of(kind: Kind, given: object) -> tuple[float, ...]:
    """Levels that are given in Python.

    Raises
    ------
    PrensaError
        If they are no numbers.

    """
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if not isinstance(given, Sequence) or not all(isinstance(f, int | float | np.number) for f in given):
        raise PrensaError(f"converge: {kind} is {shown(given)}; give factors of the case's own fineness, such as [0.5, 1, 2]")
    try:
        return tuple(map(float, given))
    except OverflowError:
        return (math.inf,)


def _check(kind: Kind, factors: Sequence[float]) -> None:
    if any(not (math.isfinite(f) and f > 0) for f in factors):
        raise PrensaError(
            f"--{kind}: the levels are factors of the case's own fineness, numbers above 0, as in 0.5,1,2"
        )
    if len(set(factors)) < 3:
        raise PrensaError(
            f"--{kind}: {len(set(factors))} levels; an observed order takes at least three, as in 0.5,1,2"
        )


def _levels(kind: Kind, problem: Problem, factors: list[float], increments: dict[str, int]) -> list[Level]:
    make = {"mesh": _mesh, "step": _step, "penalty": _penalty}[kind]
    found: list[Level] = []
    for factor in sorted(factors, key=lambda f: abs(math.log(f))):  # of factors that round to the same the nearest to 1
        changes, size = make(problem, factor, increments)
        if all(changes != other.changes for other in found):
            found.append(Level(kind, factor, size, changes))
    found.sort(key=lambda level: level.factor)
    if len(found) < 3:
        raise PrensaError(
            f"--{kind}: the levels give {len(found)} different cases; give larger factors, or a finer case"
        )
    return found


def _mesh(problem: Problem, factor: float, increments: dict[str, int]) -> tuple[dict[str, str], float]:
    """Numbers of elements, and the size of an element relative to the case's: of the same area, on the average."""
    changes, before, after = _remeshed(problem, factor), 0, 0
    for name, body in problem.bodies.items():
        if problem.space == "solid" and body.mesh.type != "bricks":
            more, was, now = _bricks(f"bodies.{name}.mesh", body.mesh, factor)
            changes, before, after = changes | more, before + was, after + now
            continue
        n: Any = getattr(body.mesh, "n", None)
        if n is None:
            kind = body.mesh.type
            raise PrensaError(
                f"--mesh: the mesh of body {name!r} is given ({kind}); vary bodies.{name}.mesh in a sweep"
            )
        new = _counts(body.mesh, factor)
        changes[f"bodies.{name}.mesh.n"] = yaml.line(new)
        before, after = before + n[0] * n[1], after + new[0] * new[1]
    # The size that rounding to whole elements left, not the one asked for: an order fitted over nominal sizes would be off.
    return changes, (before / after) ** (1 / 3 if problem.space == "solid" else 1 / 2)


def _counts(mesh: Any, factor: float) -> list[int]:
    """Numbers of elements along the axes of a mesh, times a factor."""
    # The core of a disc needs an even number of elements along its side.
    even = 2 if mesh.type == "disc" else 1
    return [max(even * round(mesh.n[0] * factor / even), even), *(max(round(n * factor), 1) for n in mesh.n[1:])]


def _bricks(path: str, mesh: Any, factor: float) -> tuple[dict[str, str], int, int]:
    """As `_mesh`, of a body in space: changes, how many bricks it has, and how many it gets."""
    if mesh.type == "cylinder":
        *section, around = mesh.n
        new = [*(max(round(n * factor), 1) for n in section), _around(around, mesh.angle, factor)]
        return {f"{path}.n": yaml.line(new)}, math.prod(mesh.n), math.prod(new)
    if mesh.type == "box":
        new = _counts(mesh, factor)
        return {f"{path}.n": yaml.line(new)}, math.prod(mesh.n), math.prod(new)
    if getattr(mesh.section, "n", None) is None:
        raise PrensaError(f"--mesh: the section of {path} is given ({mesh.section.type}); vary {path} in a sweep")
    new = _counts(mesh.section, factor)
    layers = _around(mesh.n, mesh.angle, factor) if mesh.type == "revolved" else max(round(mesh.n * factor), 1)
    changes = {f"{path}.section.n": yaml.line(new), f"{path}.n": yaml.line(layers)}
    return changes, math.prod(mesh.section.n) * mesh.n, math.prod(new) * layers


def _around(n: int, angle: float, factor: float) -> int:
    """Number of elements around an angle, times a factor: a square core at the axis stays one."""
    pair = 2 * pieces_around(angle)
    step = pair if pair and n % pair == 0 else 1
    return max(step * round(n * factor / step), step, math.ceil((1 + NEGLIGIBLE) * angle / math.pi))


def _remeshed(problem: Problem, factor: float) -> dict[str, str]:
    """The sizes of which new meshes are made, finer by a factor; none where none are made."""
    asked = remeshing_of(problem)
    if asked is None:
        return {}
    if asked.size.far is None:
        raise PrensaError(
            "--mesh: the bodies are remeshed to automatic sizes; give 'far', as in 'remesh: {size: {far: 1 mm}}'"
        )
    given = {key: getattr(asked.size, key) for key in _SIZES if getattr(asked.size, key) is not None}
    return {f"remesh.size.{key}": f"{factor**power * given[key]:.12g}" for key, power in _SIZES.items() if key in given}


def _step(problem: Problem, factor: float, increments: dict[str, int]) -> tuple[dict[str, str], float]:
    """Numbers of increments, and their size."""
    counts = [step.increments or increments[step.name] for step in problem.steps]
    new = [max(round(n * factor), 1) for n in counts]
    return {f"steps.{k}.increments": str(n) for k, n in enumerate(new)}, sum(counts) / sum(new)


def _penalty(problem: Problem, factor: float, increments: dict[str, int]) -> tuple[dict[str, str], float]:
    """Contacts with stiffer penalties, and their compliance."""
    if not problem.contacts or any(not hasattr(c.enforcement, "k_n") for c in problem.contacts):
        raise PrensaError(
            "--penalty: no penalty to refine: not every contact has 'enforcement: {type: penalty}' or augmented"
        )
    return {"contacts": _contacts(problem, factor)}, 1 / factor


def _contacts(problem: Problem, factor: float) -> str:
    from prensa.model.schema import brief

    stiffer = []
    # Contacts by default have no list in the file in which one could be changed: all are written out.
    for contact in problem.contacts:
        own = contact.enforcement
        values = {k: float(f"{factor * v:.12g}") for k in _STIFFNESSES if (v := getattr(own, k)) is not None}
        stiffer.append(replace(contact, enforcement=replace(own, **values)))
    return brief(stiffer)


def _base(problem: Problem, path: str, increments: dict[str, int]) -> str:
    """The case's own value of a path that a study changes."""
    if path == "contacts":
        return _contacts(problem, 1.0)
    parts = path.split(".")
    if parts[0] == "remesh":
        asked = remeshing_of(problem)
        assert asked is not None
        return f"{getattr(asked.size, parts[-1]):.12g}"
    if parts[0] == "steps":
        step = problem.steps[int(parts[1])]
        return str(step.increments) if step.increments else "null"
    mesh: Any = problem.bodies[path.removeprefix("bodies.").removesuffix(".mesh.n")].mesh
    return yaml.line(list(mesh.n))
