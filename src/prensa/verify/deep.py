"""Deep forming on new meshes against what plasticity theory knows: a wedge's slip lines, limit loads, an upper bound."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import prensa as pr
from prensa import reference as ref
from prensa.geometry.plane import cross
from prensa.result.increment import Increment
from prensa.types import Array, Index
from prensa.verify.balance import Balance
from prensa.verify.remeshing import bound, can
from prensa.verify.table import Row, case, row

SHEAR_STRENGTH = 200.0 / np.sqrt(3.0)  # shear yield stress of what flows at 200 MPa


def section(inc: Increment) -> float:
    """Area of the section of the only body, by the polygon of each T6's nodes."""
    (body,) = inc.bodies.values()
    x = body.x[body.cells[:, [0, 3, 1, 4, 2, 5]]]
    y = np.roll(x, -1, axis=1)
    return float(0.5 * cross(x, y).sum())


def blunt_wedge(tip: float, E_scale: float) -> pr.Problem:
    """A smooth wedge of semi-angle 45° with a tip of radius ``tip`` into half of a block of 24 × 16."""
    metal = pr.J2(700e3 * E_scale, 0.3, pr.Perfect(200.0))
    wedge = pr.Profile(points=((-40, 40), (0, 0), (40, 40)), fillet=(0, tip, 0), above="block.top")
    return pr.Problem(
        "wedge", {"block": pr.Body(pr.Rectangle((24.0, 16.0), (12, 9), origin=(0.0, -16.0)), metal, "t6")},
        (pr.Step("press", move={"wedge": pr.Motion(y=-3.5)}),), {"wedge": wedge}, (pr.Contact(("block.top",), "wedge"),),
        fixed={"block.bottom": "xy", "block.left": "x"},
        remesh=pr.Remesh(pr.Sizes(far=2.5, near_tools=0.35, per_radius=2.0, per_strain=0.0), pr.When(0.2, 0.3)),
    )  # fmt: skip


@case("indentation by a wedge", suite="forming", slow=True)
def wedged(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Force, its growth with depth, width of the contact: slip lines of Hill, Lee and Tupper, from a sharp tip on."""
    balance, tip = Balance(), 0.3
    pressure, width, _ = ref.wedge_indentation(np.radians(45.0), SHEAR_STRENGTH)
    history = list(balance.watch(blunt_wedge(tip, E_scale)))
    depth = tip * (np.sqrt(2) - 1) - np.array([i.tools["wedge"].place.y for i in history])
    force = np.array([i.force("wedge").y for i in history])
    late = depth > 1.8
    yield row("force over depth, mean of the second half", pressure * width, float((force / depth)[late].mean()), 6e-2)
    yield row("growth of the force with depth", pressure * width, float(np.polyfit(depth[late], force[late], 1)[0]), 5e-2)
    contact = history[-1].contacts["block.top-wedge"]
    reach = float(contact.x[contact.status > 0, 0].max())
    yield row("half width of the contact", width * depth[-1], reach, 5e-2)
    yield row("section", section(history[0]), section(history[-1]), 2e-3)
    yield from balance.rows()


def flash_die(E_scale: float) -> pr.Problem:
    """A block that fills a smooth cavity 20 wide and is then squeezed through a gap that closes to 0.9, a quarter of it."""
    wide, deep, land = 10.0, 4.0, 4.0
    points = ((-20.0, deep), (wide, deep), (wide, 0.0), (wide + land, 0.0), (wide + land + 3, 6.0), (60.0, 6.0))
    metal = pr.J2(200e3 * E_scale, 0.3, pr.Perfect(200.0))
    half = 8.0
    height = (wide * (deep + 1.5) + 1.0) / half  # full when the gap is 1.5
    return pr.Problem(
        "flash", {"billet": pr.Body(pr.Rectangle((half, height), (8, 9)), metal, "t6")},
        (pr.Step("forge", move={"die": pr.Motion(y=-(height - deep - 0.9))}),),
        {"die": pr.Profile(points=points, fillet=(0, 1.0, 0.6, 0.5, 0, 0), above="billet.top")},
        (pr.Contact(("billet.top", "billet.right"), "die"),),
        space="plane strain", fixed={"billet.left": "x", "billet.bottom": "y"},
        remesh=pr.Remesh(size=pr.Sizes(far=1.0, near_tools=0.5, per_radius=4.0)),
    )  # fmt: skip


def linear_triangles(inc: Increment) -> tuple[Index, Array, Index]:
    """Nodes (n,) of the only body's, their places (n, 2) and linear triangles (t, 3) of them: four of each quadratic one.

    On one of each alone bounds are 3 % higher, and scatter with the mesh of the run.
    """
    (body,) = inc.bodies.values()
    used, number = np.unique(body.cells, return_inverse=True)
    triangles = number.reshape(-1, 6)[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]].reshape(-1, 3)
    return used, body.x[used], triangles


def limit_load(inc: Increment, contact: str) -> float:
    """Bound of the force that moves the tool of a smooth contact down, on the shape of an increment; symmetry at x = 0, y = 0."""
    used, x, triangles = linear_triangles(inc)
    edges = ref.outline(triangles)
    on_axis = [(np.abs(x[edges][:, :, axis]) < 1e-9).all(axis=1) for axis in (0, 1)]
    c = inc.contacts[contact]
    pressed = np.isin(used[edges], c.node[c.status > 0]).all(axis=1) & ~on_axis[0] & ~on_axis[1]
    walls = [*(ref.Wall(edges[on]) for on in on_axis), ref.Wall(edges[pressed], (0.0, -1.0))]
    return ref.plane_strain_bound(x, triangles, SHEAR_STRENGTH, walls)


@case("a closed die filled to its flash", suite="forming", slow=True)
def forged(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Force while the flash is squeezed out: the least power of all velocities on the shapes that the run goes through."""
    balance, gaps, pairs, first, inc = Balance(), [1.4, 1.2, 1.05, 0.9], [], 0.0, None
    problem = flash_die(E_scale)
    closed = float(problem.bodies["billet"].mesh.size[1]) - 4.0
    for inc in balance.watch(problem):
        first = first or section(inc)
        if gaps and closed + inc.tools["die"].place.y <= gaps[0] + 1e-9:
            gaps.pop(0)
            pairs.append((limit_load(inc, "billet.top+billet.right-die"), inc.force("die").y))
    assert inc is not None
    bounds, forces = np.array(pairs).T
    yield row("shapes on which forces are compared", 4.0, float(len(pairs)), 0.0, "at least")
    yield row("mean force, an upper bound", float(bounds.mean()), float(forces.mean()), 5e-2)
    yield row("largest difference of one of them", 0.0, float(np.abs(forces / bounds - 1).max()), 6e-2, "absolute")
    yield row("reach of the flash", 13.0, float(inc.bodies["billet"].x[:, 0].max()), 0.0, "at least")
    yield row("section", first, section(inc), 5e-3)
    yield from balance.rows()


@case("a punch 80 % deep in a billet", suite="forming", slow=True)
def pierced(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """A can whose bottom has a fifth of the billet's height: below the upper bound all the way, nothing lost."""
    balance = Balance()
    problem = can(E_scale, mu_scale, pr.Remesh(pr.Sizes(far=1.0, near_tools=0.7, per_radius=5.0)), depth=8.0)
    history = list(balance.watch(problem))
    way = -np.array([i.tools["punch"].place.y for i in history])
    forces = np.interp((4.0, 6.0, 8.0), way, [i.force("punch").y for i in history])
    yield row("stroke", 8.0, float(way[-1]), 1e-12)
    for depth, force in zip((4.0, 6.0, 8.0), forces):
        yield row(f"force at {depth:g} mm, an upper bound", bound(depth), float(force), 0.0, "at most")
    lost = abs(history[-1].energy["imbalance"]) / history[-1].energy["external"]
    yield row("imbalance of energies", 5e-3, lost, 0.0, "at most")
    volumes = [sum(float(b.volume.sum()) for b in pr.discretise(problem).blocks)]
    assert history[-1].state.remeshed is not None
    volumes.append(sum(float(v.sum()) for v in history[-1].state.remeshed.volume.values()))
    yield row("initial volume of what is there at the end", volumes[0], volumes[1], 2e-4)
    yield from balance.rows()
