"""Random slender bodies that buckle and snap, every answer held against one of many small increments and against Euler.

Columns between a support and a plane, or between two supports, straight or bent; arches under a circle or a stamp; rings
between two planes. Right is an answer that has the force of the reference throughout; else the run has to say that it is not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import prensa as pr
from prensa.errors import PrensaError
from prensa.reference.buckling import euler_clamped
from prensa.verify.table import heard

SAME_FORCE = 0.03  # allowed difference of the last force, over the largest
FINE = 300  # increments of the reference


@dataclass(frozen=True)
class Answer:
    """Times and the force along y of what drives the body then; what was ``reported``, '' if nothing."""

    times: list[float]
    forces: list[float]
    reported: str

    @property
    def last(self) -> float:
        """Force at the end."""
        return self.forces[-1]

    @property
    def peak(self) -> float:
        """Largest force."""
        return max(map(abs, self.forces))

    def at(self, time: float) -> float:
        """Force at a time."""
        return float(np.interp(time, self.times, self.forces))


def draw(seed: int, number: int) -> pr.Problem:
    """Problem *number*: the same for the same arguments."""
    rng = np.random.default_rng([seed, number])
    kind = ("column", "column", "arch", "arch", "ring")[number % 5]
    solid = pr.Elastic(E=1e5, nu=0.3) if rng.random() < 0.6 else pr.NeoHooke(E=1e5, nu=0.3)
    element = str(rng.choice(["q4_enhanced", "q8"]))
    friction = pr.Coulomb(mu=float(rng.choice([0.3, 0.5, 1.0])))
    problem = {"column": _column, "arch": _arch, "ring": _ring}[kind](rng, solid, element, friction)
    increments = None if rng.random() < 0.7 else int(rng.integers(5, 30))
    return replace(problem, steps=(replace(problem.steps[0], increments=increments),))


def _column(rng: np.random.Generator, solid: pr.Elastic, element: str, friction: pr.Coulomb) -> pr.Problem:
    """A column held below, under a plane that sticks or a support that moves."""
    length = float(rng.uniform(15, 60))
    bend = float(rng.choice([0.0, 1e-4, 1e-3, 0.01, 0.05]))
    sides = {}
    if bend:
        sides = {k: pr.ArcSide(through=(x + bend, length / 2)) for k, x in (("left", 0.0), ("right", 1.0))}
    mesh = pr.Patch(corners=((0, 0), (1, 0), (1, length), (0, length)), n=(2, 30), sides=sides)
    body = pr.Body(mesh, solid, element)
    way = -float(rng.uniform(0.01, 0.08)) * length
    if rng.random() < 0.5:
        return pr.Problem(
            "column", {"b": body}, (pr.Step("press", fixed={"b.top": pr.Fixed(x="held", y=way)}),), fixed={"b.bottom": "xy"}
        )  # fmt: skip
    return pr.Problem(
        "column", {"b": body}, (pr.Step("press", move={"p": pr.Motion(y=way)}),), {"p": pr.Plane(touching="b.top")},
        (pr.Contact("b.top", "p", friction),), fixed={"b.bottom": "xy"},
    )  # fmt: skip


def _arch(rng: np.random.Generator, solid: pr.Elastic, element: str, friction: pr.Coulomb) -> pr.Problem:
    """An arch clamped at its ends, pushed in the middle or beside it."""
    radius, half = float(rng.uniform(15, 60)), float(rng.uniform(0.3, 1.3))
    angles = (math.pi / 2 - half, math.pi / 2 + half)
    body = pr.Body(pr.Annulus(radius, radius + 1.0, (30, 2), angles=angles), solid, element)
    rise = radius * (1.0 - math.cos(half))
    aside = float(rng.choice([0.0, 0.0, 0.1])) * radius * math.sin(half)
    tool = pr.Circle(radius=0.15 * radius, at=(aside, math.sqrt((radius + 1.0) ** 2 - aside**2) + 0.15 * radius))
    step = pr.Step("push", move={"p": pr.Motion(y=-float(rng.uniform(0.5, 1.8)) * rise)})
    return pr.Problem(
        "arch", {"b": body}, (step,), {"p": tool}, (pr.Contact("b.outer", "p", friction if rng.random() < 0.5 else None),),
        fixed={"b.start": "xy", "b.end": "xy"},
    )  # fmt: skip


def _ring(rng: np.random.Generator, solid: pr.Elastic, element: str, friction: pr.Coulomb) -> pr.Problem:
    """Half a ring between two planes."""
    radius = float(rng.uniform(10, 30))
    body = pr.Body(pr.Annulus(radius, radius + 1.0, (24, 2), angles=(-math.pi / 2, math.pi / 2)), solid, element)
    tools = {
        "p": pr.Plane(at=(0.0, radius + 1.0), normal=(0.0, -1.0)),
        "q": pr.Plane(at=(0.0, -radius - 1.0), normal=(0.0, 1.0)),
    }
    step = pr.Step("press", move={"p": pr.Motion(y=-float(rng.uniform(0.3, 1.2)) * radius)})
    return pr.Problem(
        "ring", {"b": body}, (step,), tools, tuple(pr.Contact("b.outer", t, friction) for t in tools),
        fixed={"b.start": "xy", "b.end": "x"},
    )  # fmt: skip


def answer(problem: pr.Problem) -> Answer:
    """What a run of a problem gives."""
    times, forces = [0.0], [0.0]
    with heard() as said:
        try:
            for inc in pr.solve(problem):
                times.append(inc.time)
                forces.append(float(inc.tools["p"].force.y if inc.tools else -inc.supports["b.top"].y))
        except PrensaError as error:
            said.append(str(error))
    return Answer(times, forces, "; ".join(said))


def euler(problem: pr.Problem) -> float:
    """Buckling force of a column between clamped ends."""
    body: Any = problem.bodies["b"]
    E = body.material.E / (1.0 - body.material.nu**2)
    return euler_clamped(E=E, length=body.mesh.corners[2][1], thickness=1.0)


def verdict(problem: pr.Problem, fine: int = FINE) -> tuple[str, Answer, Answer]:
    """'right', 'reported' or 'wrong', the answer and the reference, which takes ``fine`` increments."""
    reference = answer(replace(problem, steps=(replace(problem.steps[0], increments=fine),)))
    found = answer(problem)
    end = min(found.times[-1], reference.times[-1])  # of a path that ended at a limit point what led to it
    right = abs(found.at(end) - reference.at(end)) <= SAME_FORCE * max(reference.peak, 1e-300)
    if (
        problem.name == "column"
    ):  # the elastica's force grows by half its shortening: a tenth is room for more than that
        right &= abs(found.last) <= 1.1 * euler(problem)
    return "right" if right else "reported" if found.reported else "wrong", found, reference
