"""Ductile damage: laws along homogeneous paths, the equator of an upset billet, an extrusion that bursts along its axis."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

import prensa as pr
from prensa.reference import tables
from prensa.result.increment import Increment
from prensa.system.discretise import discretise
from prensa.types import Index
from prensa.verify.balance import BALANCE_TOLERANCE, Balance, imbalance
from prensa.verify.forming import BILLET_FLOW
from prensa.verify.table import Row, case, row

Supports = dict[str, str | dict[str, float | str]]
DAMAGE_LAWS = {
    "cockcroft_latham": pr.CockcroftLatham(), "cockcroft_latham_plain": pr.CockcroftLathamPlain(), "oyane_tenth": pr.Oyane(A=0.1),
    "rice_tracey": pr.RiceTracey(), "plastic_work": pr.Freudenthal(),
}  # fmt: skip
"""By their columns of the table."""
PULLED_UP: Supports = {"b.bottom": "y", "b.left": "x", "b.top": {"y": 1.0}}
DAMAGE_PATHS: dict[str, tuple[str, Supports, float]] = {
    "uniaxial tension": ("axisymmetric", PULLED_UP, 1e-8),
    "equibiaxial tension (plane stress)": ("plane stress", {**PULLED_UP, "b.right": {"x": 1.0}}, 1e-8),
    "plane strain tension (plane stress sheet)": ("plane stress", {**PULLED_UP, "b.right": "x"}, 2e-3),
    "pure shear": ("plane strain", {"b.bottom": "xy", "b.top": {"x": 2.0, "y": "held"}}, 2e-3),
}
"""Space, supports of one element, tolerance: what the elastic beginning takes where it has other ratios of stresses."""


@case("damage along homogeneous paths", suite="forming")
def paths(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """One element pulled and sheared to a plastic strain of 0.5, against the rigid-plastic integrals of the table."""
    strain, apart = 0.5, 0.0
    known = {d.path: d for d in tables.damage_paths() if d.strain == strain}
    for path, (space, fixed, tolerance) in DAMAGE_PATHS.items():
        steel = pr.J2(200e3 * E_scale, 0.3, BILLET_FLOW)
        element = "q4" if space == "plane stress" else "q4_fbar"  # named: one element is not asked how it bends
        body = pr.Body(pr.Rectangle((1.0, 1.0), (1, 1)), steel, element, damage=tuple(DAMAGE_LAWS.values()))
        until = pr.Until(measure={"b.max.plastic_strain": strain})
        steps = (pr.Step("s", increments=160, until=until),)
        *_, last = pr.solve(pr.Problem("one", space=space, bodies={"b": body}, fixed=fixed, steps=steps))
        found, held = last.bodies["b"].damage, np.array(last.bodies["b"].reaction[:, 1])
        apart = max(apart, abs(float(held.sum())) / float(np.abs(held).max()))
        for column, law in DAMAGE_LAWS.items():
            within = max(tolerance, 1e-3) if law.of_stress else tolerance
            yield row(f"{path}: {column}", getattr(known[path], column), float(found[law.name].mean()), within)
    yield row("forces out of balance / largest force", 0.0, apart, BALANCE_TOLERANCE, "absolute")


def billet(mu: float, n: tuple[int, int], E_scale: float = 1.0) -> pr.Problem:
    """Half of a billet between plates, pressed to six tenths of its height."""
    body = pr.Body(pr.Rectangle((10.0, 7.5), n), pr.J2(200e3 * E_scale, 0.3, BILLET_FLOW), damage=pr.CockcroftLatham())
    return pr.Problem(
        "billet", space="axisymmetric", bodies={"billet": body}, tools={"die": pr.Plane(touching="billet.top")},
        contacts=(pr.Contact(("billet.top", "billet.right"), "die", pr.Coulomb(mu)),), fixed={"billet.bottom": "y"},
        steps=(pr.Step("press", move={"die": pr.Motion(y=-3.0)}),),
    )  # fmt: skip


@case("upsetting, damage at the equator", suite="forming")
def equator(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The equator of the free side: Cockcroft and Latham's integral from the stretch of its surface, more with more friction."""
    balance, before = Balance(), 0.0
    for mu, n in ((0.0, (8, 6)), (0.1, (16, 12)), (0.3, (16, 12))):
        last = balance.last(billet(mu * mu_scale, n, E_scale))
        body = last.bodies["billet"]
        side = np.flatnonzero((body.X[:, 0] == 10.0) & (body.X[:, 1] < 3.0))
        k = side[np.argmin(body.X[side, 1])]
        D = float(body.damage["cockcroft_latham"][k])
        if not mu:
            yield row("without friction", 0.0, D, 1e-4, "absolute")
            continue
        yield row(f"μ = {mu:g}, stretch of the surface after Lévy and Mises", stretched(last, side), D, 0.02)
        yield row(f"μ = {mu:g}, more than with less friction", before, D, 0.0, "at least")
        before = D
    yield from balance.rows()


def stretched(increment: Increment, side: Index) -> float:
    """∫⟨σ_θ⟩/σ̄ dε̄ = ⅔ (2 ε_θ + ε_z) at the equator of a free side of which nodes ``side`` are given.

    Lévy and Mises' flow on a surface without pressure, σ_r = 0, has σ_θ/σ̄ dε̄ = ⅔ (2 dε_θ + dε_z) (Kudo and Aoi 1967): of the
    hoop strain ε_θ and the strain ε_z along the surface, the quotient of heights of even powers of y, of displacements alone.
    """
    body = increment.bodies["billet"]
    Y, y = body.X[side, 1], body.x[side, 1]
    above = Y > 0.0
    slope = np.polynomial.Polynomial.fit(Y[above] ** 2, y[above] / Y[above], 2)(0.0)
    k = side[np.argmin(Y)]
    return 2.0 / 3.0 * (2.0 * math.log(body.x[k, 0] / body.X[k, 0]) + math.log(slope))


@case("upsetting, largest damage on new meshes", suite="forming")
def on_new_meshes(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The largest of the whole body, which the equator has: through new meshes beside one mesh, and one of half its size."""
    balance = Balance()

    def largest(size: float, way: float) -> tuple[float, float, int]:
        start = billet(0.1 * mu_scale, (round(10.0 / size), round(7.5 / size)), E_scale)
        last = balance.last(replace(
            start, bodies={"billet": replace(start.bodies["billet"], element="t6")},
            remesh=pr.Remesh(pr.Sizes(far=size), pr.When(quality=0.0, travel=way)),
        ))  # fmt: skip
        body = last.bodies["billet"]
        D = body.damage["cockcroft_latham"]
        return float(D.max()), float(body.x[np.argmax(D), 1]), last.remeshings

    (one, *_), (fine, *_), (renewed, height, meshes) = largest(1.25, 100.0), largest(0.625, 100.0), largest(1.25, 0.5)
    yield row("through new meshes, as on one mesh", one, renewed, 0.02)
    yield row("through new meshes, as on one mesh of half the size", fine, renewed, 0.02)
    yield row("height of its place (mm), that of the equator", 0.0, height, 0.6, "absolute")
    yield row("meshes", 4.0, float(meshes), 0.0, "at least")
    yield from balance.rows()


@case(
    "extrusion that bursts", suite="forming", slow=True,
    expected_warnings=("elements lie in the contact, forces step by", "is small against the elements"),
)  # fmt: skip
def bursting(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """A reduction of 10 % at a half angle of 30°, where bars burst along their axis: damage is largest there."""
    radius, angle = 5.0 * math.sqrt(0.9), math.tan(math.radians(30.0))
    outline = ((7.0, 1.0 + (7.0 - radius) / angle), (radius, 1.0), (radius, 0.0), (radius + 1.0, -20.0))
    mesh = pr.Wire(length=20.0, diameter=10.0, n=(30, 6), nose=pr.Nose(length=6.0, thickness=2.0 * radius - 0.1), front=-2.0)
    bar = pr.Body(mesh, pr.J2(200e3 * E_scale, 0.3, BILLET_FLOW), damage=(pr.CockcroftLatham(), pr.Oyane(A=0.1)))
    problem = pr.Problem(
        "extrusion", space="axisymmetric", bodies={"bar": bar},
        tools={"die": pr.Profile(outline, fillet=0.5, at=(0, 0))},
        contacts=(pr.Contact(("bar.right",), "die", pr.Shear(0.1 * mu_scale)),),
        steps=(pr.Step("push", by={"bar.bottom": pr.Motion(y=12.0)}),),
    )  # fmt: skip
    *_, last = pr.solve(problem)
    body = last.bodies["bar"]
    drawn = (body.x[:, 1] > 1.0) & (body.X[:, 1] < body.X[:, 1].max() - 7.0)  # without the nose, which fits the die
    for law, D in body.damage.items():
        yield row(f"{law}: radius of the largest", 0.0, float(body.X[np.argmax(D), 0]), 1e-9, "absolute")
    D = body.damage["cockcroft_latham"]
    core, skin = (D[drawn & side] for side in (body.X[:, 0] < 1e-9, body.X[:, 0] > 4.99))
    yield row("least on the axis over the largest of the skin", 3.0, float(core.min() / skin.max()), 0.0, "at least")
    force, _ = imbalance(discretise(problem), last)
    yield row("forces out of balance / largest force", 0.0, force, BALANCE_TOLERANCE, "absolute")
