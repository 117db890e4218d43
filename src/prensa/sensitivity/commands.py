"""Derivatives on the command line: measures by parameters, backwards from their end, or forwards all along a run."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from prensa.errors import ArgumentError
from prensa.measures import Measure, parse
from prensa.model.problem import Case
from prensa.result.increment import Increment
from prensa.sensitivity.adjoint import OnlyForwards, gradient, number_of
from prensa.sensitivity.parameters import value_of
from prensa.sensitivity.solve import solve


@dataclass(frozen=True)
class Moment:
    """Measures of an increment: ``values`` by measure, ``slopes`` by measure and parameter, per unit of each."""

    step: str
    time: float
    values: Mapping[str, float]
    slopes: Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Gradients:
    """Moments of a run in order, the last one that which was asked for.

    ``parameters``: their values by path; ``units`` by measure; ``backwards``: whether it was found backwards.
    """

    parameters: Mapping[str, float]
    units: Mapping[str, str]
    moments: Sequence[Moment]
    backwards: bool

    def __str__(self) -> str:
        last = self.moments[-1]
        wide = max(len(path) for path in self.parameters) + 2
        lines = []
        for name, value in last.values.items():
            unit = f" {self.units[name]}" if self.units[name] else ""
            lines.append(f"{name} = {value:.6g}{unit} at the end of step {last.step!r}; 1 % more of a parameter changes it by")
            for path, at in self.parameters.items():
                slope = last.slopes[name][path]
                change = f"{0.01 * at * slope:+.4g}{unit}" if at else "nothing, as it is 0"
                lines.append(f"  {path:{wide}s}{change:>16s}   (slope {slope:.6g} at {at:.6g})")
        return "\n".join(lines)

    @property
    def summary(self) -> dict[str, Any]:
        """The last moment as data."""
        last = self.moments[-1]
        measures = {
            name: {"value": value, "unit": self.units[name], "slopes": dict(last.slopes[name])}
            for name, value in last.values.items()
        }
        way = "backwards" if self.backwards else "forwards"
        return {"step": last.step, "time": last.time, "parameters": dict(self.parameters), "measures": measures, "followed": way}

    def write(self, path: Path) -> None:
        """Write a table (CSV) of all moments: a column a measure, behind it one a parameter, ``d(measure)/d(parameter)``."""
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(path, "w", encoding="utf-8", newline="") as file:
            out = csv.writer(file)
            heads = [[name, *(f"d({name})/d({p})" for p in self.parameters)] for name in self.units]
            out.writerow(["step", "time", *(head for some in heads for head in some)])
            for m in self.moments:
                cells = [[m.values[name], *(m.slopes[name][p] for p in self.parameters)] for name in self.units]
                out.writerow([m.step, f"{m.time:.17g}", *(f"{cell:.17g}" for some in cells for cell in some)])


def asked(
    case: Case, of: Sequence[str], by: Sequence[str], step: str | None, every: bool, report: Callable[[str], None]
) -> Gradients:
    """Derivatives of measures ``of`` a case ``by`` parameters at the end of a step, or in ``every`` increment up to there.

    Only the end: backwards (`gradient`), or forwards where something cannot be followed backwards, and then ``report`` says why.

    Raises
    ------
    PrensaError
        As `gradient` and `solve` with derivatives, and for what is listed twice.

    """
    for name, listed in (("--of", of), ("--by", by)):
        twice = next((text for k, text in enumerate(listed) if text in listed[:k]), None)
        if twice is not None:
            raise ArgumentError(f"gradient: {name} {twice} is given twice")
    measures = [parse(name, case.problem) for name in of]
    parameters = {path: value_of(case.problem, path) for path in by}
    units = {name: m.unit for name, m in zip(of, measures)}
    if not every:
        try:
            found = gradient(case.problem, list(of), list(by), case.numerics, step)
        except OnlyForwards as reason:
            report(f"{str(reason).rpartition(';')[0]}: computed forwards instead, at a cost for each parameter")
        else:
            slopes = {name: dict(zip(by, row)) for name, row in zip(of, found.slopes.tolist())}
            values = dict(zip(of, found.values.tolist()))
            return Gradients(parameters, units, [Moment(found.increment.step, found.increment.time, values, slopes)], True)
    moments = _forwards(case, dict(zip(of, measures)), by, step, every)
    return Gradients(parameters, units, moments, False)


def _forwards(case: Case, measures: Mapping[str, Measure], by: Sequence[str], step: str | None, every: bool) -> list[Moment]:
    """Moments of all increments up to the end of a step, or the last one alone."""
    last, moments = case.problem.steps[number_of(case.problem, step)].name, []
    for increment in solve(case.problem, case.numerics, derivatives=by):
        end = increment.end_of_step and increment.step == last
        if every or end:
            moments.append(_moment(increment, measures))
        if end:
            break
    return moments


def _moment(increment: Increment, measures: Mapping[str, Measure]) -> Moment:
    values = {name: float(m.value(increment)) for name, m in measures.items()}
    return Moment(increment.step, increment.time, values, {name: increment.derivative(m) for name, m in measures.items()})
