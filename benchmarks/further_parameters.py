"""What each further parameter costs a run with derivatives: ``python benchmarks/further_parameters.py KIND [ROUNDS]``.

Upsetting to 30 % with a force and its derivatives in every increment, by none to `MOST` parameters of one kind (`KINDS`),
increment by increment in turn; processor time, of each increment the least of all rounds. Printed as a line of JSON: seconds of
the run alone, the run with one parameter over it, and what each further parameter adds, in per cent of the run alone.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import prensa as pr
from prensa.materials.solids.hill import Hill

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from users_metals import Metal, Power

MOST = 10
INCREMENTS = 30
FLOW, MATERIAL, FRICTION, MESH = (
    "bodies.billet.material.flow", "bodies.billet.material", "contacts.0.friction", "bodies.billet.mesh",
)  # fmt: skip
LAW = (f"{FLOW}.K", f"{FLOW}.n", f"{FLOW}.s0", f"{MATERIAL}.E")
OTHERS = (
    f"{FRICTION}.mu", f"{MESH}.size.0", f"{MESH}.size.1", f"{MESH}.origin.1",
    *(f"steps.0.move.punch.y.{k}.1" for k in (3, 2)),
)  # fmt: skip
"""Numbers of any kind of problem: friction, places at the beginning, motions of the punch."""


def upset(n: tuple[int, int], element: str = "q4_fbar", material: Any = None, friction: Any = None) -> pr.Problem:
    """The upsetting, on n elements, with a material and a law of friction of its own."""
    from prensa.verify.forming import upsetting

    p = upsetting(n, 0.1, reductions=(0.1, 0.2, 0.3), increments=INCREMENTS)
    body, contact = p.bodies["billet"], p.contacts[0]
    body = replace(body, element=element, material=material or body.material)
    return replace(p, bodies={"billet": body}, contacts=(replace(contact, friction=friction or contact.friction),))


Kind = tuple[Callable[[tuple[int, int]], pr.Problem], tuple[int, int], tuple[str, ...]]
KINDS: dict[str, Kind] = {
    "q4_fbar": (upset, (24, 18), LAW + OTHERS),
    "t6": (lambda n: upset(n, "t6"), (16, 12), LAW + OTHERS),
    "q8": (lambda n: upset(n, "q8"), (14, 10), LAW + OTHERS),
    "q8, finer": (lambda n: upset(n, "q8"), (20, 14), LAW + OTHERS),
    "capped friction": (
        lambda n: upset(n, friction=pr.Capped(mu=0.1, m=0.17)), (24, 18), (f"{FRICTION}.mu", f"{FRICTION}.m", *LAW, *OTHERS[1:]),
    ),
    "curve": (lambda n: upset(n, material=pr.J2(200e3, 0.3, Power(250.0, 500.0, 0.3))), (24, 18), LAW + OTHERS),
    "metal": (
        lambda n: upset(n, material=Metal(E=200e3, nu=0.3, s0=250.0, H=500.0)), (32, 24),
        (f"{MATERIAL}.s0", f"{MATERIAL}.H", f"{MATERIAL}.E", f"{MATERIAL}.nu", *OTHERS),
    ),
    "hill": (
        lambda n: upset(n, material=Hill(E=200e3, nu=0.3, flow=pr.Linear(250.0, 500.0))), (32, 24),
        (f"{FLOW}.s0", f"{FLOW}.H", f"{MATERIAL}.E", f"{MATERIAL}.nu", *OTHERS),
    ),
}  # fmt: skip


def seconds(problem: pr.Problem, paths: Sequence[str]) -> Iterator[float]:
    """Processor seconds of each increment of a run with the derivatives of a force."""
    begun = time.process_time()
    for inc in pr.solve(problem, pr.Numerics(threads=1), derivatives=paths):
        inc.derivative("punch.force.y") if paths else inc.force("punch")
        yield time.process_time() - begun
        begun = time.process_time()


def measured(name: str, rounds: int) -> dict[str, Any]:
    """A kind of problem: the run alone (s), with one parameter over it, what each further one adds in per cent of the run."""
    make, n, paths = KINDS[name]
    counts = range(MOST + 1)
    for count in counts:
        sum(seconds(make((4, 3)), paths[:count]))
    problem = make(n)
    # The runs of a round advance in turn, an increment each: what else the machine does slows all of them alike.
    found = [list(zip(*(seconds(problem, paths[:count]) for count in counts), strict=True)) for _ in range(rounds)]
    total = np.min(found, axis=0).sum(axis=0)
    further = 100 * np.diff(total[1:]) / total[0]
    out = {"kind": name, "n": n, "run": round(total[0], 4), "by 1": round(total[1] / total[0], 3)}
    return out | {f"{k + 2}": round(x, 1) for k, x in enumerate(further)} | {"mean": round(further.mean(), 1)}


if __name__ == "__main__":
    print(json.dumps(measured(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 9)))
