"""A billet between rough plates with damage laws, which tests of damage solve."""

from __future__ import annotations

from functools import cache
from typing import Any

import prensa as pr
from problems import stroke

STEEL = pr.J2(200e3, 0.3, pr.Ludwik(250.0, 500.0, 0.3))


def billet(mu: float = 0.3, damage: Any = pr.CockcroftLatham(), by: float = -5.0, **more: Any) -> pr.Problem:  # noqa: B008
    """Half of a billet between rough plates; with ``remesh`` of triangles."""
    remeshed = "remesh" in more
    mesh = pr.Rectangle((10.0, 15.0), (8, 12) if remeshed else (6, 9))
    return pr.Problem(
        "billet", space="axisymmetric", tools={"die": pr.Plane(touching="billet.top")},
        bodies={"billet": pr.Body(mesh, STEEL, "t6" if remeshed else None, damage=damage)},
        contacts=[pr.Contact(("billet.top", "billet.right"), "die", pr.Coulomb(mu))], fixed={"billet.bottom": "y"},
        **{"steps": [stroke(by, 15, tool="die")]} | more,
    )  # fmt: skip


@cache
def upset() -> list[pr.Increment]:
    """Its increments to a third of its height."""
    return list(pr.solve(billet(damage=(pr.CockcroftLatham(limit=0.05), pr.Oyane(A=0.3)))))


def largest(increment: pr.Increment, law: str = "cockcroft_latham") -> float:
    """The largest damage of the billet."""
    return float(increment.bodies["billet"].damage[law].max())


