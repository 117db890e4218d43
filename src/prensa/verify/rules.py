"""Verification of the integration of contact: patch test, rules and penalties, the error bar, edges of the stick zone."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.stats import spearmanr

import prensa as pr
from prensa.reference import LayerLine, flat_punch_stick, layer_line
from prensa.result.increment import ContactState, Increment
from prensa.types import Array, Flags
from prensa.verify.balance import Balance
from prensa.verify.example1 import NU, E, H, R
from prensa.verify.table import Row, case, row

RULES = ("nodal", "gauss1", "gauss2", "gauss3", "simpson", "kikuchi")
BETAS = (10.0, 1e3, 1e5)

# RMS errors in % of p0 at the points and of the nodal pressures that a separate program found on Example 1 with 16 contact
# elements and a half-width of about 9, for each of BETAS. Its mesh and norm are not recorded; `contact_mesh` and `Pressed`
# are what a scan found (docs/theory/integration.md)
RECORDED: dict[str, tuple[tuple[float, float], ...]] = {
    "gauss1": ((2.2, 0.7), (4.7, 0.5), (4.8, 0.5)),
    "gauss2": ((1.7, 0.6), (3.5, 0.1), (66.5, 0.1)),
    "gauss3": ((7.6, 0.6), (95.0, 0.5), (95.0, 0.5)),
    "simpson": ((15.0, 0.6), (75.0, 0.5), (75.0, 0.5)),
    "nodal": ((1.6, 0.7), (1.3, 0.2), (1.3, 0.2)),
}
ELEMENT_WIDTHS = tuple(4.0 * 2.0 ** (-0.5 * k) for k in range(7))  # widths of the contact elements; half-width 12.2


# -------------------------------------------------------------------------------------------------------- meshes
def points_mesh(x: Array, boundaries: dict[str, Array]) -> pr.Points:
    """Quadrilaterals between the nodes x (ny + 1, nx + 1, 2), rows from below; boundaries by node number."""
    ny, nx = x.shape[0] - 1, x.shape[1] - 1
    node = np.arange((nx + 1) * (ny + 1)).reshape(ny + 1, nx + 1)
    cells = np.stack([node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]], axis=-1).reshape(-1, 4)
    names: Any = {k: tuple(v.tolist()) for k, v in boundaries.items()}
    return pr.Points(tuple(map(tuple, x.reshape(-1, 2).tolist())), tuple(map(tuple, cells.tolist())), names)


def _growing(first: float, length: float, growth: float = 1.05) -> Array:
    """Ends (n,) of the fewest intervals that fill *length*, each larger than the one before (*first*) by at most *growth*."""
    n = math.ceil(math.log1p(length * (growth - 1) / (first * growth)) / math.log(growth))
    q = brentq(lambda q: first * sum(q**k for k in range(1, n + 1)) - length, 0.2, growth)
    return np.cumsum(first * q ** np.arange(1, n + 1))


def contact_mesh(h: float, count: int = 16) -> pr.Points:
    """Half of the block of Example 1: *count* square contact elements of width h, elsewhere growing by at most 5 %."""
    x = np.concatenate([np.arange(count + 1) * h, count * h + _growing(h, 80.0 - count * h)])
    y = np.concatenate([[0.0, h], h + _growing(h, H - h)])
    grid = np.stack(np.meshgrid(x, H - y[::-1]), axis=-1)
    node = np.arange(grid.shape[0] * grid.shape[1]).reshape(grid.shape[:2])
    return points_mesh(grid, {"bottom": node[0], "left": node[:, 0], "top": node[-1, : count + 1]})


# ---------------------------------------------------------------------------------------------------- patch test
def patch(space: Any, kinematics: Any, rule: Any, enforcement: Any, E_scale: float = 1.0) -> pr.Problem:
    """A distorted 4 × 3 patch under a uniform pressure of 10 on a rigid plane, free sides."""
    rng = np.random.default_rng(3)
    x = np.stack(np.meshgrid(np.linspace(0, 4, 5), np.linspace(0, 3, 4)), axis=-1)
    x[1:-1, 1:-1] += rng.uniform(-0.25, 0.25, x[1:-1, 1:-1].shape)
    x[0, 1:-1, 0] += rng.uniform(-0.3, 0.3, 3)
    node = np.arange(20).reshape(4, 5)
    boundaries = {"bottom": node[0], "left": node[:, 0], "top": node[-1], "right": node[:, -1]}
    # the plain element passes the test in every space, so that what is seen is the rule's
    return pr.Problem(
        "patch", space=space, kinematics=kinematics,
        bodies={"patch": pr.Body(points_mesh(x, boundaries), pr.Elastic(1000.0 * E_scale, 0.3), "q4")},
        tools={"plane": pr.Plane(touching="patch.bottom")},
        contacts=(pr.Contact("patch.bottom", "plane", enforcement=enforcement, integration=rule),),
        fixed={"patch.left": pr.Fixed(x="held")}, loads={"patch.top": pr.Load(pressure=10.0)},
        thickness=1.0 if space == "axisymmetric" else 0.7,
        steps=(pr.Step("press", increments=1),),
    )  # fmt: skip


def uniformity(inc: Increment) -> tuple[float, float]:
    """Largest deviation of the pressures at the nodes, and at the points, from their mean over that mean."""
    c = inc.contacts["patch.bottom-plane"]
    p = float((c.pressure * c.weight).sum() / c.weight.sum())
    return float(np.abs(c.pressure / p - 1.0).max()), float(np.abs(c.points.pressure / p - 1.0).max())


PATCHES: tuple[tuple[str, str], ...] = (
    ("plane strain", "small"),
    ("plane strain", "finite"),
    ("plane stress", "small"),
    ("axisymmetric", "small"),
    ("axisymmetric", "finite"),
)


def consistent(space: str, rule: str) -> bool:
    """Whether the rule integrates the shape functions exactly: all do, but one Gauss point where 2πr is inside."""
    return rule != "gauss1" or space != "axisymmetric"


@case("patch test of the integration rules", suite="rules")
def patch_test(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """A uniform pressure passes a distorted patch: to round-off with one k_n and with multipliers, and what else happens."""
    balance = Balance()
    for space, kinematics in PATCHES:
        for rule in RULES:
            uniform = consistent(space, rule)
            enforcements: tuple[tuple[str, Any, float, bool], ...] = (
                ("one k_n", pr.Penalty(k_n=5e4), 1e-10, uniform),
                # penetrations of tolerance × h bend the surface: pressures follow with E* × tolerance
                ("augmented", pr.Augmented(), 1e-5 * 1.1e3 / 10.0, uniform),
                ("k_n by β", pr.Penalty(), 0.0, False),
            )
            for name, enforcement, tolerance, judged in enforcements[: 1 if kinematics == "finite" else 3]:
                nodes, points = uniformity(balance.last(patch(space, kinematics, rule, enforcement, E_scale)))
                where = f"{space}, {kinematics}, {rule}, {name}"
                yield row(f"{where}: nodes", 0.0, nodes, tolerance, "absolute" if judged else "report")
                # more points than nodes: their multipliers are not unique and keep what the first guess was
                unique = name != "augmented" or rule in ("nodal", "gauss1", "kikuchi")
                yield row(f"{where}: points", 0.0, points, tolerance, "absolute" if judged and unique else "report")
        for rule in ("nodal", "gauss1"):
            nodes, points = uniformity(balance.last(patch(space, kinematics, rule, pr.Exact(), E_scale)))
            kind: Any = "absolute" if consistent(space, rule) else "report"
            yield row(f"{space}, {kinematics}, {rule}, exact", 0.0, max(nodes, points), 1e-10, kind)
    yield from balance.rows()


# ----------------------------------------------------------------------------------------------------- rules × β
@dataclass(frozen=True)
class Pressed:
    """Example 1 at δ = 2 with one rule and penalty, and the layer's solution at that depth."""

    contact: ContactState
    layer: LayerLine

    def rms(self, was: Array, now: Array, pressure: Array) -> float:
        """RMS error / p0 against the layer at x = now (k,) of pressures (k,) whose points were within 0.85 a."""
        inside = was < 0.85 * self.layer.a
        return float(np.sqrt(np.mean((pressure - self.layer.pressure(now))[inside] ** 2))) / self.layer.p0

    @property
    def at_points(self) -> float:
        """RMS error / p0 at the integration points, each where it has moved to; nodes shared by two edges count in both.

        The linear problem means initial places; the recorded figures contain more than their errors there (documentation).
        """
        c, q = self.contact, self.contact.points
        twice = np.isin(np.round(q.X[:, 0], 9), np.round(c.X[c.X[:, 0] > 0, 0], 9)) & (len(q.X) > len(c.X))
        return self.rms(*(np.repeat(v, 1 + twice) for v in (q.X[:, 0], q.x[:, 0], q.pressure)))

    @property
    def at_nodes(self) -> float:
        """RMS error / p0 of the pressures recovered from nodal forces, each where its node was."""
        x = self.contact.X[:, 0]
        return self.rms(x, x, self.contact.pressure)


def pressed(rule: Any, enforcement: Any, h: float = 1.3, delta: float = 2.0, E_scale: float = 1.0) -> pr.Problem:
    """Example 1, plain quadrilaterals, linear Signorini; a/h = 9.37 for the default h at δ = 2."""
    return pr.Problem(
        "cylinder on a block", kinematics="small", contact_geometry="reference",
        bodies={"block": pr.Body(contact_mesh(h, 16 if h > 1.2 else int(20.0 / h)), pr.Elastic(E * E_scale, NU), "q4")},
        tools={"cylinder": pr.Circle(radius=R, touching="block.top")},
        contacts=(pr.Contact("block.top", "cylinder", enforcement=enforcement, integration=rule),),
        fixed={"block.bottom": "y", "block.left": "x"},
        steps=(pr.Step("press", move={"cylinder": pr.Motion(y=-delta)}, increments=1),),
    )  # fmt: skip


def outcome(problem: pr.Problem, balance: Balance | None = None, delta: float = 2.0) -> Pressed:
    """Solve a `pressed` problem."""
    inc = (balance or Balance()).last(problem)
    return Pressed(inc.contacts["block.top-cylinder"], layer_line(R=R, H=H, E=E, nu=NU, delta=delta))


@case("integration rules and penalties", suite="rules", slow=True, expected_warnings=("beta = 1e+05: iterations suffer",))
def rules_and_penalties(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Point pressures oscillate under all rules but the nodal one as β grows; nodal forces are right under all of them."""
    balance = Balance()
    for rule, recorded in RECORDED.items():
        for beta, (points, nodes) in zip(BETAS, recorded):
            found = outcome(pressed(rule, pr.Penalty(beta=beta), E_scale=E_scale), balance)
            for where, reference, value in (("points", points, found.at_points), ("nodes", nodes, found.at_nodes)):
                name = f"RMS error of p at the {where}, % of p0: {rule}, β = {beta:g}"
                yield row(name, reference, 100 * value, 1 / 3)
    for beta in BETAS:
        value = 100 * outcome(pressed("kikuchi", pr.Penalty(beta=beta), E_scale=E_scale), balance).at_points
        yield row(f"RMS error of p at the points, % of p0: kikuchi, β = {beta:g}", 2.0, value, 0.0, "at most")
    yield from balance.rows()


# ------------------------------------------------------------------------------------------------------ error bar
def averaged(layer: LayerLine, x: Array) -> Array:
    """∫ N_A p dΓ / ∫ N_A dΓ (n,) of the layer's pressure on nodes x (n,) from 0 on: what λ_A stands for."""
    xi, w = np.polynomial.legendre.leggauss(60)
    xi, w = 0.5 * (xi + 1.0), 0.5 * w
    h = np.diff(x)[:, None]
    p = layer.pressure((x[:-1, None] + h * xi).ravel()).reshape(len(h), -1)
    force, area = np.zeros((2, len(x)))
    for ends, N in ((slice(None, -1), 1.0 - xi), (slice(1, None), xi)):
        force[ends] += (h * w * N * p).sum(axis=1)
        area[ends] += (h * w * N).sum(axis=1)
    return force / area


def bars_and_errors(found: Pressed) -> tuple[float, float, float, float]:
    """RMS over p0 of the error bar |λ − n·σ*n| and the true error of λ, twice.

    First against the layer's pressure at the nodes within 0.95 half-widths (at the edge it has a vertical tangent and no
    nodal value is its own), then against the layer's averages over the shape functions at all closed nodes.
    """
    c, layer = found.contact, found.layer
    order = np.argsort(c.X[:, 0])
    x, p, bar, closed = c.X[order, 0], c.pressure[order], c.error[order], c.status[order] > 0
    inside = x < 0.95 * layer.a

    def rms(v: Array, where: Flags) -> float:
        return float(np.sqrt(np.mean(v[where] ** 2))) / layer.p0

    exact, means = layer.pressure(x), averaged(layer, x)
    return rms(bar, inside), rms(p - exact, inside), rms(bar, closed), rms(p - means, closed)


@case("error bar of the contact pressure", suite="rules", slow=True)
def error_bar(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The error bar ranks meshes and rules as the true error against the layer does, and is not zero where λ is right."""
    balance = Balance()
    # the nodal pressures of kikuchi are those of gauss2
    found = [
        outcome(pressed(rule, pr.Penalty(), h, E_scale=E_scale), balance) for h in ELEMENT_WIDTHS for rule in RULES[:5]
    ]
    values = np.array([bars_and_errors(f) for f in found])
    inner, every = (spearmanr(values[:, k], values[:, k + 1]).statistic for k in (0, 2))
    yield row("rank correlation of error bar and true error, within 0.95 a", 0.7, inner, 0.0, "at least")
    yield row("the same with the element of the edge, against averages", 0.7, every, 0.0, "at least")
    yield row("least error bar / p0", 1e-3, values[:, 0].min(), 0.0, "at least")
    yield row("error bar / true error, median", 1.0, np.median(values[:, 2] / values[:, 3]), 0.0, "report")
    yield from balance.rows()


# ---------------------------------------------------------------------------------------- stick zone of a flat punch
def flat_punch(n: int, mu: float, E_scale: float = 1.0, side: float = 100.0) -> pr.Problem:
    """Half of a rigid flat punch of half-width 1 on a square block, pressed with friction, exact contact."""
    grade = pr.Grade(x=(0.42, 1.0), y=(0.0,), ratio=2 * side)
    mesh = pr.Rectangle(size=(side, side), n=(n, 3 * n // 4), origin=(0, -side), grade=grade)
    return pr.Problem(
        "flat punch with friction", kinematics="small", contact_geometry="reference",
        bodies={"block": pr.Body(mesh, pr.Elastic(1000.0 * E_scale, 0.3))},
        tools={"punch": pr.Stamp(width=2.0, touching="block.top")},
        contacts=(pr.Contact("block.top", "punch", friction=pr.Coulomb(mu), enforcement=pr.Exact()),),
        fixed={"block.bottom": "xy", "block.left": "x"},
        steps=(pr.Step("press", move={"punch": pr.Motion(y=-0.01)}, increments=2),),
    )  # fmt: skip


def stick_edge(inc: Increment, mu: float) -> float:
    """Half-width of the stick zone: 1 − |t|/μp vanishes there like a square root, so its square is extrapolated to zero."""
    c = inc.contacts["block.top-punch"]
    order = np.argsort(c.X[:, 0])
    x, p, t = c.X[order, 0], c.pressure[order], np.abs(c.shear[order])
    last = int(np.flatnonzero(c.status[order] == 1)[-1])
    f = (1.0 - t[last - 1 : last + 1] / (mu * p[last - 1 : last + 1])) ** 2
    return float(x[last] + f[1] * (x[last] - x[last - 1]) / (f[0] - f[1]))


@case("stick zone of a flat punch", suite="rules", slow=True)
def stick_zone(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The edge of the stick zone of a flat punch converges with the mesh, and to that on a half-plane with the block."""
    balance = Balance()
    mu = 0.2 * mu_scale
    meshes = (40, 80, 160)
    c = [stick_edge(balance.last(flat_punch(n, mu, E_scale)), mu) for n in meshes]
    for n, value in zip(meshes, c):
        yield row(f"edge of the stick zone / half-width, n = {n}", c[-1], value, 0.0, "report")
    rate = float(np.log2(abs(c[0] - c[1]) / abs(c[1] - c[2])))
    yield row("rate of its convergence", 0.8, rate, 0.0, "at least")
    half_plane = flat_punch_stick(mu, NU)
    large = stick_edge(balance.last(flat_punch(160, mu, E_scale, side=800.0)), mu)
    yield row("edge on a block of 100 half-widths against the half-plane", half_plane, c[-1], 0.0, "report")
    yield row("edge on a block of 800 half-widths against the half-plane", half_plane, large, 0.02)
    yield from balance.rows()
