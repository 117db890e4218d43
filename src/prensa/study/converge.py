"""Convergence studies: a case on finer and finer meshes, increments or penalties; what its results tend to, and how fast."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from prensa.errors import PrensaError, per_cent, shown
from prensa.model.problem import Case, Problem
from prensa.output.history import read_history
from prensa.study.levels import DEFAULTS, REFINED, Kind, Level, Levels, numbers_of, plan_of
from prensa.study.order import Convergence, observed
from prensa.study.page import write_page
from prensa.study.pictures import convergence
from prensa.study.plan import Plan
from prensa.study.quantities import Quantity
from prensa.study.results import Row, Study
from prensa.study.sweep import Execution, Source
from prensa.study.values import Values

Where = tuple[int | None, str | None, str | Path | None, bool, bool]
"""Processes, memory, cluster, whether failed cases are computed again, whether the folder is taken."""


@dataclass(frozen=True)
class Finding:
    """What one study shows of one measure: sizes relative to the case's, results, and their `Convergence`."""

    kind: Kind
    quantity: Quantity
    levels: list[Level] = field(repr=False)
    rows: list[Row] = field(repr=False)
    convergence: Convergence

    def lines(self) -> Iterator[str]:
        """The study in words: a line a level, and what follows from them."""
        unit = f" {self.quantity.unit}" if self.quantity.unit else ""
        yield f"{self.kind}: {self.quantity.text}"
        before = math.nan
        for level, row in zip(self.levels, self.rows):
            value = row.value(self.quantity.text)
            if math.isnan(value):
                yield f"  {level.factor:>6g} ×  {row.status}: {row.reason or 'the measure has no value'}"
                continue
            change = "" if math.isnan(before) or value == 0 else f"   {100 * (value - before) / abs(value):+.3g} %"
            yield f"  {level.factor:>6g} ×  {value:.8g}{unit}{change}"
            before = value
        yield f"  {self.summary()}"

    def summary(self) -> str:
        """What the results show, in a sentence."""
        c = self.convergence
        unit = f" {self.quantity.unit}" if self.quantity.unit else ""
        share = f" ({per_cent(c.band / abs(c.limit))})" if c.limit and math.isfinite(c.band) else ""
        if c.has_order:
            error = "" if math.isnan(c.order_error) else f" ± {c.order_error:.2g}"
            found = f"order {c.order:.2f}{error}, extrapolated {c.limit:.8g}{unit}"
            return f"{found}; the finest is within {c.band:.2g}{unit} of it{share}"
        spread = (
            f"; between the levels it changes by {c.band:.2g}{unit}{share}" if math.isfinite(c.band) and c.band else ""
        )
        return f"no convergence order: {c.why}{spread}"


@dataclass(frozen=True)
class ConvergenceStudy:
    """The results of `converge`: the cases as a `Study`, and a `Finding` for each kind and measure."""

    study: Study
    findings: list[Finding]

    def __repr__(self) -> str:
        return "\n".join(line for f in self.findings for line in f.lines())

    def __getitem__(self, key: tuple[str, str]) -> Convergence:
        """What the study of a kind (mesh, step, penalty) shows of a measure."""
        known = {(f.kind, f.quantity.text): f.convergence for f in self.findings}
        if key not in known:
            raise PrensaError(f"no study of {shown(key)}; known: {', '.join(map(str, known))}")
        return known[key]


def converge(
    case: str | Path | Case | Problem,
    measures: str | Iterable[str],
    *,
    mesh: Sequence[float] | bool = False,
    step: Sequence[float] | bool = False,
    penalty: Sequence[float] | bool = False,
    changes: Mapping[str, Any] | None = None,
    out: str | Path | None = None,
    jobs: int | None = None,
    memory: str | None = None,
    cluster: str | Path | None = None,
    retry: bool = False,
    quiet: bool = False,
    force: bool = False,
) -> ConvergenceStudy:
    """Compute a case on finer and finer meshes, increments or penalties; observed order, extrapolated value, error band.

    Each of them is refined alone, with the rest as the case has it. What is there already is not computed again, as of `sweep`.

    Parameters
    ----------
    case, measures
        A case, and what to take from it, as of `sweep`.
    mesh
        Factors of the numbers of elements in each direction, or True for 1/4, 1/2, 1 and 2; of meshes that prensa makes.
    step
        Factors of the numbers of increments, or True for 1/2, 1, 2 and 4.
    penalty
        Factors of the stiffness of contact, or True for 0.1, 1, 10 and 100. Without any of the three the mesh is refined.
    changes
        Values by path that all cases have.
    out, jobs, memory, cluster, retry, quiet, force
        As of `sweep`; the folder is ``results/<name>-converge`` if None.

    Raises
    ------
    PrensaError
        If the case cannot be refined so, before anything is computed.

    """
    given: dict[Kind, Sequence[float] | bool] = {"mesh": mesh, "step": step, "penalty": penalty}
    asked: dict[Kind, Sequence[float]] = {
        kind: DEFAULTS[kind] if levels is True else numbers_of(kind, levels)
        for kind, levels in given.items()
        if levels is not False
    }
    source = Source(case, changes or {})
    out = Path(out or f"results/{source.stem}-converge")
    compute = partial(_executed, source, measures, out, quiet, (jobs, memory, cluster, retry, force))
    increments: dict[str, int] = {}
    # Steps that choose their increments have none to multiply: the case is run once, and its own number is refined.
    if "step" in asked and any(s.increments is None for s in source.base.problem.steps):
        # A plan varies something: what the case has already changes nothing.
        increments = _increments(compute(Plan((Values("kinematics", (source.base.problem.kinematics,)),))))
    plan = plan_of(source.base, asked or {"mesh": DEFAULTS["mesh"]}, increments)
    study = compute(plan)
    return ConvergenceStudy(study, findings(study, plan))


def _executed(source: Source, measures: str | Iterable[str], out: Path, quiet: bool, where: Where, plan: Plan) -> Study:
    def show(study: Study) -> None:
        if isinstance(plan, Levels):
            write_page(study, partial(_shown, findings(study, plan)))

    return Execution(source, plan, measures, out, False, quiet).execute(*where, show)


def _increments(study: Study) -> dict[str, int]:
    """How many increments the steps of the case take by themselves."""
    (row,) = study.rows
    if row.status != "completed":
        raise PrensaError(f"--step: the case itself does not complete: {row.reason}")
    steps = read_history(study.directory / row.folder)["step"].tolist()
    return {name: steps.count(name) for name in dict.fromkeys(steps)}


def findings(study: Study, plan: Levels) -> list[Finding]:
    """What every kind of refinement shows of every measure."""
    found = []
    for kind in REFINED:
        pairs = [(level, row) for level, row in zip(plan.levels, study.rows) if level.kind == kind]
        if not pairs:
            continue
        levels, rows = [p[0] for p in pairs], [p[1] for p in pairs]
        sizes = np.array([level.size for level in levels])
        for quantity in study.quantities:
            shows = observed(sizes, np.array([row.value(quantity.text) for row in rows]))
            found.append(Finding(kind, quantity, levels, rows, shows))
    return found


def _shown(found: list[Finding], study: Study, quantity: Quantity) -> list[tuple[str, Any]]:
    """Captions and pictures of a measure for the page."""
    mine = [f for f in found if f.quantity == quantity]
    return [
        (f"{f.kind.capitalize()}: {f.summary()}", figure)
        for f in mine
        if (figure := convergence(np.array([v.size for v in f.levels]), [r.value(quantity.text) for r in f.rows],
                                  f.kind, quantity, f.convergence)) is not None
    ]  # fmt: skip
