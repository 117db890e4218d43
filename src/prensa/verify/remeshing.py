"""Runs with remeshing, against closed forms, runs on one mesh, an independent solver and an upper bound."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

import prensa as pr
from prensa import reference as ref
from prensa.reference import tables
from prensa.verify.balance import Balance
from prensa.verify.forming import BILLET_FLOW, NU, REDUCTIONS, E, at, curve, upsetting
from prensa.verify.table import Row, case, row

TEN = 3.75 / 12  # way between two meshes of which ten are made on it


def billet(mu: float, E_scale: float, remesh: pr.Remesh) -> pr.Problem:
    """The upsetting problem with T6."""
    p = upsetting((8, 6), mu, E_scale=E_scale)
    return replace(p, bodies={"billet": replace(p.bodies["billet"], element="t6")}, remesh=remesh)


@case("frictionless upsetting on ten meshes", suite="forming")
def homogeneous(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The homogeneous solution comes through ten meshes."""
    balance = Balance()
    p = billet(0.0, E_scale, pr.Remesh(size=pr.Sizes(far=1.6), when=pr.When(quality=0.0, travel=TEN)))
    history = list(balance.watch(p))
    for r, inc in zip(REDUCTIONS, at(REDUCTIONS, history), strict=True):
        exact = ref.upset_cylinder(r, R=10.0, flow=curve(BILLET_FLOW), E=E, nu=NU, yield_on="cauchy")
        yield row(f"force at {r:.0%}", float(exact.force), inc.force("punch").y, 1e-4)
    yield row("meshes", 10.0, float(history[-1].remeshings), 0.0, "at least")
    yield from balance.rows()


@case("upsetting with friction on ten meshes", suite="forming", slow=True)
def rubbed(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Against the same run on one mesh of the same sizes, and the independent solver's forces."""
    balance = Balance()
    size = pr.Sizes(far=0.8, near_tools=0.2)
    for mu, allowed in ((0.1, (1e-3, 3e-3)), (0.3, (1e-2, 1e-2))):
        one, ten = (
            at(REDUCTIONS, list(balance.watch(billet(mu_scale * mu, E_scale, pr.Remesh(size, pr.When(0.0, way))))))
            for way in (100.0, TEN)
        )
        for r, a, b, within in zip((0.4, 0.5), one[3:], ten[3:], allowed):
            yield row(f"mu = {mu:g}: force at {r:.0%}, as on one mesh", a.force("punch").y, b.force("punch").y, within)
        if mu == 0.1:
            for r, inc in zip(REDUCTIONS[:3], ten):
                known = 1e3 * tables.UPSETTING_FORCE_MU_01["cauchy"][r]
                yield row(f"mu = {mu:g}: force at {r:.0%}", known, inc.force("punch").y, 2e-3)
    yield from balance.rows()


def can(E_scale: float, mu_scale: float, remesh: pr.Remesh, depth: float = 6.0) -> pr.Problem:
    """A punch of radius 6 with a fillet of 1 in a billet of radius and height 10 in a container."""
    metal = pr.J2(70e3 * E_scale, 0.33, pr.Swift(200.0, 0.01, 0.2))
    tools = {
        "punch": pr.Stamp(width=12.0, fillet=1.0, touching="billet.top"),
        "wall": pr.Plane(touching="billet.right"), "bottom": pr.Plane(touching="billet.bottom"),
    }  # fmt: skip
    contacts = (
        pr.Contact(("billet.top",), "punch"), pr.Contact(("billet.right", "billet.top"), "wall"),
        pr.Contact(("billet.bottom",), "bottom"),
    )  # fmt: skip
    return pr.Problem(
        "can", {"billet": pr.Body(pr.Rectangle((10.0, 10.0), (10, 10)), metal, "t6")},
        (pr.Step("press", move={"punch": pr.Motion(y=-depth)}),), tools, contacts, friction=pr.Coulomb(0.1 * mu_scale),
        fixed={"billet.left": "x"}, space="axisymmetric", remesh=remesh,
    )  # fmt: skip


def bound(stroke: float) -> float:
    """The upper bound of the can's force: flow stress at Dipper's strain, m = 0.43 (μ = 0.1 under 2.5 flow stresses)."""
    left = 10.0 - stroke
    strain = ref.can_strain(10.0, 6.0, 10.0, left)
    return ref.can_upper_bound(10.0, 6.0, left, 200.0 * (0.01 + strain) ** 0.2, 0.43)


@case("backward extrusion of a can", suite="forming", slow=True)
def extrusion(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """To 6 of 10 mm with two densities of elements: below the upper bound, and alike."""
    balance, forces, depths = Balance(), [], (1.0, 2.0, 4.0, 6.0)
    for size in (pr.Sizes(far=0.6, near_tools=0.3, per_radius=12.0), pr.Sizes(far=0.45, near_tools=0.22, per_radius=16.0)):
        history = list(balance.watch(can(E_scale, mu_scale, pr.Remesh(size))))
        way = -np.array([i.tools["punch"].place.y for i in history])
        forces.append(np.interp(depths, way, [i.force("punch").y for i in history]))
        yield row(f"far = {size.far:g}: stroke", 6.0, float(way[-1]), 1e-12)
        lost = abs(history[-1].energy["imbalance"]) / history[-1].energy["external"]
        yield row(f"far = {size.far:g}: imbalance of energies", 5e-3, lost, 0.0, "at most")
    for depth, force in zip(depths, forces[-1]):
        yield row(f"force at {depth:g} mm, an upper bound", bound(depth), float(force), 0.0, "at most")
    yield row("force at 4 mm on both densities", float(forces[1][2]), float(forces[0][2]), 1e-2)
    yield from balance.rows()
