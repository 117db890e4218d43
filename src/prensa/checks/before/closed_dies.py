"""Measures of a closed die in problems whose tools never close one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.errors import Finding, Severity
from prensa.measures.filling import FILL, Section, closed_around, filling, walls
from prensa.model.feed import ends_early
from prensa.result.increment import PLACE, Force, ToolState
from prensa.system.moments import moments, stages
from prensa.system.system import System
from prensa.types import Array, Flags


def closed_dies(system: System) -> Iterator[Finding]:
    """Measures of dies around bodies that no tools enclose at the ends of the steps, or on the way of one that may end there.

    All tools have given ways: of others it is not known before a run where they are.
    """
    for path, body in _asked(system):
        if not any(_open_to_doubt(system, body)):
            first = next(q for q in FILL)
            yield Finding(
                path,
                f"no closed die surrounds {body!r} at the start or the end of a step, or on the way of one that may end "
                f"there: the tools leave an opening; add the tool or support that closes it, or measure "
                f"'{body}.trapped_volume' in the place of '{body}.{first}'",
                Severity.REFUSE,
            )


def _asked(system: System) -> Iterator[tuple[str, str]]:
    """Paths of measures of closed dies, with the body of each; of the plane, in space they are refused as they are read."""
    problem = system.problem
    if system.dofs.dimension == 3:
        return
    texts = [(f"measures.{name}", text) for name, text in problem.measures.items()]
    for k, step in enumerate(problem.steps):
        named = step.until.measure if step.until is not None else {}
        texts += [(f"steps.{k}.until.measure.{text}", text) for text in named]
    for path, text in texts:
        yield from ((path, body) for body in closed_around(problem, text))


def _open_to_doubt(system: System, body: str) -> Iterator[bool]:
    """Whether a die is closed, or tools may be anywhere, at the start and the end of each step.

    Of a step that may end on the way of its tools, at the moments of this way.
    """
    meshes = system.meshes
    nothing = np.zeros(0, dtype=np.int64)
    section = Section(
        {b: m.points for b, m in meshes.items()}, {b: m.cells for b, m in meshes.items()}, dict.fromkeys(meshes, nothing)
    )
    for number, stage in enumerate(stages(system)):
        around = walls(system.problem, number)
        early = ends_early(system.problem.steps[number])
        driven = np.isin(np.arange(system.ndof), stage.plan.fixed)
        ends = stage.known & driven if early else stage.known_after
        yield not (_prescribed(system, stage.known) and _prescribed(system, ends))
        on_the_way = [m.u for m in moments(system) if m.plan.number == number] if early else []
        for u in (stage.start, *on_the_way, stage.end):
            yield filling(system.problem, _tools(system, u), section, body, around).closed


def _prescribed(system: System, known: Flags) -> bool:
    """Whether all degrees of freedom of the tools are among those that are known (ndof,)."""
    return bool(system.dofs.tool.of(known.astype(np.float64)).all())


def _tools(system: System, u: Array) -> dict[str, ToolState]:
    """Where the tools are for degrees of freedom u (ndof,)."""
    nothing = Force(0.0, 0.0, 0.0)
    return {
        t.name: ToolState(t.at, PLACE[2](*map(float, system.place_of(k, u))), nothing, tuple(map(float, t.direction)))
        for k, t in enumerate(system.tools)
    }
