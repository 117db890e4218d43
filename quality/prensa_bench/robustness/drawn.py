"""A drawn problem, with what is known of it besides: outlines of its tools by formulas, friction, twins, estimates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

import prensa as pr
from prensa_bench.robustness.outlines import Corners, Outline, Round, Straight

if TYPE_CHECKING:
    from prensa_bench.robustness.files import Record

Claim = Callable[["Record"], str]
"""What else must hold of the files of a run: '' or what is wrong, in words."""


@dataclass(frozen=True)
class Placed:
    """A tool as the problem describes it, the same by formulas, and its reference point (2,) or (3,).

    ``off`` (length), ``tilt`` (rad): by which distances and normals of the two may differ.
    """

    tool: Any
    outline: Outline
    at: tuple[float, ...]
    off: float = 0.0
    tilt: float = 0.0


@dataclass(frozen=True)
class Twin:
    """Another problem with the same answer: its last forces times ``scale`` are those of the first, to ``tolerance``.

    ``angle``: by which it is turned; ``axes``: of the forces that are the same, where not all are; ``each_step``: whether those
    at the ends of all steps are; ``same_tools``: whether tools and supports are those of the first, so that what is known of
    its files holds of those of the twin.
    """

    problem: pr.Problem
    scale: float = 1.0
    tolerance: float = 1e-5
    angle: float = 0.0
    axes: tuple[str, ...] = ("fx", "fy")
    each_step: bool = False
    same_tools: bool = False

    def forces(self, history: Mapping[str, Any], tool: str) -> dict[str, Any]:
        """Forces of a tool by axis in the history of the twin, as those of the first problem."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        fx, fy = (np.asarray(history[f"{tool}.{a}"]) * self.scale for a in ("fx", "fy"))
        return {"fx": c * fx + s * fy, "fy": c * fy - s * fx}


@dataclass(frozen=True)
class Drawn:
    """A problem in one or several ``stages``, each started from the run of the one before, all with the same bodies.

    ``tools``: by name; ``mu``: coefficient by contact; ``E``, ``nu``, ``strength`` (largest flow stress; 0 if elastic) of
    the one material, or E = 0 where there are several or its law is another; ``limit``: seconds of processor time.
    """

    stages: tuple[pr.Problem, ...]
    tools: Mapping[str, Placed]
    mu: Mapping[str, float]
    E: float = 0.0
    nu: float = 0.0
    strength: float = 0.0
    claims: tuple[Claim, ...] = ()
    twins: tuple[Twin, ...] = ()
    limit: float = 20.0
    kind: str = field(default="")
    numerics: pr.Numerics = field(default_factory=lambda: pr.Numerics())

    @property
    def problem(self) -> pr.Problem:
        """The first stage."""
        return self.stages[0]


def plane(at: tuple[float, float], normal: tuple[float, float]) -> Placed:
    """Half-plane that looks along ``normal``."""
    return Placed(pr.Plane(normal=normal, at=at), Straight(normal), at)


def circle(at: tuple[float, float], radius: float, hollow: bool = False) -> Placed:
    """Circle about ``at``, or a round cavity."""
    return Placed(pr.Circle(radius=radius, at=at, concave=hollow), Round(radius, hollow), at)


def chain(at: tuple[float, float], points: Any, fillet: float, closed: bool = False) -> Placed:
    """Profile through corners, all with the same fillet."""
    corners = tuple((float(x), float(y)) for x, y in points)
    tool = pr.Profile(points=corners, fillet=fillet, at=at, closed=closed)
    return Placed(tool, Corners(corners, fillet, closed), at)


def stamp(at: tuple[float, float], width: float, fillet: float) -> Placed:
    """Flat stamp that looks down; endless above."""
    w, far = 0.5 * width, 10 * width
    outline = Corners(((-w, far), (-w, 0.0), (w, 0.0), (w, far)), fillet)
    return Placed(pr.Stamp(width=width, fillet=fillet, facing=(0.0, -1.0), at=at), outline, at)


def number(rng: np.random.Generator, low: float, high: float) -> float:
    """A number between two others."""
    return float(rng.uniform(low, high))


def logarithmic(rng: np.random.Generator, low: float, high: float) -> float:
    """A number between two others, every decade as often."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def friction(mu: float) -> Any:
    """Coulomb's law, or none for a coefficient of 0."""
    return pr.Coulomb(mu) if mu > 0 else None


AT_UNIT_STRAIN = 4.0  # flow stress of the drawn metals at a plastic strain of 1, of the initial one, is no larger


@dataclass(frozen=True)
class Metal:
    """A material with its largest flow stress; ``strength`` 0: elastic."""

    material: Any
    E: float
    nu: float
    strength: float

    @property
    def type(self) -> str:
        """Name of the material."""
        return str(self.material.type)


def metal(rng: np.random.Generator, plastic: bool, E: float | None = None) -> Metal:
    """A drawn metal (MPa), elastic or elastic-plastic with isotropic hardening."""
    E = logarithmic(rng, 7e4, 2.1e5) if E is None else E
    nu = number(rng, 0.25, 0.4)
    if not plastic:
        return Metal(pr.Elastic(E, nu), E, nu, 0.0)
    s0 = number(rng, 0.001, 0.003) * E
    flow: Any = [pr.Linear(s0, 3.0 * s0), pr.Voce(s0, s0, 8.0), pr.Swift(2.5 * s0, 0.01, 0.2)][rng.integers(3)]
    return Metal(
        pr.J2(E, nu, flow), E, nu, AT_UNIT_STRAIN * s0
    )  # Swift's curve begins at s0 too, within a few per cent
