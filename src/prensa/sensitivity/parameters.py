"""Parameters by their path in a case, as ``--set`` writes it: their value, and the same problem with another one."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

from prensa.errors import ArgumentError, PrensaError, take
from prensa.model.metals import Metal
from prensa.model.names import suggest
from prensa.model.problem import Problem
from prensa.system.discretise import discretise, with_laws, with_tool
from prensa.system.system import System


def numbers(problem: Problem) -> dict[str, float]:
    """Every number of a description that may be varied, by its path; whole numbers, flags and texts are not among them."""
    return dict(_leaves("", problem))


def part_of(problem: Problem, path: str) -> Any:
    """What stands at a path of a description; None if nothing."""
    found: Any = problem
    while path:
        some = [
            (len(key), part, rest) for keys, part in _below(found) for key in keys if (rest := _inside(key, path)) is not None
        ]
        # A key may hold dots itself, as names of boundaries do: the longest that fits is the one that is meant.
        _, found, path = max(some, key=lambda one: one[0], default=(0, None, ""))
    return found


def _below(value: Any) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Parts of a part of a description, by their keys: an entry of a list has its number and its name, if it has one."""
    if isinstance(value, Metal):  # where numbers come from is none of them
        return
    if is_dataclass(value):
        yield from (((f.name,), getattr(value, f.name)) for f in fields(value))
    elif isinstance(value, Mapping):
        yield from (((key,), part) for key, part in value.items())
    elif isinstance(value, list | tuple):
        for k, part in enumerate(value):
            name = getattr(part, "name", None)
            yield ((str(k), name) if isinstance(name, str) and name else (str(k),)), part


def _leaves(path: str, value: Any) -> Iterator[tuple[str, float]]:
    if isinstance(value, float):
        yield path, value
        return
    for (key, *_), part in _below(value):
        yield from _leaves(f"{path}.{key}" if path else key, part)


def value_of(problem: Problem, path: str) -> float:
    """The number at a path such as ``bodies.ring.material.flow.K`` or ``steps.0.move.die.y``.

    Raises
    ------
    ArgumentError
        If there is no number, with the nearest paths that lead to one.

    """
    take("derivatives", "a parameter", path, str, "give its path in the case, for example 'friction.mu'")
    found = part_of(problem, path)
    if isinstance(found, float):
        return found
    known = numbers(problem)
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
        raise ArgumentError(f"derivatives: {path!r} is not a number but has some: {few}")
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
    return _with(problem, values)


def _with(problem: Problem, values: Mapping[str, float]) -> Problem:
    """As `with_values`, of paths that are known to lead to numbers."""
    out = _replaced(problem, {path: float(value) for path, value in values.items()})
    assert isinstance(out, Problem)
    return out.with_mirrored(problem.mirrored)


def _replaced(part: Any, changes: Mapping[str, float]) -> Any:
    """A part of a description with other numbers at paths that begin there; all are put in at once, then it is checked."""
    if "" in changes:
        return changes[""]
    below: dict[str, Any] = {}
    for keys, value in _below(part):
        inside = {
            rest: number for path, number in changes.items() for key in keys if (rest := _inside(key, path)) is not None
        }
        if inside:
            below[keys[0]] = _replaced(value, inside)
    if isinstance(metal := getattr(part, "of", None), Metal):
        below["of"] = metal.altered(changes)
    if is_dataclass(part):
        return replace(part, **below)  # type: ignore[type-var]
    if isinstance(part, Mapping):
        return {**part, **below}
    return type(part)(below.get(str(k), v) for k, v in enumerate(part))


def _inside(key: str, path: str) -> str | None:
    """What is left of a path within the part of a key, which may be a boundary's name with a dot; None if it is not there."""
    if path == key:
        return ""
    return path.removeprefix(f"{key}.") if path.startswith(f"{key}.") else None


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
        both = self._both(lambda value: _with_values(system, {self.path: value}), step)
        for other in both:
            refuse_other_mesh(system, other, self.path)
        return both

    def tools_beside(self, system: System, step: float) -> tuple[System, System]:
        """As `neighbours` for a number of the shape or place of a tool, which changes nothing else of the system.

        The description of the system stays the one that it is.
        """
        _, name, rest = self.path.split(".", 2)
        tool = system.problem.tools[name]
        return self._both(lambda value: with_tool(system, name, _replaced(tool, {rest: value})), step)

    def _both(self, make: Callable[[float], System], step: float) -> tuple[System, System]:
        try:
            above, below = make(self.value + step), make(self.value - step)
        except PrensaError as error:
            raise ArgumentError(
                f"derivatives: {self.path} = {self.value:g} cannot be varied both ways ({str(error).splitlines()[0]})"
            ) from None
        return above, below


def neighbours(system: System, parameters: Sequence[Parameter], steps: Sequence[float]) -> tuple[System, System]:
    """The systems of the values of some parameters plus and minus a step each.

    Raises
    ------
    PrensaError
        If they cannot be varied both ways.

    """
    above, below = (
        _with_values(system, {p.path: p.value + sign * step for p, step in zip(parameters, steps)}) for sign in (1.0, -1.0)
    )
    return above, below


def _with_values(system: System, values: Mapping[str, float]) -> System:
    """The system of other numbers at some paths."""
    problem = _with(system.problem, values)
    if all(map(LEAVES_MESHES.match, values)):
        return with_laws(system, problem)
    return discretise(problem, beside=system)


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
