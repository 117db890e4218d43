"""Elastic contact in space against linear theory: Hertz, an ellipse, a square punch, Mindlin; and a ball that is dragged.

Linear theory has gaps on the undeformed surface and small strain. The block is 20 x 20 x 10 on a bonded base: what is known of a
half-space is corrected by the regular part of the point-load Green function of the block (`tables.BLOCK_CORRECTION`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np

import prensa as pr
from prensa.reference import HertzSphere, hertz_sphere, tables
from prensa.result.increment import Increment
from prensa.types import Array
from prensa.verify.rates import convergence, order_row, order_rows
from prensa.verify.space import ends_of_steps, imbalance
from prensa.verify.table import Row, case, row

E, NU, H, BALL_RADIUS = 1000.0, 0.3, 10.0, 10.0
E_STAR = E / (1.0 - NU**2)
SHEAR_MODULUS = E / (2.0 * (1.0 + NU))
SHIFTED_FORCE = 20.0
FULL_SLIP_SHIFT = 0.9 * SHIFTED_FORCE * (2.0 - NU) / (16.0 * SHEAR_MODULUS * hertz_sphere(SHIFTED_FORCE, BALL_RADIUS, E, NU).a)
"""Shift (mm) at which all of the contact slips, mu = 0.3 (Mindlin 1949)."""
LOWER_FACE = ((0, 0), (1, 0), (1, 1), (0, 1))
"""Nodes of the lower face of a brick along x and y."""


def lines(h: float, even: float, far: float, growth: float) -> Array:
    """Coordinates from 0 to ``far``: steps of h up to ``even``, each step beyond longer by the factor ``growth``."""
    near = h * np.arange(round(even / h) + 1)
    count = np.log((far - near[-1]) / h * (growth - 1.0) / growth + 1.0) / np.log(growth)
    steps = h * growth ** np.arange(1.0, 1.0 + np.ceil(count))
    return np.concatenate([near, near[-1] + np.cumsum(steps) * (far - near[-1]) / steps.sum()])


def bricks(x: Array, y: Array, z: Array, patch: float = 0.0) -> pr.Bricks:
    """Bricks between coordinates; ``patch``: a side of that name on top, as far as that along x and z, beside ``top``."""
    points = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(len(x), len(y), len(z))
    a, b, c = (len(v) - 1 for v in (x, y, z))
    cells = np.stack([number[i : a + i, j : b + j, k : c + k] for k in (0, 1) for i, j in LOWER_FACE], axis=-1).reshape(-1, 8)
    at = {"left": (0, x[0]), "right": (0, x[-1]), "bottom": (1, y[0]), "top": (1, y[-1]), "back": (2, z[0])}
    named = {name: np.flatnonzero(points[:, axis] == value) for name, (axis, value) in at.items()}
    if patch:
        flat = (points[:, [0, 2]] <= patch * (1.0 + 1e-9)).all(axis=1) & (points[:, 1] == y[-1])
        inner = (points[:, [0, 2]] < patch * (1.0 - 1e-9)).all(axis=1)
        named |= {"patch": np.flatnonzero(flat), "top": np.flatnonzero((points[:, 1] == y[-1]) & ~inner)}
    sides = {name: tuple(nodes.tolist()) for name, nodes in named.items()}
    return pr.Bricks(tuple(map(tuple, points.tolist())), tuple(map(tuple, cells.tolist())), sides)


def block(
    mesh: pr.Bricks, tool: pr.ToolShape, steps: tuple[pr.Step, ...], E_scale: float, fixed: dict[str, str] | None = None,
    side: str = "top", enforcement: pr.Enforcement = pr.Penalty(),  # noqa: B008
) -> pr.Problem:  # fmt: skip
    """A linear elastic block on a bonded base under a tool, a quarter of it if not held otherwise."""
    held = {"block.left": "x", "block.back": "z"} if fixed is None else fixed
    return pr.Problem(
        "block", space="solid", kinematics="small", contact_geometry="reference", allow_large_strain=True,
        bodies={"block": pr.Body(mesh, pr.Elastic(E * E_scale, NU), "h8")}, tools={"tool": tool},
        contacts=(pr.Contact(f"block.{side}", "tool", enforcement=enforcement),), fixed={"block.bottom": "xyz", **held},
        steps=steps, no_contact=() if side == "top" else (pr.NoContact("block.top", "tool"),),
    )  # fmt: skip


def upright(h: float, even: float, growth: float) -> Array:
    """Coordinates along y, fine below the top."""
    return H - lines(h, even, H, growth)[::-1]


def pressed(*ways: float) -> tuple[pr.Step, ...]:
    """A step of one increment to each depth."""
    return tuple(pr.Step(f"to {way:g}", move={"tool": pr.Motion(y=-way)}, increments=1) for way in ways)


def rms(increment: Increment, semi_axes: tuple[float, float], p0: float) -> float:
    """Root mean square of the pressure less Hertz's within 0.8 of the contact, over p0."""
    (contact,) = increment.contacts.values()
    s = (contact.x[:, 0] / semi_axes[0]) ** 2 + (contact.x[:, 2] / semi_axes[1]) ** 2
    near = s < 0.64
    return float(np.sqrt(np.mean((contact.pressure[near] / p0 - np.sqrt(1.0 - s[near])) ** 2)))


def under_sphere(n: int, exact: list[HertzSphere], E_scale: float) -> pr.Problem:
    """A block under a ball, n bricks along 1 mm, pressed to each of the closed form's states."""
    side = lines(1.0 / n, 1.0 + 1.0 / n, H, 1.3)
    ways = [s.delta - tables.BLOCK_CORRECTION * s.P / (E_STAR * H) for s in exact]
    ball = pr.Sphere(BALL_RADIUS, at=(0.0, H + BALL_RADIUS, 0.0))
    return block(bricks(side, upright(1.0 / n, 1.0, 1.3), side), ball, pressed(*ways), E_scale)


def force_and_rms(increment: Increment, semi_axes: tuple[float, float], p0: float) -> tuple[float, float]:
    """Force of the whole (N) and `rms` in % of p0."""
    return 4.0 * abs(increment.force("tool").y), 100.0 * rms(increment, semi_axes, p0)


@case("Hertz, sphere on a block", suite="space", slow=True)
def hertz(E_scale: float = 1.0) -> Iterator[Row]:
    """Force at the depths of a = 0.7 and 1 mm, 8 bricks a radius at the second, and pressures within 0.8 a; orders in n.

    The edge of the contact falls between nodes at the first depth, and the force goes up and down with n.
    """
    exact, meshes = [hertz_sphere(P, BALL_RADIUS, E, NU) for P in (50.0, 146.52)], (2, 4, 8)
    found, imbalances = [], list[float]()
    for n in meshes:
        increments = list(pr.solve(under_sphere(n, exact, E_scale)))
        found.append([force_and_rms(inc, (s.a, s.a), s.p0) for s, inc in zip(exact, increments)])
        imbalances += map(imbalance, increments)
    kinds: tuple[Literal["report", "at least"], ...] = ("report", "at least")
    for k, (s, kind) in enumerate(zip(exact, kinds)):
        force, pressure = f"P (N), a = {s.a:.1f} mm", f"r.m.s. of pressure (% of p0), a = {s.a:.1f} mm"
        yield row(force, s.P, found[-1][k][0], 0.005)
        yield row(pressure, 0.0, found[-1][k][1], 2.0, "absolute")
        yield order_row(force, meshes, [of_mesh[k][0] for of_mesh in found], 1.0, kind)
    yield row("ball and supports out of balance", 0.0, max(imbalances), 1e-8, "absolute")


@case("Hertz, elliptic contact on a block", suite="space", slow=True, expected_warnings=("times longer than wide",))
def ellipse(E_scale: float = 1.0) -> Iterator[Row]:
    """The outer rim of a torus, radii 20 and 5, 8 bricks a semi-axis: force, with its order in their number, and pressures."""
    ((P, (a, b, delta, p0)),) = tables.HERTZ_ELLIPSE.items()
    torus = pr.Revolved(pr.Circle(5.0, at=(15.0, 0.0)), axis=(0.0, 0.0, 1.0), at=(0.0, H + 20.0, 0.0))
    found, meshes, imbalances = [], (2, 4, 8), list[float]()
    for n in meshes:
        x, y, z = 0.8 / n, 0.48 / n, 0.32 / n
        mesh = bricks(lines(x, 0.8 + x, H, 1.35), upright(y, 0.48, 1.35), lines(z, 0.32 + 2.0 * z, H, 1.35))
        increments = list(pr.solve(block(mesh, torus, pressed(delta - tables.BLOCK_CORRECTION * P / (E_STAR * H)), E_scale)))
        found.append(force_and_rms(increments[-1], (a, b), p0))
        imbalances += map(imbalance, increments)
    yield row("P (N)", P, found[-1][0], 0.005)
    yield row("r.m.s. of pressure (% of p0)", 0.0, found[-1][1], 2.0, "absolute")
    yield order_row("P", meshes, [force for force, _ in found], 1.0, "at least")
    yield row("torus and supports out of balance", 0.0, max(imbalances), 1e-8, "absolute")


@case("square flat punch on a block", suite="space")
def square_punch(E_scale: float = 1.0) -> Iterator[Row]:
    """Stiffness of a punch 2 x 2, of first order in the size of the bricks: extrapolated from 4, 8 and 16 a half side.

    A plane that meets the square alone: the rest of the top is out of its contact.
    """
    stiffness, off, meshes = [], 0.0, (4, 8, 16)
    for n in meshes:
        side = lines(1.0 / n, 1.0 + 2.0 / n, H, 1.3)
        mesh = bricks(side, upright(1.0 / n, 1.0, 1.3), side, patch=1.0)
        p = block(mesh, pr.Plane(touching="block.patch"), pressed(0.01), E_scale, side="patch")
        (increment,) = pr.solve(p)
        stiffness.append(4.0 * abs(increment.force("tool").y) / 0.01)
        off = max(off, imbalance(increment))
    exact = 1.0 / (1.0 / tables.SQUARE_PUNCH_STIFFNESS - tables.BLOCK_CORRECTION / (E_STAR * H))
    yield row("P/delta (N/mm), extrapolated", exact, convergence(meshes, stiffness).limit, 0.005)
    yield order_row("P/delta", meshes, stiffness, 1.0)
    yield row("punch and supports out of balance", 0.0, off, 1e-8, "absolute")


@case("cone on a block", suite="space", slow=True)
def cone(E_scale: float = 1.0) -> Iterator[Row]:
    """Force of a cone of 75 degrees that presses a radius of 1 mm (Sneddon 1965), extrapolated from 2, 4 and 8 bricks in it."""
    a, cot, meshes = 1.0, 1.0 / np.tan(np.radians(75.0)), (2, 4, 8)
    P, delta = 0.5 * np.pi * a**2 * E_STAR * cot, 0.5 * np.pi * a * cot
    tool = pr.Revolved(pr.Profile(points=((-20.0, 20.0 * cot), (0.0, 0.0), (20.0, 20.0 * cot))), at=(0.0, H, 0.0))
    forces, off = [], 0.0
    for n in meshes:
        side = lines(1.0 / n, 1.0 + 1.0 / n, H, 1.3)
        mesh = bricks(side, upright(1.0 / n, 1.0, 1.3), side)
        way = delta - tables.BLOCK_CORRECTION * P / (E_STAR * H)
        *_, last = pr.solve(block(mesh, tool, pressed(way), E_scale))
        forces.append(4.0 * abs(last.force("tool").y))
        off = max(off, imbalance(last))
    yield row("P (N), extrapolated", P, convergence(meshes, forces).limit, 0.01)
    yield order_row("P", meshes, forces, 1.0, "at least")
    yield row("cone and supports out of balance", 0.0, off, 1e-8, "absolute")


def along_axis(increment: Increment, height: float) -> float:
    """Displacement along x of the block below the middle of its top, at a height between nodes linearly."""
    body = increment.bodies["block"]
    below = (body.X[:, 0] == 0.0) & (body.X[:, 2] == 0.0)
    y = body.X[below, 1]
    return float(np.interp(height, np.sort(y), body.displacement[below, 0][np.argsort(y)]))


def shifted(n: int, E_scale: float, mu_scale: float) -> list[Increment]:
    """A ball pressed by 20 N, n bricks a radius of the contact, and then shifted with friction."""
    s = hertz_sphere(SHIFTED_FORCE, BALL_RADIUS, E, NU)
    side = lines(s.a / n, 1.2 * s.a, H, 1.4)
    mesh = bricks(np.concatenate([-side[:0:-1], side]), upright(s.a / n, 0.8 * s.a, 1.4), side)
    law = {"block.top-tool": pr.Coulomb(0.3 * mu_scale)}
    slide = pr.Step("slide", move={"tool": pr.Motion(x=0.9 * FULL_SLIP_SHIFT)}, friction=law, increments=6)
    press = pressed(s.delta - tables.BLOCK_CORRECTION * s.P / (E_STAR * H))
    ball = pr.Sphere(BALL_RADIUS, at=(0.0, H + BALL_RADIUS, 0.0))
    # a penalty's own give would be 2 % of the shift
    problem = block(mesh, ball, (*press, slide), E_scale, fixed={"block.back": "z"}, enforcement=pr.Augmented())
    return list(pr.solve(problem))


def below_force_along(force: float, depth: float) -> float:
    """Displacement along a force on a half-space of the point below it (Cerruti 1882; Johnson 1985, equation 3.75a)."""
    return force * (1.5 - NU) / (4.0 * np.pi * SHEAR_MODULUS * depth)


@case("Mindlin, sphere on a block", suite="space", slow=True)
def mindlin(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Pressed without friction, then shifted with it: the shift for the force, and the stick radius, 6 bricks a radius.

    The shift is that against the point of the block ten radii below the contact, so that the block's way on its base as a whole
    does not count. Theory counts from infinity; the way of that point of a half-space, 3 to 4 % of the shift, is taken from it.
    Theory neglects the slip across and the coupling of normal and tangential tractions: 2 % in the shift, a brick in the radius.
    """
    a, meshes = hertz_sphere(SHIFTED_FORCE, BALL_RADIUS, E, NU).a, (3, 4, 6)
    runs = [shifted(n, E_scale, mu_scale) for n in meshes]
    forces = [[2.0 * abs(inc.force("tool").x) for inc in run[1:]] for run in runs]
    for inc, Q in zip(runs[-1][1:], forces[-1], strict=True):
        (contact,) = inc.contacts.values()
        sticks = contact.status == 1
        slips = 1.0 - Q / (0.6 * abs(inc.force("tool").y))
        shift = float(inc.tools["tool"].place[0]) - along_axis(inc, H - 10.0 * a)
        stuck = float(np.hypot(contact.x[sticks, 0], contact.x[sticks, 2]).max(initial=0.0))
        exact = FULL_SLIP_SHIFT * (1.0 - slips ** (2.0 / 3.0)) - below_force_along(Q, 10.0 * a)
        yield row(f"shift (mm), Q = {Q:.2f} N", exact, shift, 0.02)
        yield row(f"stick radius (mm), Q = {Q:.2f} N", a * slips ** (1.0 / 3.0), stuck, a / meshes[-1], "absolute")
    yield from order_rows([f"Q (N) at {0.15 * k:.2f} of the shift at full slip" for k in range(1, 7)], meshes, forces, 1.0)
    yield row("ball and supports out of balance", 0.0, max(imbalance(inc) for run in runs for inc in run), 1e-8, "absolute")


def dragged(n: int, E_scale: float, mu_scale: float) -> pr.Problem:
    """Half a block of 2n x n x n graded bricks under a ball, pressed by 1 mm and shifted at this height."""
    mesh = pr.Box((20.0, 10.0, 10.0), (2 * n, n, n), (-10.0, 0.0, 0.0), toward=(0.0, 10.0, 0.0), ratio=2.0)
    ways = tables.BLOCK_SPHERE_DRAG
    shifts = tuple(pr.Step(f"to {way:g}", move={"tool": pr.Motion(x=way)}, increments=2) for way in ways)
    return pr.Problem(
        "drag", space="solid", friction=pr.Coulomb(0.3 * mu_scale),
        bodies={"block": pr.Body(mesh, pr.NeoHooke(1000.0 * E_scale, NU), "h8")},
        tools={"tool": pr.Sphere(BALL_RADIUS, at=(0.0, H + BALL_RADIUS, 0.0))}, contacts=(pr.Contact("block.top", "tool"),),
        fixed={"block.back": "z", "block.bottom": "xyz"},
        steps=(pr.Step("press", move={"tool": pr.Motion(y=-1.0)}, increments=4), *shifts),
    )  # fmt: skip


@case("sphere dragged over a block at large strain", suite="space")
def drag(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The ball of the case before, pressed by 1 mm and shifted: Q/P on the way, 8 bricks a side of a quarter as in the reference.

    Points that slip and stick change one by one: results of 6, 8 and 12 bricks spread by 0.7 to 3.5 % and show no order, as
    those of the reference, which spread by 2.3 %.
    """
    meshes, imbalances, found = (4, 6, 8), [], []
    for n in meshes:
        (_, *ends), off = ends_of_steps(dragged(n, E_scale, mu_scale))
        imbalances.append(off)
        found.append([abs(i.force("tool").x / i.force("tool").y) for i in ends])
    names = [f"Q/P, shifted by {way:g} mm" for way in tables.BLOCK_SPHERE_DRAG]
    for name, (P, Q), ours in zip(names, tables.BLOCK_SPHERE_DRAG.values(), found[-1], strict=True):
        yield row(name, Q / P, ours, 0.03)
    yield from order_rows(names, meshes, found, 1.0)
    yield row("ball and supports out of balance", 0.0, max(imbalances), 1e-8, "absolute")
