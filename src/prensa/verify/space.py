"""Bodies in space: billet, cylinder, ring upset with friction, exact contact, a ball, a plate between rollers, a twisted bar.

References: tables of an independent program of bricks with F-bar (`prensa.reference.tables`), whose billet has the same uniform
meshes; a second program (CalculiX, C3D20R) is within 0.1 % of its limit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

import prensa as pr
from prensa.reference import tables
from prensa.result.increment import Increment
from prensa.verify.rates import convergence, order_row, order_rows, root_mean_square
from prensa.verify.table import Row, case, row

BILLET = (10.0, 7.5, 10.0)
"""An eighth (mm) of 20 x 20 x 15."""


def billet(n: int, mu: float, E_scale: float = 1.0) -> pr.Problem:
    """An eighth of a square billet, n x 0.75 n x n bricks, upset by 30 % between planes onto which its sides may fold."""
    return pr.Problem(
        "billet", space="solid", friction=pr.Coulomb(mu),
        bodies={"billet": pr.Body(
            pr.Box(BILLET, (n, 3 * n // 4, n)), pr.J2(200_000.0 * E_scale, 0.3, pr.Ludwik(s0=250.0, K=500.0, n=0.3)))},
        tools={"plate": pr.Plane(touching="billet.top")},
        contacts=(pr.Contact(("billet.top", "billet.right", "billet.front"), "plate"),),
        fixed={"billet.left": "x", "billet.back": "z", "billet.bottom": "y"},
        steps=tuple(
            pr.Step(f"to {k} %", move={"plate": pr.Motion(y=-0.01 * k * BILLET[1])}, increments=5) for k in range(5, 35, 5)),
    )  # fmt: skip


def imbalance(increment: Increment) -> float:
    """Sum of the forces of tools and supports over the largest of the tools."""
    tools = np.array([t.force[:3] for t in increment.tools.values()])
    rest = tools.sum(axis=0) - np.sum([list(f) for f in increment.supports.values()], axis=0)
    return float(np.abs(rest).max() / np.abs(tools).max())


def ends_of_steps(p: pr.Problem) -> tuple[list[Increment], float]:
    """The increments at which steps end, and the largest imbalance of all increments."""
    increments = list(pr.solve(p))
    return [i for i in increments if i.end_of_step], max(map(imbalance, increments))


@case("square billet, upset with friction", suite="space")
def square_billet(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Force of the whole billet on a mesh of 8 x 6 x 8 bricks, every 5 % to 30 %, mu = 0.1 and 0.3; orders and limits.

    The plate's edge is singular where metal sticks there, which leaves an order between 1 and 2. With mu = 0.3 sides fold onto
    the plate brick by brick, so that forces scatter from mesh to mesh: orders fall from 10 % on, and from 20 % on there is none.
    """
    imbalances, meshes = [], (4, 8, 12)
    for mu, forces in tables.SQUARE_BILLET_FORCE.items():
        limits, little = tables.SQUARE_BILLET_LIMIT[mu], mu < 0.2
        found: list[list[float]] = []
        for n in meshes:
            p = billet(n, mu * mu_scale, E_scale)
            ends, off = ends_of_steps(p if little or n == 8 else replace(p, steps=p.steps[:4]))
            imbalances.append(off)
            found.append([4e-3 * abs(i.force("plate").y) for i in ends])
        for k, force in enumerate(forces):
            tolerance = 0.005 if little or k < 4 else 0.01  # beyond 20 % the plate's edge sticks and sides fold one by one
            name = f"mu = {mu:g}: F (kN) at {5 * k + 5} %"
            yield row(name, force, found[1][k], tolerance)
            if k >= len(found[0]):
                continue
            of_meshes = [f[k] for f in found]
            yield order_row(name, meshes, of_meshes, 1.0, "at least" if k < len(limits) else "report")
            if k < len(limits):
                certain = (0.001 if k < 5 else 0.0015) if little else (0.002, 0.003)[k]
                yield row(f"{name}, extrapolated", limits[k], convergence(meshes, of_meshes).limit, certain)
    yield row("plate and supports out of balance", 0.0, max(imbalances), 1e-8, "absolute")


def confined(enforcement: pr.Penalty | pr.Augmented | pr.Exact, E_scale: float) -> pr.Problem:
    """A block 2 x 1.5 x 2 of distorted bricks, whose sides cannot spread, pressed by 0.001 with friction."""
    grid = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(27).reshape(3, 3, 3)
    face = ((0, 0), (1, 0), (1, 1), (0, 1))
    cells = np.stack([number[i : 2 + i, j : 2 + j, k : 2 + k] for k in (0, 1) for i, j in face], axis=-1).reshape(-1, 8)
    x = grid * np.array([1.0, 0.75, 1.0]) + 0.15 * (grid == 1) * np.array([1.0, -1.0, -0.5])
    ends = {"left": (0, 0), "right": (0, 2), "bottom": (1, 0), "top": (1, 2), "back": (2, 0), "front": (2, 2)}
    sides = {name: tuple(np.flatnonzero(grid[:, axis] == end).tolist()) for name, (axis, end) in ends.items()}
    mesh = pr.Bricks(tuple(map(tuple, x.tolist())), tuple(map(tuple, cells.tolist())), sides)
    return pr.Problem(
        "confined", space="solid", kinematics="small", contact_geometry="reference", friction=pr.Coulomb(0.2),
        bodies={"b": pr.Body(mesh, pr.Elastic(1000.0 * E_scale, 0.3), "h8")}, tools={"t": pr.Plane(touching="b.top")},
        contacts=(pr.Contact("b.top", "t", enforcement=enforcement),),
        fixed={"b.bottom": "y", "b.left": "x", "b.right": "x", "b.back": "z", "b.front": "z"},
        steps=(pr.Step("press", move={"t": pr.Motion(y=-0.001)}, increments=1),),
    )  # fmt: skip


@case("exact enforcement in space", suite="space")
def exact(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Pressure (lambda + 2 mu) d/H on a block that cannot spread, the default 1 % less; a billet, which penalties approach."""
    expected, off = 1000.0 * 0.7 / (1.3 * 0.4) * 0.001 / 1.5, 0.0
    for enforcement, tolerance in ((pr.Exact(), 1e-10), (pr.Penalty(), 0.01)):
        (inc,) = pr.solve(confined(enforcement, E_scale))
        (pressure,) = (c.pressure for c in inc.contacts.values())
        worst = float(pressure[np.argmax(np.abs(pressure - expected))])
        yield row(f"{enforcement.type}: pressure farthest from the uniform one", expected, worst, tolerance)
        off = max(off, imbalance(inc))
    press = pr.Step("press", move={"plate": pr.Motion(y=-0.1 * BILLET[1])}, increments=4)
    forces: list[float] = []
    for enforcement in (pr.Exact(), pr.Penalty(), pr.Penalty(1000.0, 30.0)):
        p = billet(4, 0.3 * mu_scale, E_scale)
        p = replace(p, contacts=tuple(replace(c, enforcement=enforcement) for c in p.contacts), steps=(press,))
        *_, inc = pr.solve(p)
        off = max(off, imbalance(inc))
        forces.append(abs(inc.force("plate").y))
        if enforcement == pr.Exact():
            gaps = [float(np.abs(c.gap[c.pressure > 0]).max(initial=0.0)) for c in inc.contacts.values()]
            yield row("billet, exact: largest gap of closed points / h", 0.0, max(gaps) / (BILLET[1] / 3.0), 1e-12, "absolute")
    yield row("billet, penalty: F against exact", forces[0], forces[1], 1e-4)
    yield row("billet, penalty ten times as stiff: F against exact", forces[0], forces[2], 1e-5)
    yield row("plate and supports out of balance", 0.0, off, 1e-8, "absolute")


def pressed_by_ball(n: int, E_scale: float, mu_scale: float) -> pr.Problem:
    """A ball of the block's height pressed into a quarter of a block of n³ graded bricks."""
    return pr.Problem(
        "block", space="solid", friction=pr.Coulomb(0.3 * mu_scale),
        bodies={"block": pr.Body(
            pr.Box((10.0,) * 3, (n,) * 3, toward=(0.0, 10.0, 0.0), ratio=4.0), pr.NeoHooke(1000.0 * E_scale, 0.3), "h8")},
        tools={"ball": pr.Revolved(pr.Circle(10.0), touching="block.top", at=(0.0, 0.0, 0.0))},
        contacts=(pr.Contact("block.top", "ball"),),
        fixed={"block.left": "x", "block.back": "z", "block.bottom": "xyz"},
        steps=tuple(
            pr.Step(f"to {y:g}", move={"ball": pr.Motion(y=-y)}, increments=2) for y in tables.BLOCK_SPHERE_FORCE),
    )  # fmt: skip


@case("rigid sphere on a block at large strain", suite="space")
def sphere(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """A ball of the block's height pressed into neo-Hooke with mu = 0.3: force by depth on 16 bricks a side; orders in n.

    Nodes come into contact one by one, so that the force at one depth scatters with n; its errors at all depths fall together.
    """
    meshes, imbalances, found = (4, 6, 8, 12, 16), [], []
    for n in meshes:
        ends, off = ends_of_steps(pressed_by_ball(n, E_scale, mu_scale))
        imbalances.append(off)
        found.append([4.0 * abs(i.force("ball").y) for i in ends])
    names = [f"P (N) at {depth:g} mm" for depth in tables.BLOCK_SPHERE_FORCE]
    for name, force, ours in zip(names, tables.BLOCK_SPHERE_FORCE.values(), found[-1], strict=True):
        yield row(name, force, ours, 0.005)
    yield from order_rows(names, meshes, found, 2.0)
    errors = [root_mean_square(np.divide(f, list(tables.BLOCK_SPHERE_FORCE.values())) - 1.0) for f in found]
    order = -float(np.polyfit(np.log(meshes), np.log(errors), 1)[0])
    yield row("P: order of the r.m.s. of the differences from the reference at all depths", 1.0, order, 0.0, "at least")
    yield row("ball and supports out of balance", 0.0, max(imbalances), 1e-8, "absolute")


def bent_plate(n: int, E_scale: float) -> pr.Problem:
    """Three-point bending of a quarter of a plate of enhanced bricks, n through its thickness, short at the lines of contact."""
    section = pr.Rectangle((50.0, 10.0), (5 * n // 2, n), grade=pr.Grade(x=(0.0, 40.0), y=(0.0, 10.0), ratio=30.0))
    mesh = pr.Extrusion(section, 20.0, n // 4, grade="cap", ratio=3.0)
    return pr.Problem(
        "plate", space="solid", bodies={"plate": pr.Body(mesh, pr.Elastic(200_000.0 * E_scale, 0.3), "h8_enhanced")},
        tools={
            "punch": pr.Extruded(pr.Circle(5.0), touching="plate.top", at=(0.0, 0.0, 0.0)),
            "roller": pr.Extruded(pr.Circle(5.0), touching="plate.bottom", at=(40.0, 0.0, 0.0)),
        },
        contacts=(pr.Contact("plate.top", "punch"), pr.Contact("plate.bottom", "roller")),
        fixed={"plate.left": "x", "plate.base": "z"},
        steps=tuple(pr.Step(f"to {y:g}", move={"punch": pr.Motion(y=-y)}, increments=1) for y in tables.THICK_PLATE),
    )  # fmt: skip


def force_and_deflections(increment: Increment) -> tuple[float, ...]:
    """Force of the whole plate (N); deflections of its bottom, middle and edge, and of its end (mm)."""
    body = increment.bodies["plate"]
    x, y, z = body.X.T
    bottom, end = (x == 0.0) & (y == 0.0), (x == 50.0) & (y == 10.0)
    places = (bottom & (z == 0.0), bottom & (z == 20.0), end)
    return 4.0 * abs(increment.force("punch").y), *(float(body.displacement[nodes, 1].mean()) for nodes in places)


@case("thick plate bent between rollers", suite="space", expected_warnings=("times longer than wide",))
def plate(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Force, extrapolated with its observed order from 4, 8 and 16 bricks through the thickness; deflections of the finest mesh.

    The place at which the plate leaves a roller jumps from node to node, which orders of deflections show.
    """
    meshes, imbalances, found = (4, 8, 16), [], []
    for n in meshes:
        ends, off = ends_of_steps(bent_plate(n, E_scale))
        imbalances.append(off)
        found.append([force_and_deflections(i) for i in ends])
    for k, (travel, (force, certain, *lifts)) in enumerate(tables.THICK_PLATE.items()):
        results = [of_mesh[k] for of_mesh in found]
        names = [f"P (N) at {travel:g} mm", *(f"deflection at {travel:g} mm, {p} (mm)" for p in ("middle", "edge", "end"))]
        forces = [r[0] for r in results]
        yield row(f"{names[0]}, extrapolated", force, convergence(meshes, forces).limit, certain)
        for name, exact, ours in zip(names, (force, *lifts), results[-1], strict=True):
            yield row(name, exact, ours, certain if name == names[0] else 0.005)
        yield order_row(names[0], meshes, forces, 1.0, "at least")
        yield from order_rows(names[1:], meshes, [r[1:] for r in results], 1.0)
    yield row("rollers and supports out of balance", 0.0, max(imbalances), 1e-8, "absolute")


def cylinder(space: str, n: int = 0, core: str | None = None, E_scale: float = 1.0, mu: float = 0.2) -> pr.Problem:
    """Half a cylinder's height, upset by 20 % with friction: axisymmetric, or a quarter of it in n layers of bricks."""
    section = pr.Rectangle((10.0, 7.5), (6, 5))
    solid = space == "solid"
    mesh = pr.Revolution(section, n, angle=0.5 * np.pi, core=core) if solid else section
    return pr.Problem(
        "cylinder", space=space, friction=pr.Coulomb(mu),
        bodies={"b": pr.Body(mesh, pr.J2(200_000.0 * E_scale, 0.3, pr.Ludwik(s0=250.0, K=500.0, n=0.3)))},
        tools={"plate": pr.Plane(touching="b.top")}, contacts=(pr.Contact(("b.top", "b.right"), "plate"),),
        fixed={"b.bottom": "y"} | ({"b.base": "z", "b.cap": "x"} if solid else {}),
        steps=(pr.Step("press", move={"plate": pr.Motion(y=-1.5)}, increments=6),),
    )  # fmt: skip


@case("quarter of a cylinder, upset with friction", suite="space")
def quarter_of_a_cylinder(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Force of the whole, with bricks of either kind at the axis, against the axisymmetric run with the same section.

    Chords of a circle cut off a share of its area that goes with the square of their angle: so does the difference.
    """
    *_, flat = pr.solve(cylinder("axisymmetric"))
    exact = flat.force("plate").y
    for core in ("square", "wedges"):
        forces = []
        for n in (4, 8):
            *_, solid = pr.solve(cylinder("solid", n, core, E_scale, 0.2 * mu_scale))
            forces.append(4.0 * solid.force("plate").y)
        yield row(f"{core}: F (kN), angle extrapolated", 1e-3 * exact, 1e-3 * (4.0 * forces[1] - forces[0]) / 3.0, 0.001)
        yield row(f"{core}: order in the angle", 2.0, float(np.log2((forces[0] - exact) / (forces[1] - exact))), 0.05)
        yield row(f"{core}: plate and supports out of balance", 0.0, imbalance(solid), 1e-8, "absolute")


def ring(space: str, n: int = 0, E_scale: float = 1.0, m: float = 0.3) -> pr.Problem:
    """Half a ring's height (6 : 3 : 3.5), upset by 20 % with a shear factor: axisymmetric, or a quarter in n layers of bricks."""
    section = pr.Rectangle((3.0, 3.5), (4, 4), origin=(3.0, 0.0))
    solid = space == "solid"
    mesh = pr.Revolution(section, n, angle=0.5 * np.pi) if solid else section
    return pr.Problem(
        "ring", space=space, friction=pr.Shear(m),
        bodies={"b": pr.Body(mesh, pr.J2(200_000.0 * E_scale, 0.3, pr.Ludwik(s0=250.0, K=500.0, n=0.3)))},
        tools={"plate": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "plate"),),
        fixed={"b.bottom": "y"} | ({"b.base": "z", "b.cap": "x"} if solid else {}),
        steps=(pr.Step("press", move={"plate": pr.Motion(y=-0.7)}, increments=4),),
    )  # fmt: skip


def of_whole(last: Increment, share: float) -> tuple[float, float, float]:
    """Force of a ring's plate (kN) and work of friction (J), ``share`` times those of the model, and its bore at half height."""
    body = last.bodies["b"]
    inner = (body.X[:, 1] == 0.0) & (np.abs(np.hypot(body.X[:, 0], body.X[:, 2:].sum(axis=1)) - 3.0) < 1e-9)
    bore = float(np.hypot(body.x[inner, 0], body.x[inner, 2:].sum(axis=1)).mean())
    return 1e-3 * share * last.force("plate").y, 1e-3 * share * last.energy["friction"], bore


@case("quarter of a ring, upset with a shear factor", suite="space")
def quarter_of_a_ring(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Friction by the metal's own shear yield stress on sides that spread, against the axisymmetric run with the same section."""
    *_, flat = pr.solve(ring("axisymmetric"))
    found = []
    for n in (4, 8):
        *_, solid = pr.solve(ring("solid", n, E_scale, 0.3 * mu_scale))
        found.append(of_whole(solid, 4.0))
    names = ("F (kN)", "friction (J)", "bore (mm)")
    for name, exact, coarse, fine in zip(names, of_whole(flat, 1.0), *found, strict=True):
        yield row(f"{name}, angle extrapolated", exact, (4.0 * fine - coarse) / 3.0, 0.001)
        yield row(f"{name}: order in the angle", 2.0, float(np.log2((coarse - exact) / (fine - exact))), 0.05)
    yield row("plate and supports out of balance", 0.0, imbalance(solid), 1e-8, "absolute")


def twisted_bar(n: int, E_scale: float = 1.0) -> tuple[float, float]:
    """M/theta of a square bar, n x 1.5 n x n bricks, that a plate sticks to and turns about its axis; forces out of balance."""
    *_, last = pr.solve(pr.Problem(
        "bar", space="solid", kinematics="small", contact_geometry="reference", friction=pr.Coulomb(1.0),
        bodies={"bar": pr.Body(pr.Box((20.0, 30.0, 20.0), (n, 3 * n // 2, n)), pr.Elastic(1000.0 * E_scale, 0.3), "h8")},
        tools={"plate": pr.Plane(touching="bar.top", at=(10.0, 0.0, 10.0))},
        contacts=(pr.Contact("bar.top", "plate", enforcement=pr.Augmented()),), fixed={"bar.bottom": "xyz"},
        # pressed on so that all of it sticks, which adds nothing to the moment of linear elasticity
        steps=(pr.Step("twist", move={"plate": pr.Motion(y=-0.3, ry=1e-3)}, increments=1),),
    ))  # fmt: skip
    assert set(last.contacts["bar.top-plate"].status.tolist()) == {1}
    return -last.force("plate").my / 1e-3, imbalance(last)


@case("square bar twisted by a plate", suite="space")
def torsion(E_scale: float = 1.0) -> Iterator[Row]:
    """Moment about the axis on 16 x 24 x 16 bricks; the order of its error, and that which 4, 8 and 16 show by themselves."""
    meshes = (4, 8, 16)
    (*moments,), (*_, off) = zip(*(twisted_bar(n, E_scale) for n in meshes))
    exact = tables.TORSION_STIFFNESS
    yield row("M/theta (N mm)", exact, moments[-1], 0.005)
    yield row("M/theta (N mm), extrapolated", exact, convergence(meshes, moments).limit, 0.001)
    order = float(np.log2((moments[-2] - exact) / (moments[-1] - exact)))
    yield row("order of the error, n = 8, 16", 1.8, order, 0.0, "at least")
    yield order_row("M/theta", meshes, moments, 2.0)
    yield row("plate and supports out of balance", 0.0, off, 1e-8, "absolute")
