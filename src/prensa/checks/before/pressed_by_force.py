"""How far the largest forces of tools press a body that flows, along the direction in which each presses it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from prensa.checks.before.extrusions import spread
from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.contact.surface import Surface
from prensa.friction.law import At, bounded
from prensa.materials.flow_curve import stress_at
from prensa.mesh.bricks import BrickMesh
from prensa.mesh.faces import enclosed_volume
from prensa.model.problem import Push, Step
from prensa.model.until import ToolForce
from prensa.precision import NEGLIGIBLE
from prensa.system.bending import Thickness, facing
from prensa.system.system import System
from prensa.types import Array


def gaps_of_forces(system: System, body: str, t: Thickness) -> Array:
    """Gaps (n, c, s) down to which the largest forces up to each of n steps press strips, by contacts of tools; inf: none do."""
    out = np.full((len(system.problem.steps), len(system.tool_contacts), len(t.size)), np.inf)
    for i, s in enumerate(system.tool_contacts):
        across = _direction(system, s, t) if s.body == body else None
        if across is None:
            continue
        for n in range(len(out)):
            force = largest_force(system.problem.steps[: n + 1], s.against, across)
            if force is not None:
                out[n, i] = (np.exp(-strain_of_force(system, s, across, force)) - 1.0) * t.size
    return np.where(np.isnan(out), np.inf, out)


def _direction(system: System, s: Surface, t: Thickness) -> Array | None:
    """Unit vector (d,) along which a tool presses the strips that it faces at first, their mean; None if it faces none."""
    faces = facing(system.tool_masters[s.against].seen(t.middle.reshape(-1, t.across.shape[1]), system.initial().u).n, t)
    ways = np.stack([-t.across, t.across], axis=1)[faces]
    size = float(np.linalg.norm(ways.sum(axis=0)))
    return ways.sum(axis=0) / size if size > NO_DIFFERENCE * len(ways) else None


def largest_force(steps: tuple[Step, ...], tool: str, across: Array) -> float | None:
    """The largest force ``across`` (d,) with which steps push a tool, or at which they end; None where there is none.

    Of a smooth tool that is guided beside the components F that are given: F·n/(n·n), with their part n of the normal.
    """
    found = [_across(force, across) for step in steps for one in _forces(step) for name, force in one.items() if name == tool]
    return max((force for force in found if force is not None), default=None)


def _across(force: Push | ToolForce, across: Array) -> float | None:
    """That of one force, at its largest in a table; of one that acts mainly past it there is none."""
    given = {k: getattr(force, key) for k, key in enumerate("xyz"[: len(across)]) if getattr(force, key) is not None}
    tables = {k: np.array(one if isinstance(one, tuple) else ((0.0, one),)) for k, one in given.items()}
    share = sum(across[k] ** 2 for k in given)
    if share < 0.5:
        return None
    if isinstance(force, ToolForce):  # whichever is met first ends the step
        return min(abs(one / across[k]) for k, one in given.items() if abs(across[k]) > NO_DIFFERENCE)
    times = np.unique(np.concatenate([table[:, 0] for table in tables.values()]))
    along = sum(across[k] * np.interp(times, *table.T) for k, table in tables.items())
    return float(np.abs(along).max()) / share


def _forces(step: Step) -> Iterator[Mapping[str, Push | ToolForce]]:
    """Forces of tools that a step prescribes, and those at which it ends."""
    yield step.push
    if step.until is not None:
        yield step.until.force


def strain_of_force(system: System, s: Surface, across: Array, force: float) -> float:
    """Logarithmic strain up to which a force of a tool presses a body that flows, along ``across`` (d,); nan: none.

    Of all of its section A, volume over height h, with the friction τ of the tool that is pushed: of what spreads along m axes
    at a mean distance r from where it does not move, F = σ(φ) A e^φ (1 + τ/σ r e^(φ/m)/(m h e^−φ)), Siebel's 1 + 2 μ R/(3 h) of a
    disc between two plates. A tool that presses on a part of it goes in further, and is not reported for it.
    """
    p, mesh = system.problem, system.meshes[s.body]
    flow = getattr(p.bodies[s.body].material, "flow", None)
    if flow is None or not isinstance(mesh, BrickMesh):
        return float("nan")
    strains = np.linspace(0.0, -np.log(NEGLIGIBLE), 1001)  # to where nothing is left; larger forces press as far
    flows = stress_at(flow, strains, np.zeros_like(strains))
    parts = next(b.volume for b in system.blocks if b.body == s.body).sum(axis=1)
    height, wide = float(np.ptp(mesh.points @ across)), spread(system, s.body, across)
    far = float(parts @ wide.distances[mesh.cells].mean(axis=1) / parts.sum())
    law, m = s.description.friction or p.friction, max(len(wide.ways), 1)
    rubs = 0.0 if law is None else bounded(law, flows, np.zeros_like(flows), At(k=flows / np.sqrt(3.0)))[0]
    rubs = np.minimum(rubs, flows / np.sqrt(3.0)) * far * np.exp((1.0 + 1.0 / m) * strains) / (m * height)
    volume = enclosed_volume(mesh.points, mesh.boundary)
    return float(np.interp(force * height / volume, (flows + rubs) * np.exp(strains), strains))
