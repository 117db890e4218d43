"""Slender parts that want to give way sideways: columns, arches, rings; their forces bounded by beam theory."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import prensa as pr
from prensa_bench.robustness.drawn import Drawn, friction, logarithmic, number, plane

if TYPE_CHECKING:
    from prensa_bench.robustness.files import Record

ABOVE_EULER = (
    1.1  # force over the buckling load of a column that is still right: shear, thickness, what follows buckling
)
ABOVE_BEAM = 1.25  # and over that of a linear beam, of arches and rings that soften


def problem(rng: np.random.Generator) -> Drawn:
    """One of the three, elastic, under a plane that moves down."""
    return (_column, _arch, _ring)[rng.integers(3)](rng)


def _pressed(
    rng: np.random.Generator, name: str, mesh: object, top: float, side: str, fixed: dict[str, str], mu: float, E: float,
    nu: float, most: float, travel: float,
) -> Drawn:  # fmt: skip
    """A part under a plane at height ``top``; ``most``: the largest force that is right."""
    tool = plane((0.0, top), (0.0, -1.0))
    increments = int(rng.integers(4, 41)) if rng.random() < 0.5 else None
    p = pr.Problem(
        name.partition(",")[0], bodies={"part": pr.Body(mesh, pr.Elastic(E, nu), "q4_enhanced")},
        tools={"tool": tool.tool}, contacts=(pr.Contact((f"part.{side}",), "tool"),), friction=friction(mu), fixed=fixed,
        steps=(pr.Step("press", move={"tool": pr.Motion(y=-travel)}, increments=increments),),
    )  # fmt: skip

    def on_the_right_branch(record: Record) -> str:
        found = float(record.history["tool.fy"].max())
        return (
            "" if found <= most else f"force {found:.4g} on a part that bears no more than {most:.4g}: the wrong branch"
        )

    facts = ({"tool": tool}, {f"part.{side}-tool": mu}, E, nu)
    return Drawn(
        (p,), *facts, claims=(on_the_right_branch,), limit=20.0, kind=f"{name}, mu {mu:.2g}, {increments or 'auto'}"
    )


def _column(rng: np.random.Generator) -> Drawn:
    """Clamped at its foot, its flat head under a plane, bowed by a part of its thickness; E' I π²/(K L)² bounds the force.

    A rough plane holds the head (K = 1/2); on a smooth one it sways (K = 1), and may tilt.
    """
    E, nu, t = logarithmic(rng, 1e3, 2e5), number(rng, 0.0, 0.4), 1.0
    L, bow = t * number(rng, 20.0, 60.0), t * number(rng, 0.005, 0.2)
    n = int(rng.integers(30, 61))
    arcs = {"left": pr.ArcSide(through=(bow, L / 2)), "right": pr.ArcSide(through=(t + bow, L / 2))}
    mesh = pr.Patch(((0.0, 0.0), (t, 0.0), (t, L), (0.0, L)), (2, n), sides=arcs)
    mu = float(rng.choice([0.0, number(rng, 0.3, 1.0)]))
    euler = (4.0 if mu else 1.0) * np.pi**2 * E / (1 - nu**2) * t**3 / 12 / L**2
    # shortening to well beyond the critical strain, π² t²/(12 (K L)²)
    travel = min(number(rng, 2.0, 15.0) * (4.0 if mu else 1.0) * np.pi**2 / 12 * (t / L) ** 2, 0.04) * L
    return _pressed(
        rng, f"column, L/t {L / t:.0f}, bow {bow / t:.2g} t", mesh, L, "top", {"part.bottom": "xy"}, mu, E, nu,
        ABOVE_EULER * euler, travel,
    )  # fmt: skip


def beam_stiffness(R: float, t: float, E: float, angle: float, free: bool) -> float:
    """Force of both halves per travel of the crown of a thin circular arch (unit thickness out of the plane).

    Castigliano with bending alone: the half of the angle ``angle`` from the crown, which neither turns nor moves sideways,
    to a foot that is clamped, or (``free``: a quarter of a ring) slides sideways without turning.
    """
    a = np.linspace(0.0, angle, 4001)
    # moment per unit of: the couple at the crown, the thrust there, half the force
    moments = [np.ones_like(a), R * (1 - np.cos(a)), R * np.sin(a)]
    weight = np.full(len(a), a[1])
    weight[[0, -1]] *= 0.5
    f = np.einsum("ia,ja,a->ij", moments, moments, weight) * R / (E * t**3 / 12)
    kept = [0] if free else [0, 1]
    inner = f[np.ix_(kept, kept)]
    flexibility = f[2, 2] - f[2, kept] @ np.linalg.solve(inner, f[kept, 2])
    return float(2.0 / flexibility)


def _arch(rng: np.random.Generator) -> Drawn:
    """Half of a clamped arch under a plane at its crown."""
    E, nu, t = logarithmic(rng, 1e3, 2e5), number(rng, 0.0, 0.4), 1.0
    R, angle = t * number(rng, 20.0, 60.0), number(rng, 0.6, 1.5)
    n = int(rng.integers(30, 61))
    mesh = pr.Annulus(R - t / 2, R + t / 2, (n, 2), angles=(np.pi / 2 - angle, np.pi / 2))
    travel = number(rng, 0.1, 0.5) * R * (1 - np.cos(angle))
    whole = beam_stiffness(R, t, E / (1 - nu**2), angle, free=False)
    return _pressed(
        rng, f"arch, R/t {R / t:.0f}, half angle {np.degrees(angle):.0f}°", mesh, R + t / 2, "outer",
        {"part.start": "xy", "part.end": "x"}, 0.0, E, nu, ABOVE_BEAM * whole / 2 * travel, travel,
    )  # fmt: skip


def _ring(rng: np.random.Generator) -> Drawn:
    """A quarter of a ring between smooth planes."""
    E, nu, t = logarithmic(rng, 1e3, 2e5), number(rng, 0.0, 0.4), 1.0
    R = t * number(rng, 15.0, 50.0)
    n = int(rng.integers(30, 61))
    mesh = pr.Annulus(R - t / 2, R + t / 2, (n, 2), angles=(0.0, np.pi / 2))
    travel = number(rng, 0.05, 0.35) * R
    whole = beam_stiffness(R, t, E / (1 - nu**2), np.pi / 2, free=True)
    return _pressed(
        rng, f"ring, R/t {R / t:.0f}", mesh, R + t / 2, "outer", {"part.start": "y", "part.end": "x"}, 0.0, E, nu,
        ABOVE_BEAM * whole / 2 * travel, travel,
    )  # fmt: skip
