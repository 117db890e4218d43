"""Increments that look like a cylinder pressed on a block (Hertz fields), made without the solver."""

from __future__ import annotations

import numpy as np

import prensa as pr
from prensa.contact.record import ContactRecord
from prensa.result.increment import (
    BodyState,
    ContactState,
    Force,
    Increment,
    Place,
    PointValues,
    Reaction,
    Statistics,
    ToolState,
)
from prensa.system.state import Clock, Energy, State

CONTACT = "block.top-cylinder"


def problem(
    name: str = "cylinder on a block", space: str = "plane strain", n: tuple[int, int] = (48, 24), **more
) -> pr.Problem:
    tools = {"cylinder": pr.Circle(radius=80, touching="block.top")}
    return pr.Problem(
        name, space=space, bodies={"block": pr.Body(pr.Rectangle((80, 40), n, origin=(0, -40)), pr.Elastic(10e3, 0.3))},
        tools=tools, contacts=(pr.Contact("block.top", "cylinder"),), fixed={"block.bottom": "y", "block.left": "x"},
        steps=(pr.Step("press", move={"cylinder": {"y": -2.0}}, increments=10),), **more,
    )  # fmt: skip


def case(**more) -> pr.Case:
    return pr.Case(problem(**more))


def grid(n: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (row by row from below) and counter-clockwise cells of the block 80 x 40, denser towards the contact."""
    x, y = 80 * np.linspace(0, 1, n[0] + 1) ** 1.6, -40 * np.linspace(1, 0, n[1] + 1) ** 1.6
    points = np.column_stack([np.tile(x, n[1] + 1), np.repeat(y, n[0] + 1)])
    corner = (np.arange(n[1])[:, None] * (n[0] + 1) + np.arange(n[0])).ravel()
    return points, np.column_stack([corner, corner + 1, corner + n[0] + 2, corner + n[0] + 1])


def increment(number: int = 10, total: int = 10, n: tuple[int, int] = (48, 24), touching: bool = True) -> Increment:
    """The increment *number* of *total*; the plastic strain and the friction are make-believe."""
    t = number / total
    a = 18.0 * np.sqrt(t)
    p0 = 10e3 / (1 - 0.3**2) * a / 160 if touching else 0.0
    X, cells = grid(n)
    # McEwen's closed form of the stress under a Hertz line contact
    x, z = X[:, 0], np.maximum(-X[:, 1], 1e-9)
    common = a**2 - x**2 + z**2
    m = np.sqrt(0.5 * (np.sqrt(common**2 + 4 * x**2 * z**2) + common))
    q = np.sign(x) * np.sqrt(np.maximum(0.5 * (np.sqrt(common**2 + 4 * x**2 * z**2) - common), 0))
    sx = -p0 / a * (m * (1 + (z**2 + q**2) / (m**2 + q**2 + 1e-30)) - 2 * z)
    sy = -p0 / a * m * (1 - (z**2 + q**2) / (m**2 + q**2 + 1e-30))
    sxy = -p0 / a * q * (m**2 - z**2) / (m**2 + q**2 + 1e-30)
    sz = 0.3 * (sx + sy)
    mises = np.sqrt(0.5 * ((sx - sy) ** 2 + (sy - sz) ** 2 + (sz - sx) ** 2) + 3 * sxy**2)
    u = np.column_stack([0.3 * t * X[:, 0] / 80, -2.0 * t * (1 + X[:, 1] / 40) * np.exp(-((x / 30) ** 2))])
    body = BodyState(
        X, X + u, cells, np.where(X[:, 1:2] == -40, [[0.0, 20.0 * t]], 0.0), np.column_stack([sx, sy, sz, sxy]), mises,
        np.maximum(mises - 600, 0) / 1e4,
    )  # fmt: skip

    top = np.flatnonzero(X[:, 1] == 0)
    s = X[top, 0]
    p = p0 * np.sqrt(np.maximum(1 - (s / a) ** 2, 0))
    width = np.gradient(s)
    shear = np.minimum(0.2 * p, 8 * s * t)
    status = np.where(p == 0, 0, np.where(shear < 0.2 * p, 1, 2)).astype(np.int8)
    gap = np.maximum(s**2 / 160 - a**2 / 160, 0) * (p == 0)
    from_stress = p * (1 + 0.04 * np.sin(3 * s)) - 8 * (np.abs(s - a) < 2)
    points = PointValues(X[top], (X + u)[top], gap, p, shear, 0.01 * s * t, status, width)
    state = ContactState(
        "block.top", "cylinder", "block", top, X[top], (X + u)[top], gap, p, shear, 0.01 * s * t, status, width,
        np.column_stack([shear, -p]) * width[:, None], from_stress, 0.97 * from_stress,
        np.where(p > 0, np.abs(p - from_stress), 0.0), float(width[p > 0].sum()), points,
    )  # fmt: skip
    force = float((p * width).sum())
    tool = ToolState(np.array([0.0, 80.0]), Place(0.0, -2.0 * t, 0.0), Force(-float((shear * width).sum()), force, 0.0))
    residuals = tuple(10.0 ** -(0.8 * k**1.5) for k in range(1, 7))
    return Increment(
        step="press", step_number=0, number=number, time=t, tools={"cylinder": tool},
        energy={"external": force * t, "elastic": 0.8 * force * t, "plastic": 0.1 * force * t, "friction": 0.08 * force * t,
                "contact": 0.02 * force * t, "imbalance": 1e-9 * force * t},
        supports={"block.bottom": Reaction(0.0, -force), "block.left": Reaction(1.0, 0.0)},
        statistics=Statistics(6, int(number == 4), residuals[-1], 0, residuals, (9, 4, 1, 0, 0, 0)),
        end_of_step=number == total, _state=lambda: committed(number, t),
        _contacts=lambda: {CONTACT: state}, _bodies=lambda: {"block": body},
    )  # fmt: skip


def committed(number: int, time: float) -> State:
    """A state full of numbers that text would round."""
    rng = np.random.default_rng(number)
    vectors, slip, coordinate = rng.normal(size=(9, 1)), rng.normal(size=9), rng.normal(size=(9, 1))
    record = ContactRecord(vectors, slip, coordinate, rng.random(9) > 0.5, *(rng.random(9) for _ in range(4)))
    return State(
        u=rng.normal(size=40) * 1e-3, du=rng.normal(size=40) / 3, dt_last=1 / 3, second_difference=rng.normal(size=40),
        history=(rng.normal(size=(4, 4, 7)), rng.normal(size=(2, 4, 3))), contact=record,
        lam=np.zeros((9, 2)),
        energy=Energy(*rng.normal(size=6).tolist()), work=rng.normal(size=3), clock=Clock(0, number, time, 0.1, 2.0),
        step_start=rng.normal(size=40),
    )  # fmt: skip
