"""The problems that mechanisms of the solver are judged by: forming processes, random problems, two large ones, some in space."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import prensa as pr
from prensa.errors import PrensaError
from prensa.verify import example1
from prensa.verify.forming import upsetting
from prensa_bench.robustness.families import drawn

SEED = 7
GROUPS = ("gallery", "strips", "exact", "families", "large", "space")
DRAWN_OF = {"strips": 10, "slide_release": 6, "rolls": 6, "forgings": 6, "cycles": 6, "ironings": 6}
FORMING_CASES = (
    "flat_punch", "snap_through", "strip_drawing", "wire_drawing", "forward_extrusion", "flat_rolling",
    "hemispherical_stretching", "u_bending", "v_bending", "free_bending", "drawbead", "indentation", "cup_drawing",
    "channel_forming",
)  # fmt: skip
SPACE_CASES = ("ball_indentation", "square_billet", "vickers", "snap_hook", "bar_rolling")
DRAWN_EXACT = (0, 1, 2, 3, 5, 6, 7, 8, 9)  # strips with friction, of which it is asked how exact contact goes
DRAWN_IN_SPACE = 6


class Posed(NamedTuple):
    """A problem with its numerics."""

    problem: pr.Problem
    numerics: pr.Numerics


@dataclass(frozen=True)
class Entry:
    """A problem of the panel: ``pose`` makes it; ``most``: increments that are run at most (None: all).

    ``small``: makes the same on few elements, to load its kernels by; None where it is small itself.
    """

    group: str
    pose: Callable[[], Posed]
    most: int | None = None
    small: Callable[[], Posed] | None = None


def problems() -> Mapping[str, Entry]:
    """All of them by name, in the order in which they are run."""
    out = {f"upsetting {mu:g}": Entry("gallery", partial(_upsetting, (32, 24), mu)) for mu in (0.1, 0.3)}
    out |= {
        f"ring {mu:g}": Entry("gallery", partial(_case, "ring_compression", f"friction.mu={mu}")) for mu in (0.1, 0.3)
    }
    out |= {name: Entry("gallery", partial(_case, name)) for name in FORMING_CASES}
    for family, count in DRAWN_OF.items():
        group = family if family in GROUPS else "families"
        out |= {f"{family} {k}": Entry(group, partial(_drawn, family, k)) for k in range(count)}
    out |= {f"exact {k}": Entry("exact", partial(_exact, "strips", k)) for k in DRAWN_EXACT}
    out["hertz 1e5"] = Entry("large", partial(_hertz, (242, 207)), 4, partial(_hertz, (7, 6)))
    out["upsetting 1e5"] = Entry("large", partial(_upsetting, (260, 195), 0.1), 6, partial(_upsetting, (4, 3), 0.1))
    out |= {name: Entry("space", partial(_case, name)) for name in SPACE_CASES}
    out |= {f"space {k}": Entry("space", partial(_drawn, "space", k)) for k in range(DRAWN_IN_SPACE)}
    return out


def _upsetting(n: tuple[int, int], mu: float) -> Posed:
    return Posed(upsetting(n, mu), pr.Numerics())


def _hertz(n: tuple[int, int]) -> Posed:
    steps = tuple(example1.press(d, k) for d, k in ((0.5, 1), (1, 1), (4, 1), (8, 1)))
    material = pr.NeoHooke(E=example1.E, nu=example1.NU)
    return Posed(example1.problem(n, "finite", "current", material, steps), pr.Numerics())


def _case(name: str, *changes: str) -> Posed:
    file = Path(__file__).parents[3] / "examples" / f"{name}.yaml"
    if not file.exists():
        raise PrensaError(
            f"the panel runs {name}.yaml of the examples of a checkout, and there is none beside this distribution"
        )
    case = pr.load(file, changes)
    return Posed(case.problem, case.numerics)


def _drawn(family: str, number: int) -> Posed:
    found = drawn(family, SEED, number)
    return Posed(found.problem, found.numerics)


def _exact(family: str, number: int) -> Posed:
    """A drawn problem with the contacts' conditions met exactly, by multipliers, and friction."""
    problem, numerics = _drawn(family, number)
    contacts = tuple(replace(c, enforcement=pr.Exact()) for c in problem.contacts)
    return Posed(replace(problem, contacts=contacts), numerics)
