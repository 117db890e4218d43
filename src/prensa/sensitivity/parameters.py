"""Parameters by their path in a case, as ``--set`` writes it: their value, and the same problem with another one."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import partial
from typing import Any

from prensa.errors import ArgumentError, PrensaError, take
from prensa.fem.discretise import discretise, with_laws, with_tool
from prensa.fem.system import System
from prensa.model.checks import suggest
from prensa.model.problem import Problem


def numbers(problem: Problem) -> dict[str, float]:
    """Every number of a description that may be varied, by its path; whole numbers, flags and texts are not among them."""
    return dict(_leaves("", problem))


def _leaves(path: str, value: Any) -> Iterator[tuple[str, float]]:
    if isinstance(value, float):
        yield path, value
        return
    below: Iterable[tuple[Any, Any]] = ()
    if is_dataclass(value):
        below = ((f.name, getattr(value, f.name)) for f in fields(value))
    elif isinstance(value, Mapping):
        below = value.items()
    elif isinstance(value, list | tuple):
        below = enumerate(value)
    for key, part in below:
        yield from _leaves(f"{path}.{key}" if path else str(key), part)


def value_of(problem: Problem, path: str) -> float:
    """The number at a path such as ``bodies.ring.material.flow.K`` or ``steps.0.move.die.y``.

    Raises
    ------
    ArgumentError
        If there is no number, with the nearest paths that lead to one.

    """
    take("derivatives", "a parameter", path, str, "give its path in the case, for example 'friction.mu'")
    known = numbers(problem)
    if path in known:
        return known[path]
    parts = path.split(".")
    if parts[:1] == ["contacts"] and "friction" in parts[2:3]:
        common = ".".join(parts[2:])
        if common in known:
            raise ArgumentError(
                f"derivatives: contact {parts[1]} has no friction of its own, it has that of the case: {common!r}"
            )
    below = [k for k in known if k.startswith(f"{path}.")]
    if below:
        few = ", ".join(below[:4]) + (" …" if len(below) > 4 else "")
        raise ArgumentError(f"derivatives: {path!r} is no number but has some: {few}")
    raise ArgumentError(
        f"derivatives: no number at {path!r} in this case{suggest(path, known)}; whole numbers, such as counts of "
        "elements, cannot be varied"
    )


def with_values(problem: Problem, values: Mapping[str, float]) -> Problem:
    """The problem with other numbers at some paths, checked as any description is.

    Raises
    ------
    CaseError
        If a value is not allowed there.

    """
    for path in values:
        value_of(problem, path)
    out = _replaced(problem, [(path.split("."), float(value)) for path, value in values.items()])
    assert isinstance(out, Problem)
    return out


def _replaced(part: Any, changes: list[tuple[list[str], float]]) -> Any:
    """A part of a description with other numbers at paths that begin there; all are put in at once, then it is checked."""
    if not changes[0][0]:
        return changes[0][1]
    below: dict[str, list[tuple[list[str], float]]] = {}
    for (first, *rest), value in changes:
        below.setdefault(first, []).append((rest, value))
    if is_dataclass(part):
        return replace(part, **{k: _replaced(getattr(part, k), v) for k, v in below.items()})  # type: ignore[type-var]
    if isinstance(part, Mapping):
        return {k: _replaced(v, below[k]) if k in below else v for k, v in part.items()}
    return type(part)(_replaced(v, below[str(k)]) if str(k) in below else v for k, v in enumerate(part))


LEAVES_MESHES = re.compile(r"(bodies\.[^.]+\.material|friction|contacts\.\d+\.friction|steps)\.")
"""Beginnings of paths that leave meshes, tools and contact candidates where they are."""


@dataclass(frozen=True)
class Parameter:
    """A number of a problem: its ``path``, its ``value``, and a ``size`` against which changes are small."""

    path: str
    value: float
    size: float

    @classmethod
    def of(cls, problem: Problem, path: str, length: float) -> Parameter:
        """The parameter at a path; the ``length`` of the bodies is the size of one that is zero."""
        value = value_of(problem, path)
        return cls(path, value, abs(value) or length)

    def neighbours(self, system: System, step: float) -> tuple[System, System]:
        """The systems of the parameter's value plus and minus a ``step``.

        Raises
        ------
        ArgumentError
            If the parameter cannot be varied both ways, or the mesh has other elements then.

        """
        make = partial(with_laws, system) if LEAVES_MESHES.match(self.path) else discretise
        return self._both(lambda value: make(with_values(system.problem, {self.path: value})), step)

    def tools_beside(self, system: System, step: float) -> tuple[System, System]:
        """As `neighbours` for a number of the shape or place of a tool, which changes nothing else of the system.

        The description of the system stays the one that it is.
        """
        _, name, *rest = self.path.split(".")
        tool = system.problem.tools[name]
        return self._both(lambda value: with_tool(system, name, _replaced(tool, [(rest, value)])), step)

    def _both(self, make: Callable[[float], System], step: float) -> tuple[System, System]:
        try:
            above, below = make(self.value + step), make(self.value - step)
        except PrensaError as error:
            raise ArgumentError(
                f"derivatives: {self.path} = {self.value:g} cannot be varied both ways ({str(error).splitlines()[0]})"
            ) from None
        return above, below


def refuse_other_mesh(system: System, other: System, path: str) -> None:
    """A derivative needs the nodes and contact points of all values to be the same ones.

    Raises
    ------
    ArgumentError
        If they are not.

    """
    same = system.X.shape == other.X.shape and [len(s.points) for s in system.surfaces] == [
        len(s.points) for s in other.surfaces
    ]
    same = same and all((a.cells == b.cells).all() for a, b in zip(system.blocks, other.blocks) if len(a) == len(b))
    if not same:
        raise ArgumentError(
            f"derivatives: the mesh has other elements when {path} changes; give it counts of elements (n) instead of sizes"
        )
