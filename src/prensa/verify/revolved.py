"""Forging and extrusion of bodies of revolution on new meshes: least powers of all velocities on the shapes they go through."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import prensa as pr
from prensa import reference as ref
from prensa.result.increment import Increment
from prensa.verify.balance import Balance
from prensa.verify.deep import linear_triangles
from prensa.verify.table import Row, case, row

FLOW_STRESS = 200.0
FILLED = 0.92  # of the stroke of the gear blank
METAL = pr.Perfect(FLOW_STRESS)


def least_power(inc: Increment, moving: str, symmetric: bool = False, closed: int = 2) -> float:
    """Bound of the force on the tool ``moving`` along y in smooth contacts, on the shape of an increment.

    symmetric: whether y = 0 is a plane of symmetry. closed: ends of a side that are closed, from which on a wall holds it; where
    one of them is, the truth lies between 1, an upper bound for certain, and 2.
    """
    used, points, triangles = linear_triangles(inc)
    points[np.abs(points[:, 0]) < 1e-9, 0] = 0.0
    edges = ref.outline(triangles)
    walls, taken = [], (points[edges][:, :, 0] == 0.0).all(axis=1)
    if symmetric:
        on = (np.abs(points[edges][:, :, 1]) < 1e-9).all(axis=1) & ~taken
        walls.append(ref.Wall(edges[on]))
        taken |= on
    for name, contact in inc.contacts.items():
        pressed = np.isin(used[edges], contact.node[contact.status > 0]).sum(axis=1) >= closed
        pressed &= ~taken
        speed = (0.0, -1.0) if name.endswith(f"-{moving}") else (0.0, 0.0)
        walls.append(ref.Wall(edges[pressed], speed))
        taken |= pressed
    return ref.axisymmetric_bound(points, triangles, FLOW_STRESS, walls)


def compared(
    balance: Balance, problem: pr.Problem, tool: str, times: tuple[float, ...], symmetric: bool = False,
    later: tuple[float, ...] = (),
) -> Iterator[Row]:  # fmt: skip
    """Rows of the force on a tool at some times beside the bound on the shapes there.

    later: times at which further sides come to the tool one after the other.
    """
    to_do, ratios, most = [*times, *later], [], []
    for inc in balance.watch(problem):
        if to_do and inc.time >= to_do[0] - 1e-9:
            to_do.pop(0)
            ratios.append(inc.force(tool).y / least_power(inc, tool, symmetric))
            most.append(inc.force(tool).y / least_power(inc, tool, symmetric, closed=1))
    wanted = float(len(times) + len(later))
    yield row(f"{problem.name}: shapes on which forces are compared", wanted, float(len(ratios)), 0.0, "at least")
    ratios, filling = ratios[: len(times)], ratios[len(times) :]
    yield row(f"{problem.name}: force over its bound, mean", 1.0, float(np.mean(ratios)), 5e-2)
    yield row(f"{problem.name}: least of them", 0.92, float(np.min(ratios)), 0.0, "at least")
    # only these are bounds for certain: as the next node of a side closes, the other goes from 1.03 to 0.98 of the force at once
    yield row(f"{problem.name}: over the bound with all sides held that touch", 1.005, float(np.max(most)), 0.0, "at most")
    if filling:
        yield row(f"{problem.name}: force over its bound while it fills, mean", 1.0, float(np.mean(filling)), 5e-2)


def gear_blank(E_scale: float) -> pr.Problem:
    """Half of a billet in a die with hub, web and rim, without friction, until the rim is nearly full."""
    points = ((-20, 10), (6.5, 10), (8, 3.5), (15.5, 3.5), (17, 8), (22, 8), (24, 0), (60, 0))
    die = pr.Profile(points=points, fillet=(0, *[1.5] * 6, 0), above="billet.top")
    return pr.Problem(
        "gear blank", {"billet": pr.Body(pr.Rectangle((14.0, 19.0), (8, 10)), pr.J2(200e3 * E_scale, 0.3, METAL), "t6")},
        (pr.Step("forge", move={"die": pr.Motion(y=-14.7 * FILLED)}),), {"die": die},
        fixed={"billet.left": "x", "billet.bottom": "y"}, space="axisymmetric",
        remesh=pr.Remesh(pr.Sizes(far=1.6, near_tools=0.7, per_radius=8.0)),
    )  # fmt: skip


def head(E_scale: float) -> pr.Problem:
    """A bolt whose shank stays in the die while its head is upset, without friction."""
    tools = {
        "punch": pr.Plane(normal=(0.0, -1.0), touching="bolt.top"),
        "die": pr.Profile(points=((60, 8), (5, 8), (5, -40)), fillet=(0, 1, 0), at=(0.0, 0.0)),
        "ejector": pr.Plane(normal=(0.0, 1.0), touching="bolt.bottom"),
    }
    contacts = (
        pr.Contact(("bolt.top", "bolt.right"), "punch"), pr.Contact(("bolt.right",), "die"),
        pr.Contact(("bolt.bottom",), "ejector"),
    )  # fmt: skip
    return pr.Problem(
        "heading", {"bolt": pr.Body(pr.Rectangle((5.0, 18.0), (5, 18)), pr.J2(200e3 * E_scale, 0.3, METAL), "t6")},
        (pr.Step("head", move={"punch": pr.Motion(y=-6.5)}),), tools, contacts, fixed={"bolt.left": "x"},
        space="axisymmetric", remesh=pr.Remesh(pr.Sizes(far=1.0, near_tools=0.7, per_radius=4.0)),
    )  # fmt: skip


def two_ways(E_scale: float) -> pr.Problem:
    """A punch above a bore: metal flows up around the one and down through the other, without friction."""
    tools = {
        "punch": pr.Stamp(width=12.0, fillet=1.0, touching="billet.top"), "wall": pr.Plane(touching="billet.right"),
        "die": pr.Profile(points=((60, 0), (4, 0), (4, -30)), fillet=(0, 1, 0), at=(0.0, 0.0)),
    }  # fmt: skip
    contacts = (
        pr.Contact(("billet.top",), "punch"), pr.Contact(("billet.right", "billet.top"), "wall"),
        pr.Contact(("billet.bottom",), "die"),
    )  # fmt: skip
    return pr.Problem(
        "combined", {"billet": pr.Body(pr.Rectangle((10.0, 8.0), (8, 6)), pr.J2(200e3 * E_scale, 0.3, METAL), "t6")},
        (pr.Step("press", move={"punch": pr.Motion(y=-2.0)}),), tools, contacts, fixed={"billet.left": "x"},
        space="axisymmetric", remesh=pr.Remesh(pr.Sizes(far=1.3, near_tools=0.8, per_radius=5.0)),
    )  # fmt: skip


@case("a gear blank, a head, an extrusion two ways", suite="forming", slow=True)
def revolved(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Forces on the way beside the least power of all velocity fields on the shapes that the runs go through."""
    balance = Balance()
    before, filling = np.array([0.3, 0.6, 0.8]) / FILLED, np.array([0.82, 0.84, 0.86, 0.88, 0.9, 0.92]) / FILLED
    yield from compared(balance, gear_blank(E_scale), "die", tuple(before), symmetric=True, later=tuple(filling))
    yield from compared(balance, head(E_scale), "punch", (0.3, 0.7, 1.0))
    yield from compared(balance, two_ways(E_scale), "punch", (0.3, 0.6, 1.0))
    yield from balance.rows()
