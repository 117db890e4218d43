"""Penalty, augmented and exact enforcement of the same contact conditions, compared with each other and with closed forms."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

import prensa as pr
from prensa import reference as ref
from prensa.friction.law import At
from prensa.reference import tables
from prensa.result.increment import ContactState, Increment
from prensa.verify import example1, forming
from prensa.verify.balance import Balance
from prensa.verify.friction import plate
from prensa.verify.table import Row, case, row


def enforced(p: pr.Problem, enforcement: pr.Penalty | pr.Augmented | pr.Exact) -> pr.Problem:
    """The problem with another enforcement in all its contacts."""
    return replace(p, contacts=tuple(replace(c, enforcement=enforcement) for c in p.contacts))


def penetration(c: ContactState, h: float) -> float:
    """Largest |gap| of the closed points over the depth h of the elements behind."""
    return float(np.abs(c.points.gap[c.points.pressure > 0]).max()) / h


@case("enforcement of example 1", suite="contact")
def cylinder(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Exact, augmented and penalty (β = 200) agree on the cylinder within 0.1 %; exact leaves no gap; P is the layer's."""
    balance = Balance()
    steps = (example1.press(0.5), example1.press(1), example1.press(2))
    for kinematics, geometry, forces in (
        ("small", "reference", tables.EXAMPLE1_FORCE_REFERENCE_GEOMETRY),
        ("small", "current", tables.EXAMPLE1_FORCE_CURRENT_GEOMETRY),
    ):
        p = example1.problem((70, 70), kinematics, geometry, pr.Elastic(E=example1.E * E_scale, nu=example1.NU), steps)
        depth = float(pr.discretise(p).surfaces[0].points.depth.min())
        exact = list(balance.watch(enforced(p, pr.Exact())))
        worst = max(penetration(i.contacts["block.top-cylinder"], depth) for i in exact)
        yield row(f"{geometry} geometry, exact: penetration / h", 1e-12, worst, 0.0, "at most")
        yield row(f"{geometry} geometry, exact: P at δ = 2", forces[2], example1.force(exact[2]), 0.002)
        for name, other in (("augmented", pr.Augmented()), ("penalty, β = 200", pr.Penalty(200.0))):
            for inc, e, d in zip(balance.watch(enforced(p, other)), exact, tables.EXAMPLE1_DELTA, strict=True):
                quantity = f"{geometry} geometry, {name}: P at δ = {d:g} against exact"
                yield row(quantity, example1.force(e), example1.force(inc), 1e-3)
    yield from balance.rows()


@case("enforcement of friction on a plate", suite="friction")
def friction(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Exact, augmented and penalty (β = β_T = 200) agree on the plate within 0.1 %; exact: no gap, |t| ≤ μp, no elastic slip.

    The normal force is that of the load in every form. The friction force answers to β_T alone: with the default of 3 elastic
    slip takes 0.5 % of it, whatever β is.
    """
    balance = Balance()
    n, h = 48, 40 / 48
    p = plate(n, E_scale, mu_scale)
    exact = balance.last(enforced(p, pr.Exact()))
    c = exact.contacts["plate.bottom-plane"]
    yield row("exact: penetration / h", 1e-12, penetration(c, h), 0.0, "at most")
    bound = pr.Coulomb(1.0 * mu_scale).bound(c.pressure, c.slip, At())[0]
    over = float(np.maximum(np.abs(c.shear) - bound, 0.0).max() / bound.max())
    yield row("exact: traction above μp / largest μp", 1e-12, over, 0.0, "at most")
    slides, sticks = c.status == 2, c.status == 1
    off = float(np.abs(np.abs(c.shear) - bound)[slides].max() / bound.max())
    yield row("exact: sliding traction off μp / largest μp", 1e-12, off, 0.0, "at most")
    moved = np.abs((c.x - c.X)[sticks, 0]).max() / h
    yield row("exact: slip of sticking points / h", 1e-12, float(moved), 0.0, "at most")
    yield row("exact: sliding and sticking points", n / 2, int(slides.sum() + sticks.sum()), 0.0, "at least")
    for name, other in (
        ("augmented", pr.Augmented(tolerance=1e-6)),
        ("penalty, β = β_T = 200", pr.Penalty(200.0, 200.0)),
    ):
        inc = balance.last(enforced(p, other))
        yield row(f"{name}: friction force against exact", exact.force("plane").x, inc.force("plane").x, 1e-3)
    soft = balance.last(enforced(p, pr.Penalty(200.0)))
    name = "penalty, β = 200, β_T = 3 (default): friction force against exact"
    yield row(name, exact.force("plane").x, soft.force("plane").x, 0.0, "report")
    where, ux = np.argsort(c.X[:, 0]), 1e3 * (c.x - c.X)[:, 0]
    for x, u in tables.PLATE_UX_CONVERGED.items():
        yield row(f"exact: u_x at x = {x:g} (10⁻³)", u, float(np.interp(x, c.X[where, 0], ux[where])), 0.005)
    yield from balance.rows()


def distorted(space: str, E_scale: float) -> pr.Problem:
    """A block 3 × 2 of eight distorted elements, its surface nodes unevenly spaced, pressed without friction by 0.001."""
    x = np.array([[i, j] for j in range(3) for i in range(5)], dtype=float) * np.array([0.75, 1.0])
    x[6:9] += np.array([[0.2, 0.15], [-0.1, -0.2], [0.15, 0.1]])
    x[11:14, 0] += np.array([-0.2, 0.15, 0.1])
    cells = tuple((k, k + 1, k + 6, k + 5) for j in range(2) for k in range(5 * j, 5 * j + 4))
    sides = {"bottom": tuple(range(5)), "left": (0, 5, 10), "top": tuple(range(10, 15))}
    mesh = pr.Points(points=tuple(map(tuple, x.tolist())), cells=cells, boundaries=sides)
    return pr.Problem(
        "patch", space=space, kinematics="small", contact_geometry="reference",
        bodies={"patch": pr.Body(mesh, pr.Elastic(1000.0 * E_scale, 0.3), "q4")},
        tools={"plane": pr.Plane(touching="patch.top")},
        contacts=(pr.Contact("patch.top", "plane", enforcement=pr.Exact()),),
        fixed={"patch.bottom": "y", "patch.left": "x"},
        steps=(pr.Step("press", move={"plane": pr.Motion(y=-0.002)}, increments=1),),
    )  # fmt: skip


@case("patch test of exact enforcement", suite="contact")
def patch(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Uniform pressure E* δ/H (E δ/H in plane stress and axisymmetry) at every node of a distorted patch, to 1e-10."""
    balance = Balance()
    for space in ("plane strain", "plane stress", "axisymmetric"):
        inc: Increment = balance.last(distorted(space, E_scale))
        pressure = inc.contacts["patch.top-plane"].pressure
        expected = 1000.0 * 0.001 / (1 - 0.3**2 if space == "plane strain" else 1.0)
        worst = float(pressure[np.argmax(np.abs(pressure - expected))])
        yield row(f"{space}: pressure farthest from the uniform one", expected, worst, 1e-10)
    yield from balance.rows()


@case("frictionless upsetting, exact enforcement", suite="forming")
def upsetting(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The homogeneous solution at 50 %, elasticity included, to 1e-6 in force and radius for every rate-independent flow law."""
    balance = Balance()
    for name, flow in forming.FLOWS.items():
        for yield_on in ("cauchy", "kirchhoff") if name == "ludwik" else ("cauchy",):
            p = forming.upsetting(
                (3, 2), 0.0, flow, enforcement=pr.Exact(), increments=10, yield_on=yield_on, E_scale=E_scale
            )
            inc = balance.last(p)
            exact = ref.upset_cylinder(
                0.5, R=10.0, flow=forming.curve(flow), E=forming.E, nu=forming.NU, yield_on=yield_on
            )
            yield row(f"{name}, {yield_on}: force at 50 %", float(exact.force), inc.force("punch").y, 1e-6)
            radius = float(inc.bodies["billet"].x[:, 0].max())
            yield row(f"{name}, {yield_on}: radius at 50 %", float(exact.size), radius, 1e-6)
    yield from balance.rows()
