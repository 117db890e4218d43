"""Drawing and rolling: forces of a steady flow of elements through a tool, by their means over a passage.

The forces step as nodes pass, by 0.75 over the elements in the contact (docs/developer/book/12); means over one
passage are steady, and are what is compared.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

import prensa as pr
from prensa import reference as ref
from prensa.contact.passage import STAIR
from prensa.result.increment import Increment
from prensa.system.discretise import discretise
from prensa.verify.balance import Balance, imbalance
from prensa.verify.table import Row, case, row

K = 100.0  # shear yield stress
FLOW = pr.Perfect(K * np.sqrt(3.0))
WINDOW = 3.0  # passages at the end of a run over which the means are looked at


class Steady(NamedTuple):
    """The end of a run: ``mean`` over the last passage, ``spread`` of means and ``step`` over it, ``lying`` elements."""

    mean: float
    spread: float
    step: float
    lying: float


def steady(increments: Iterable[Increment], contact: str, column: str) -> Steady:
    """A column of the history in the last `WINDOW` passages."""
    last = [i for i in increments if column in i.means]
    last = [i for i in last if i.passages[contact] > last[-1].passages[contact] - WINDOW]
    means = np.array([i.means[column].mean for i in last])
    mean = float(means[-1])
    lying = float(np.mean([i.passing[contact].elements for i in last]))
    step = float(np.mean([2.0 * i.means[column].ripple for i in last]))
    return Steady(mean, float(np.ptp(means)) / abs(mean), step / abs(mean), lying)


def columns_mesh(x: np.ndarray, top: np.ndarray, rows: int) -> pr.Points:
    """Strip between y = 0 and the heights top (k,) at x (k,), in rows of elements."""
    y = np.linspace(0.0, 1.0, rows + 1)[:, None] * top
    points = np.stack([np.broadcast_to(x, y.shape), y], axis=-1).reshape(-1, 2)
    n = len(x)
    node = np.arange(len(points)).reshape(rows + 1, n)
    cells = np.stack([node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]], axis=-1).reshape(-1, 4)
    sides = {"bottom": node[0], "top": node[-1], "left": node[:, 0], "right": node[:, -1]}
    return pr.Points(
        tuple(map(tuple, points.tolist())),
        tuple(map(tuple, cells.tolist())),
        {k: tuple(v.tolist()) for k, v in sides.items()},
    )


WEDGE_ANGLE = np.radians(15.0)


def drawing(length: float, rows: int, E: float, travel: float = 2.0) -> pr.Problem:
    """Half of a sheet of half thickness 1 drawn by ``travel`` through a smooth wedge that it fills, elements of a length."""
    exit = ref.wedge_drawing(alpha=WEDGE_ANGLE, H=1.0, k=K).exit
    reach = (1.0 - exit) / np.tan(WEDGE_ANGLE)
    behind = reach + exit * travel + 0.8  # what comes in is slower than what goes out
    x = length * np.arange(-round(behind / length), round(0.6 / length) + 1)
    mesh = columns_mesh(x, np.clip(exit - x * np.tan(WEDGE_ANGLE), exit, 1.0), rows)
    # Hill's die ends with the wedge: on a land behind it the sheet, which springs back, presses across the pull
    profile = ((-10.0, exit + 10.0 * np.tan(WEDGE_ANGLE)), (0.0, exit), (5.0, exit + 5.0))
    return pr.Problem(
        "drawing", space="plane strain", bodies={"sheet": pr.Body(mesh, pr.J2(E, 0.3, FLOW))},
        tools={"die": pr.Profile(points=profile, at=(0.0, 0.0))}, contacts=(pr.Contact("sheet.top", "die"),),
        fixed={"sheet.right": pr.Fixed(x=travel), "sheet.bottom": "y"}, steps=(pr.Step("draw", increments=250),),
    )  # fmt: skip


@case("strip drawing (Hill)", suite="forming", slow=True)
def hill(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Means over a passage within 3 % of the slip-line field, steady to 0.5 %; the step of the forces as predicted."""
    exact = ref.wedge_drawing(alpha=WEDGE_ANGLE, H=1.0, k=K)
    for over_yield in (290.0, 5800.0):
        balance = Balance()
        history = list(balance.watch(drawing(1 / 15, 8, over_yield * FLOW.s0 * E_scale)))
        pull = steady(history, "sheet.top-die", "fixed.sheet.right.fx")
        press = steady(history, "sheet.top-die", "die.fy")
        label = f"E/Y = {over_yield:g}"
        yield row(f"{label}: pull", exact.pull, pull.mean, 0.03)
        yield row(f"{label}: force across the pull", exact.pull / np.tan(WEDGE_ANGLE), press.mean, 0.03)
        yield row(f"{label}: elements in the contact", 12.0, pull.lying, 0.0, "at least")
        yield row(f"{label}: spread of the means", 0.005, max(pull.spread, press.spread), 0.0, "at most")
        yield row(f"{label}: step of the pull over the mean", STAIR / pull.lying, pull.step, 1 / 3)
        yield from balance.rows()


def rolling(length: float, rows: int, E: float, mu: float, turn: float = 0.15) -> pr.Problem:
    """Half of a strip rolled from half thickness 1 to 0.75: pushed in as far as the roll takes it, then released."""
    R, h = 65.0, 0.75
    x = length * np.arange(-round(16.0 / length), round(2.0 / length) + 1)
    top = np.clip(h + R - np.sqrt(R**2 - np.minimum(x, 0.0) ** 2), h, 1.0)
    body = pr.Body(columns_mesh(x, top, rows), pr.J2(E, 0.3, FLOW))
    return pr.Problem(
        "rolling", space="plane strain", bodies={"strip": body}, tools={"roll": pr.Circle(radius=R, at=(0.0, h + R))},
        contacts=(pr.Contact("strip.top", "roll", friction=pr.Coulomb(mu)),), fixed={"strip.bottom": "y"},
        steps=(
            pr.Step("bite", move={"roll": pr.Motion(rz=0.04)}, fixed={"strip.left": pr.Fixed(x=1.99)}),
            # what pushed the strip is released over a step of its own: only then does the flow become steady
            pr.Step("release", move={"roll": pr.Motion(rz=0.05)}, fixed={"strip.left": "free"}),
            # means are as steady as the increments of a passage are many: a node's landing lies somewhere in one
            pr.Step("roll", move={"roll": pr.Motion(rz=0.05 + turn)}, increments=round(16 * R * turn / length)),
        ),
    )  # fmt: skip


@case("strip rolling (Karman)", suite="forming", slow=True, expected_warnings=("elements lie in the contact, forces step by",))
def karman(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Means over a passage: force within 3 % and torque within 1.5 % of the slab, steady to 0.5 %."""
    for over_yield in (290.0, 5800.0):
        problem = rolling(0.4, 4, over_yield * FLOW.s0 * E_scale, 0.1 * mu_scale, turn=0.08)
        history = list(pr.solve(problem))
        exact = ref.strip_rolling(R=65.0, H=1.0, h=0.75, mu=0.1, k=K, E=over_yield * FLOW.s0)
        force, torque = (steady(history, "strip.top-roll", f"roll.{c}") for c in ("fy", "mz"))
        label = f"E/Y = {over_yield:g}"
        yield row(f"{label}: force", exact.force, force.mean, 0.03)
        yield row(f"{label}: torque", exact.torque, -torque.mean, 0.015)
        yield row(f"{label}: elements in the contact", 12.0, force.lying, 0.0, "at least")
        yield row(f"{label}: spread of the means", 0.005, max(force.spread, torque.spread), 0.0, "at most")
        # over the last passage alone: the first touch of a strip that fills the gap has forces of the size of its round-off; the
        # median of its 16 increments: at E/Y = 5800 round-off of a gap of a roll of radius 65 may be 2.6e-8 of the force in one
        system = discretise(problem)
        unbalanced, turning = np.median([imbalance(system, inc) for inc in history[-16:]], axis=0)
        yield row(f"{label}: forces out of balance / largest force", 0.0, unbalanced, 1e-8, "absolute")
        yield row(f"{label}: moments out of balance / (force × length)", 0.0, turning, 1e-8, "absolute")
