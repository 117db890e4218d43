"""Slip hardening of one point: constant, linear, exponential and tabulated μ(κ), with a reversal, against closed forms.

On the reversal the path length goes on while the net slip shrinks: a law that hardens on the net slip would forget.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import cast

import numpy as np

import prensa as pr
from prensa.friction.law import At
from prensa.friction.return_map import return_map
from prensa.reference import MuConstant, MuExponential, MuLinear, SlipLaw, slip_hardening
from prensa.verify.balance import Balance
from prensa.verify.table import Row, case, row

NORMAL_PRESSURE = 40.0
PATH = (0.8, -0.5, 0.4)
"""Tool displacement at the ends of three strokes."""


@dataclass(frozen=True)
class MuTable:
    """Piecewise linear μ(κ) with the exact answer of k_T κ + μ(κ) p = k_T u: on one piece it is that of a line."""

    kappa: tuple[float, ...]
    mu: tuple[float, ...]

    @property
    def mu0(self) -> float:
        """μ before any slip."""
        return self.mu[0]

    def __call__(self, kappa: float) -> float:
        """`kappa` (length) → μ (-)."""
        return float(np.interp(kappa, self.kappa, self.mu))

    def solve(self, drive: float, p: float, k_T: float) -> float:
        """`drive` (length), p (stress), k_T (stress/length) → κ (length)."""
        for a, b, m, n in zip(self.kappa, (*self.kappa[1:], math.inf), self.mu, (*self.mu[1:], self.mu[-1])):
            slope = (n - m) / (b - a) if b < math.inf else 0.0
            kappa = MuLinear(m - slope * a, slope).solve(drive, p, k_T)
            if kappa <= b:
                return kappa
        raise AssertionError("the last piece has no end")


_TABLE = ((0.0, 0.2, 0.5, 1.2), (0.1, 0.16, 0.19, 0.3))

LAWS: dict[str, tuple[pr.Coulomb, SlipLaw]] = {
    "constant": (pr.Coulomb(0.2), MuConstant(0.2)),
    "linear": (pr.Coulomb(pr.MuLinear(mu0=0.1, slope=0.05)), MuLinear(0.1, 0.05)),
    "linear softening": (pr.Coulomb(pr.MuLinear(mu0=0.3, slope=-0.05, limit=0.05)), MuLinear(0.3, -0.05)),
    "exponential": (pr.Coulomb(pr.MuExponential(mu0=0.1, mu_inf=0.25, u0=0.3)), MuExponential(0.1, 0.25, 0.3)),
    "exponential softening": (pr.Coulomb(pr.MuExponential(mu0=0.3, mu_inf=0.15, u0=0.3)), MuExponential(0.3, 0.15, 0.3)),
    "table": (pr.Coulomb(pr.MuTable(kappa=_TABLE[0], mu=_TABLE[1])), cast(SlipLaw, MuTable(*_TABLE))),
}  # fmt: skip


def scaled(law: pr.Coulomb, factor: float) -> pr.Coulomb:
    """The law with every coefficient of friction times *factor*."""
    match law.mu:
        case pr.MuLinear(mu0=a, slope=b, limit=c):
            return pr.Coulomb(pr.MuLinear(mu0=factor * a, slope=factor * b, limit=None if c is None else factor * c))
        case pr.MuExponential(mu0=a, mu_inf=b, u0=c):
            return pr.Coulomb(pr.MuExponential(mu0=factor * a, mu_inf=factor * b, u0=c))
        case pr.MuTable(kappa=k, mu=m):
            return pr.Coulomb(pr.MuTable(kappa=k, mu=tuple(factor * v for v in m)))
        case float() | int():
            return pr.Coulomb(factor * law.mu)
    raise TypeError(f"unknown friction coefficient {law.mu!r}")


@case("slip hardening, return map", suite="friction", balance=False)
def law_level(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The return map alone follows the closed forms through a reversal, whatever the increments."""
    k_T = 500.0
    for name, (description, exact) in LAWS.items():
        law = scaled(description, mu_scale)
        t_exact, kappa_exact = slip_hardening(PATH, p=NORMAL_PRESSURE, k_T=k_T, law=exact)
        worst_t, worst_k = 0.0, 0.0
        for parts in (1, 7, 40):
            t, kappa, at = np.zeros((1, 1)), np.zeros(1), 0.0
            for end, want, path in zip(PATH, t_exact, kappa_exact):
                for _ in range(parts):
                    dg = np.full((1, 1), -(end - at) / parts)  # the tool drags: the body lags behind it
                    out = return_map(
                        law, At(), t, dg, np.array([NORMAL_PRESSURE]), np.array([True]), kappa, np.array([k_T])
                    )
                    t, kappa = out.t, out.kappa
                at = end
                worst_t = max(worst_t, abs(float(t[0, 0]) / want - 1.0))
                worst_k = max(worst_k, abs(float(kappa[0]) / path - 1.0))
        yield row(f"{name}: traction, worst relative error", 0.0, worst_t, 1e-9, "absolute")
        yield row(f"{name}: path length, worst relative error", 0.0, worst_k, 1e-9, "absolute")


def dragged(friction: pr.Coulomb, kinematics: str, geometry: str, E_scale: float) -> pr.Problem:
    """Two elements pressed by *NORMAL_PRESSURE* on a plane that is dragged to and fro.

    All nodes are held along the plane, so that the elastic slip of the contact is the only compliance of the drag, and
    the pressure is the load, whatever the friction.
    """
    body = pr.Body(pr.Rectangle(size=(2, 1), n=(2, 1)), pr.Elastic(E=1000.0 * E_scale, nu=0.3))
    strokes = (
        pr.Step(f"stroke {k}", move={"plane": pr.Motion(x=x)}, friction={"body.bottom-plane": friction}, increments=n)
        for k, (x, n) in enumerate(zip(PATH, (1, 4, 7)))
    )
    return pr.Problem(
        "drag", kinematics=kinematics, contact_geometry=geometry,
        bodies={"body": body}, tools={"plane": pr.Plane(normal=(0, 1), at=(0, 0))},
        contacts=(pr.Contact("body.bottom", "plane", enforcement=pr.Penalty(k_T=500.0)),),
        fixed={"body.bottom": "x", "body.top": "x"},
        loads={"body.top": pr.Load(pressure=NORMAL_PRESSURE)},
        steps=(pr.Step("press", increments=1), *strokes),
    )  # fmt: skip


@case("slip hardening, dragged body", suite="friction")
def through_the_solver(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """A body pressed on a plane that is dragged to and fro feels the closed form's traction at every node."""
    balance = Balance()
    for kinematics, geometry in (("small", "reference"), ("finite", "current")):
        for name, (description, exact) in LAWS.items():
            t_exact, kappa_exact = slip_hardening(PATH, p=NORMAL_PRESSURE, k_T=500.0, law=exact)
            ends = []
            for inc in balance.watch(dragged(scaled(description, mu_scale), kinematics, geometry, E_scale)):
                if inc.end_of_step and inc.step != "press":
                    ends.append(inc.contacts["body.bottom-plane"])
            t = np.array([c.force[:, 0] / c.weight for c in ends])
            kappa = np.array([c.slip for c in ends])
            worst_t = float(np.abs(t / t_exact[:, None] - 1.0).max())
            worst_k = float(np.abs(kappa / kappa_exact[:, None] - 1.0).max())
            yield row(f"{name}, {kinematics} strain: traction, worst relative error", 0.0, worst_t, 1e-9, "absolute")
            yield row(f"{name}, {kinematics} strain: path length, worst relative error", 0.0, worst_k, 1e-9, "absolute")
    yield from balance.rows()
