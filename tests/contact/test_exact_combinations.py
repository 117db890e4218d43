"""Exact enforcement together with every other thing a contact can have: the conditions hold, forces balance, penalty agrees."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.verify.balance import Balance
from problems import pressed_block, tied_blocks

FRICTION = pr.Coulomb(0.2)
MODES = [("small", "reference"), ("finite", "current")]
WAVE = ((-9.0, 3.0), (-5.0, 0.0), pr.Arc(through=(-3.0, -0.6), to=(-1.0, 0.0)), (1.0, 0.3), (3.0, -0.4), (9.0, 2.0))


def contact(tool, surface="block.top", friction=FRICTION):
    return pr.Contact(surface, tool, friction=friction, enforcement=pr.Exact())


def step(name, increments=2, **move):
    return pr.Step(name, move={tool: pr.Motion(**motion) for tool, motion in move.items()}, increments=increments)


def block(tools, steps, *, element="q4_fbar", **more):
    """A block 6 × 2 on its bonded base; quadratic elements twice as large, so that there are as many points."""
    n = (24, 8) if element.startswith("q4") else (12, 4)
    more = {"contacts": tuple(contact(name) for name in tools)} | more
    return pressed_block(*steps, tools=tools, size=(6, 2), n=n, element=element, body="block", **more)


def stack(tools, contacts, steps, fixed, *, n=(12, 17), size=6, swapped=False, **more):
    """A stiff block tied on a soft one, their meshes unrelated."""
    ties = (pr.Tie("lower.top", "block.bottom") if swapped else pr.Tie("block.bottom", "lower.top"),)
    return tied_blocks(
        *steps, sizes=((6, 1), (size, 1)), n=((n[0], 4), (n[1], 4)), names=("lower", "block"), ties=ties, tools=tools,
        materials=(pr.Elastic(1000.0, 0.3), pr.Elastic(3000.0, 0.3)), contacts=contacts, fixed=fixed, **more,
    )  # fmt: skip


def profile(**more):
    """A wavy chain of lines and arcs, pressed, dragged and turned."""
    wave = pr.Profile(points=WAVE, fillet=0.5, at=(3.0, 0.0), above="block.top")
    steps = (step("press", tool={"y": -0.15}), step("drag", 3, tool={"x": 0.6, "rz": 0.03}))
    return block({"tool": wave}, steps, **more)


def two_tools():
    """A cylinder and a stamp on one surface, dragged towards each other."""
    tools = {
        "a": pr.Circle(radius=2, at=(1.8, 4.0)),
        "b": pr.Stamp(width=1.5, fillet=0.3, at=(4.5, 2.0), facing=(0, -1)),
    }
    return block(tools, (step("press", a={"y": -0.12}, b={"y": -0.12}), step("drag", a={"x": 0.3}, b={"x": -0.2})))


DRAGGED = (step("press", tool={"y": -0.15}), step("drag", tool={"x": 0.3}))


def round_tool(element):
    """Quadratic edges under a dragged cylinder."""
    return block({"tool": pr.Circle(radius=3, at=(3.0, 5.0))}, DRAGGED, element=element)


def on_the_axis():
    """Quadratic edges in axisymmetry: a point of the edge at the axis lies between its nodes."""
    tools = {"tool": pr.Circle(radius=3, at=(0.0, 5.0))}
    fixed = {"block.bottom": "xy", "block.left": "x"}
    return block(tools, DRAGGED[:1], element="q8", space="axisymmetric", fixed=fixed)


def stamp(steps, **more):
    return block({"tool": pr.Stamp(width=3, fillet=0.4, at=(3.0, 2.0), facing=(0, -1), **more)}, steps)


def moment():
    """A stamp pushed by a force, then turned by a moment."""
    down = {"tool": pr.Push(y=-100.0)}
    turn = pr.Step("turn", push={"tool": pr.Push(y=-100.0, m=15.0)}, increments=2)
    return stamp((pr.Step("press", push=down, increments=2), turn))


def held_by_friction():
    """A stamp free in all its three motions: pressed, pulled and turned by loads less than friction bears."""
    pull = pr.Step("pull", push={"tool": pr.Push(x=10.0, y=-100.0, m=5.0)}, increments=2)
    return stamp((pr.Step("press", push={"tool": pr.Push(y=-100.0)}, increments=2), pull))


def springs():
    """A stamp on springs in all its motions, whose mount moves."""
    press = step("press", 3, tool={"y": -0.3, "x": 0.2, "rz": 0.02})
    return stamp((press,), spring=pr.Springs(x=200.0, y=500.0, rz=300.0))


def rolling():
    """A cylinder pushed down, free to turn, moved along."""
    roll = pr.Step("roll", push={"tool": pr.Push(y=-80.0, m=0.0)}, move={"tool": pr.Motion(x=0.1)}, increments=2)
    press = pr.Step("press", push={"tool": pr.Push(y=-80.0)}, increments=2)
    return block({"tool": pr.Circle(radius=1.5, at=(3.0, 3.5))}, (press, roll))


def tied_below():
    """The pressed body is tied to another."""
    tools = {"tool": pr.Circle(radius=3, at=(3.0, 5.0))}
    return stack(tools, (contact("tool"),), DRAGGED, {"lower.bottom": "xy"})


def tied_under_one_tool(**more):
    """One tool on both bodies, over the end of the tie: the end of the slave is a point whose node is no unknown."""
    tools = {"wall": pr.Plane(touching="block.right"), "top": pr.Plane(touching="block.top")}
    # with friction on both, the corner under wall and top has no unique shares of pressure and traction
    contacts = (contact("wall", "lower.right"), contact("wall", "block.right"), contact("top", friction=None))
    fixed = {"lower.bottom": "y", "lower.left": "x", "block.left": "x"}
    return stack(tools, contacts, (step("press", top={"y": -0.05}),), fixed, **more)


def beside_the_tie():
    """A tool on the part of the master that the tie leaves free, against the side of the slave."""
    tools = {"tool": pr.Circle(radius=1.5, at=(4.4, 2.5)), "top": pr.Plane(touching="block.top")}
    contacts = contact("tool", "lower.top"), contact("top")
    press = step("press", tool={"y": -0.1, "x": -0.05}, top={"y": -0.02})
    grazed = (pr.NoContact("block.right", "tool"),)  # by half an element: what presses there is not the matter here
    return stack(tools, contacts, (press,), {"lower.bottom": "xy"}, n=(18, 9), size=3, no_contact=grazed)


CASES = {
    "profile": profile,
    "profile on quadratic edges": lambda: profile(element="q8"),
    "two tools": two_tools,
    "q8": lambda: round_tool("q8"),
    "t6": lambda: round_tool("t6"),
    "q8 on the axis": on_the_axis,
    "moment": moment,
    "held by friction": held_by_friction,
    "springs": springs,
    "rolling": rolling,
    "tied below": tied_below,
    "tied under one tool": tied_under_one_tool,
    "the same, master and slave swapped": lambda: tied_under_one_tool(swapped=True),
    "the same, quadratic": lambda: tied_under_one_tool(n=(6, 7), element="q8"),
    "beside the tie": beside_the_tie,
}


def enforced(p, *enforcements):
    """The problem with other enforcements, the last one for all contacts that are left."""
    all_of_them = enforcements + enforcements[-1:] * len(p.contacts)
    return replace(p, contacts=tuple(replace(c, enforcement=e) for c, e in zip(p.contacts, all_of_them)))


def by_place(inc, tool):
    """Nodal forces (k, 2) of a tool on the places of its contacts: of two tied nodes only the sum has one value."""
    X, force = (
        np.concatenate([getattr(c, k) for c in inc.contacts.values() if c.tool == tool]) for k in ("X", "force")
    )
    place = np.unique(np.round(X, 9), axis=0, return_inverse=True)[1].ravel()
    return np.stack([np.bincount(place, f) for f in force.T], axis=1)


@pytest.mark.parametrize("mode", MODES, ids="-".join)
@pytest.mark.parametrize("name", CASES)
def test_combination(name, mode):
    """No penetration and Coulomb's bound to 1e-12, balance of forces and moments to 1e-9, a stiff penalty agrees."""
    p = replace(CASES[name](), kinematics=mode[0], contact_geometry=mode[1], allow_large_strain=mode[0] == "small")
    exact, stiff = Balance(), Balance()
    depths = [s.points.depth.min() for s in pr.discretise(p).surfaces]
    for inc in exact.watch(p):
        for c, h, law in zip(inc.contacts.values(), depths, p.contacts, strict=True):
            assert np.abs(c.points.gap[c.points.pressure > 0]).max(initial=0.0) <= 1e-12 * h
            assert c.points.gap.min() >= -1e-12 * h
            bound = 0.2 * c.pressure if law.friction else 0.0 * c.pressure
            assert (np.abs(c.shear) <= bound + 1e-12 * bound.max()).all()
            assert np.abs(np.abs(c.shear) - bound)[c.status == 2].max(initial=0.0) <= 1e-12 * bound.max()
    assert all((c.pressure > 0).any() for c in inc.contacts.values())
    assert max(exact.force, exact.moment) <= 1e-9
    other = stiff.last(enforced(p, pr.Penalty(1000.0, 1000.0)))
    for tool, state in inc.tools.items():
        force, against = np.array(state.force), np.array(other.tools[tool].force)
        assert np.allclose(force, against, rtol=0.0, atol=1.5e-3 * np.abs(force).max())
        here, there = by_place(inc, tool), by_place(other, tool)
        assert np.allclose(here, there, rtol=0.0, atol=0.05 * np.abs(here).max())


def test_the_free_tools_have_no_moment_left():
    """A cylinder that is free to turn rolls: no moment on it; a stamp takes the loads that it was given."""
    *_, roll = pr.solve(rolling())
    assert abs(roll.force("tool").m) <= 1e-9 * 80.0
    assert abs(roll.force("tool").x) < 0.1 * 0.2 * 80.0
    *_, held = pr.solve(held_by_friction())
    assert np.allclose(held.force("tool"), (-10.0, 100.0, -5.0), rtol=1e-9)


def test_exact_and_penalty_on_one_surface():
    """One of two tools on a surface is exact, the other a penalty: each keeps its own condition; forces balance."""
    balance = Balance()
    inc = balance.last(enforced(two_tools(), pr.Exact(), pr.Penalty()))
    a, b, h = inc.contacts["block.top-a"], inc.contacts["block.top-b"], 2 / 8
    assert np.abs(a.gap[a.pressure > 0]).max() <= 1e-12 * h
    assert -1e-2 * h < b.gap.min() < -1e-5 * h
    assert max(balance.force, balance.moment) <= 1e-8
