"""Coulomb's friction or a shear factor: the same readings fitted with the other law, and what the difference says."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from prensa.errors import PrensaError
from prensa.inverse.objective import Objective, Parameter, Residuals
from prensa.model.problem import Problem
from prensa.model.schema import dump, loads
from prensa.sensitivity.parameters import numbers, part_of, with_values
from prensa.types import Array

LAW_NAMES = {"m": "a shear factor", "u": "Coulomb's law"}  # by the last letter of the path of the parameter
M_OVER_MU = 2.1  # shear factor that does to a ring what a coefficient of friction of 1 would: where the other fit starts
HIGHEST_FACTOR = 0.99  # a shear factor of 1 cannot be varied both ways
LITTLE, MUCH = 2.0, 10.0  # differences of AIC that say nothing, and that settle it (Burnham and Anderson 2002, section 2.6)
MISFIT = 2.0  # χ²/ν from which a fit is none


@dataclass(frozen=True)
class Rival:
    """The fit with the other law: its ``name``, that of the law of the case, path and value of its parameter, χ² of both.

    ``aic``: AIC of the other law less that of the case's (Akaike 1974), widened errors taken into account; ``words``: what
    follows.
    """

    name: str
    against: str
    path: str
    value: float
    square: float
    own: float
    aic: float
    words: str


def other_law(problem: Problem, path: str) -> tuple[str, Parameter] | None:
    """What changes a case from Coulomb friction to a shear factor, or back, and its parameter; None if *path* is of neither."""
    owner, _, key = path.rpartition(".")
    law = part_of(problem, owner)
    value = numbers(problem).get(path, 0.0)
    if key == "mu" and getattr(law, "type", "") == "coulomb" and value > 0.0:
        m = min(M_OVER_MU * value, HIGHEST_FACTOR)
        return f"{owner}={{type: shear, m: {m!r}}}", Parameter.of(f"{owner}.m", m, (0.0, HIGHEST_FACTOR))
    if key == "m" and getattr(law, "type", "") == "shear" and value > 0.0:
        mu = value / M_OVER_MU
        return f"{owner}={{type: coulomb, mu: {mu!r}}}", Parameter.of(f"{owner}.mu", mu, None)
    return None


def compared(objective: Objective, x: Array, at: Residuals) -> Rival | str | None:
    """The other law against that of the case, from its fit x (n,); a text says why not; None: no friction is fitted."""
    problems = [with_values(e.problem, objective.values(x)) for e in objective.experiments]
    for i, p in enumerate(objective.parameters):
        changes = [other_law(problem, p.path) for problem in problems]
        if changes[0] is None or None in changes:
            continue
        change, parameter = changes[0]
        name, own = LAW_NAMES[parameter.path[-1]], LAW_NAMES[p.path[-1]]
        objective.report(f"the same with {name}")
        try:
            rivals = [loads(dump(problem), overrides=[change], bounded=False).problem for problem in problems]
            against = replace(
                objective, experiments=[e.on(rival) for e, rival in zip(objective.experiments, rivals)], _last=None,
                parameters=[parameter if k == i else q for k, q in enumerate(objective.parameters)],
            )  # fmt: skip
            start = x.copy()
            start[i] = parameter.inner(parameter.start)
            y, their = against.minimise(start)
        except PrensaError as error:
            return f"{name} could not be compared: {str(error).splitlines()[0]}"
        objective.runs = against.runs
        value = parameter.value(float(y[i]))
        return _judged((name, own), parameter.path, value, (at, their), len(x))
    return None


def _judged(laws: tuple[str, str], path: str, value: float, fits: tuple[Residuals, Residuals], unknowns: int) -> Rival:
    """Which law the readings speak for: names of the other one and of that of the case, their fits the other way round."""
    (name, own), (at, their) = laws, fits
    freedom = max(len(at.r) - unknowns, 1)
    best = min(at.square, their.square)
    # both have as many parameters; errors that are larger than was said divide the difference (QAIC)
    aic = (their.square - at.square) / max(best / freedom, 1.0)
    weight = 1.0 / (1.0 + float(np.exp(-abs(aic) / 2.0)))
    comparison = f"χ² {their.square:.4g} with {name} ({path.rpartition('.')[2]} = {value:.3g}), {at.square:.4g} with {own}"
    if best / freedom > MISFIT:
        words = f"neither {own} nor {name} follows the readings within their errors: {comparison}"
    elif abs(aic) < LITTLE:
        words = f"the readings cannot distinguish {own} from {name}: {comparison}"
    else:
        better, worse = (own, name) if aic > 0 else (name, own)
        sure = "" if abs(aic) > MUCH else f" with a probability of {weight:.0%}"
        words = f"the readings {'' if sure else 'clearly '}favour {better} over {worse}{sure}: {comparison}"
    return Rival(name, own, path, value, their.square, at.square, aic, words)
