"""The assembled matrix is the derivative of the residual: every body, tool, friction and enforcement, tool unknowns too."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import prensa as pr
from prensa.system.planning import plan_step
from problems import pressed_block


class Users(pr.ToolShape):
    """A tool of which only the distance is known, here that of a circle."""

    radius: float

    def distance(self, x):
        return np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2) - self.radius


MATERIALS = {
    "elastic": pr.Elastic(1000.0, 0.3),
    "neo_hooke": pr.NeoHooke(1000.0, 0.3),
    "svk": pr.StVenantKirchhoff(1000.0, 0.3),
    "j2": pr.J2(1000.0, 0.3, pr.Swift(50.0, 0.01, 0.2)),
}
TOOLS = {
    "plane": lambda axi: pr.Plane(normal=(0.0, -1.0), at=(0.0, 3.96)),
    "tilted plane": lambda axi: pr.Plane(normal=(-0.2, -1.0), at=(0.0, 4.3)),
    "circle": lambda axi: pr.Circle(radius=6.0, at=(0.0 if axi else 1.0, 9.9)),
    "ellipse": lambda axi: pr.Ellipse(semi=(6.0, 4.0), at=(0.0 if axi else 1.0, 7.9)),
    "a user's": lambda axi: Users(radius=6.0, at=(0.0 if axi else 1.0, 9.9)),
    "stamp": lambda axi: pr.Stamp(width=4.0, fillet=1.0, at=(0.0 if axi else 1.5, 3.9)),
    "sharp stamp": lambda axi: pr.Stamp(width=2.3, at=(0.0 if axi else 1.55, 3.9)),
    "cavity": lambda axi: pr.Circle(radius=6.0, concave=True, at=(0.0, -0.12) if axi else (2.0, -1.79)),
    "profile": lambda axi: pr.Profile(
        points=((-1.0, 1.0), pr.Arc(through=(0.5, 0.0), to=(2.0, 0.6)), (3.0, 0.0), (4.5, 1.5)),
        fillet=0.5,
        at=(0.0, 3.85),
    ),
    "polygon": lambda axi: pr.Polygon(points=((0.5, 0.0), (3.3, 0.2), (2.0, 2.0)), fillet=0.4, at=(0.2, 3.85)),
    "hole": lambda axi: pr.Profile(
        points=((-3, 1), (7, 1.05), (7, -9), (-3, -9)), fillet=3.0, closed=True, at=(0.2, 2.9)
    ),
    "sharp polygon": lambda axi: pr.Polygon(
        points=((0.6, 0.1), (2.15, -0.1), (3.5, 0.2), (2.0, 2.0)), fillet=0.0, at=(0.25 if axi else 0.15, 3.95)
    ),
    "ring": lambda axi: pr.Ring(inner=1.0, outer=3.5, fillet=0.6, at=(0.0, 3.9)),
}
FRICTION = {
    "frictionless": None,
    "coulomb": pr.Coulomb(0.3),
    "capped": pr.Capped(0.5, m=0.5, k=1.5),
    "hardening": pr.Coulomb(pr.MuExponential(0.1, 0.5, 0.05)),
    "softening": pr.Coulomb(pr.MuExponential(0.5, 0.1, 0.5)),
    "table": pr.Coulomb(pr.MuTable((0.0, 0.02, 0.2), (0.1, 0.3, 0.4))),
    "shear": pr.Shear(0.5, k=20.0),
    "levanov": pr.Levanov(0.6, k=20.0),
}
MODES = [("small", "reference"), ("small", "current"), ("finite", "current")]


def problem(
    space, kinematics, geometry, element, material, tool, friction, enforcement, follower=False, rule="nodal", left=0.5
):  # fmt: skip
    axi = space == "axisymmetric"
    n = (9, 4) if element.startswith("q4") else (5, 3)
    loads = {"block.right": pr.Load(pressure=5.0, shear=2.0)} if follower else {}
    return pressed_block(
        pr.Step("one", push={"tool": pr.Push(y=-1.0)}), tools={"tool": tool}, material=material, size=(4.0, 4.0), n=n,
        origin=(left if axi else 0.0, 0.0), element=element, body="block", friction=friction, enforcement=enforcement,
        integration=rule, space=space, kinematics=kinematics, contact_geometry=geometry, loads=loads,
        thickness=1.0 if axi else 0.7,
    )  # fmt: skip


def check(p, seed, expect_slip=None):
    """Random committed state and random unknowns: directional differences of r against K, and single tool columns."""
    system = pr.discretise(p)
    rng = np.random.default_rng(seed)
    plan = plan_step(system, 0, np.zeros(system.ndof))
    state = system.initial()
    # a first random increment gives the bodies and the contact a history
    c = system.context(state, plan, 0.3)
    u1 = 0.01 * rng.normal(size=system.ndof)
    tool = system.tool_dof(0) + np.arange(3)
    u1[tool[2]] *= 0.3
    first = system.evaluate(c, u1, state.lam)
    contact = state.contact
    for s, f in zip(system.surfaces, first.contacts):
        contact = contact.replaced(s.rows, f.record)
    lam = 0.1 * np.abs(rng.normal(size=state.lam.shape))
    from dataclasses import replace

    state = replace(state, u=u1, history=first.history, contact=contact, lam=lam)
    c = system.context(state, plan, 0.6)
    u = u1 + 0.01 * rng.normal(size=system.ndof)
    u[tool[2]] = u1[tool[2]] + 0.003 * rng.normal()
    if system.axisymmetric:
        u[tool[[0, 2]]] = 0.0
    base = system.evaluate(c, u, lam)
    assert not base.failed
    closed = np.concatenate([f.p > 0 for f in base.contacts])
    slip = np.concatenate([f.slip for f in base.contacts])
    assert closed.any()
    from scipy.sparse import csc_matrix

    K = csc_matrix((base.data, system.pattern.indices, system.pattern.indptr), (system.ndof, system.ndof))
    h = 1e-7
    columns = list(np.eye(system.ndof)[tool]) + [rng.normal(size=system.ndof) for _ in range(4)]
    for v in columns:
        plus, minus = system.evaluate(c, u + h * v, lam, False), system.evaluate(c, u - h * v, lam, False)
        same = all(
            np.array_equal(a.p > 0, b.p > 0) and np.array_equal(a.slip, b.slip)
            for a, b in zip(plus.contacts, minus.contacts)
        )
        if not same:
            continue
        fd = (plus.r - minus.r) / (2 * h)
        assert np.abs(fd - K @ v).max() <= 1e-6 * max(np.abs(K @ v).max(), 1e-2 * np.abs(K.data).max())
    return closed, slip


def check_all(problems):
    """`check` of each, and that stick and slip both occur among them."""
    found = [check(p, seed=i) for i, p in enumerate(problems)]
    closed, slip = (np.concatenate(points) for points in zip(*found))
    assert slip.any()
    assert (closed & ~slip).any()


@pytest.mark.parametrize("tool", TOOLS)
@pytest.mark.parametrize("mode", MODES, ids="-".join)
@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
def test_tools_and_friction(space, mode, tool):
    """Within 1e-6 of differences for every tool × friction law × kinematics; stick and slip both occur.

    Of the enforcements each law has one here, another with the next tool and kinematics: pairs of all of them occur.
    """
    if tool == "ring" and space != "axisymmetric":
        with pytest.raises(ValueError, match="axisymmetric"):
            problem(space, *mode, "q4_fbar", MATERIALS["elastic"], TOOLS[tool](False), None, pr.Penalty())
        return
    axi = space == "axisymmetric"
    problems = []
    enforcements = (pr.Penalty(beta_T=60.0), pr.Augmented(beta=20.0, beta_T=60.0), pr.Exact(beta=20.0, beta_T=60.0))
    first = list(TOOLS).index(tool) + MODES.index(mode) + axi
    for k, friction in enumerate(FRICTION.values()):
        enforcement = enforcements[(first + k) % 3]
        p = problem(space, *mode, "q4_fbar", MATERIALS["elastic"], TOOLS[tool](axi), friction, enforcement)
        problems.append(p)
    check_all(problems)


@pytest.mark.parametrize("rule", ["gauss1", "gauss2", "gauss3", "simpson", "kikuchi"])
@pytest.mark.parametrize("mode", MODES, ids="-".join)
@pytest.mark.parametrize("space", ["plane strain", "plane stress", "axisymmetric"])
def test_integration_rules(space, mode, rule):
    """Within 1e-6 of differences for every rule × geometry × enforcement, two friction laws; stick and slip occur."""
    axi = space == "axisymmetric"
    problems = []
    enforcements = [pr.Penalty(beta_T=60.0), pr.Augmented(beta=20.0, beta_T=60.0)]
    if rule == "gauss1":  # the others have more points than nodes: refused in the exact form
        enforcements.append(pr.Exact(beta=20.0, beta_T=60.0))
    for tool, friction, enforcement in itertools.product(("tilted plane", "circle"), ("hardening", "shear"), enforcements):
        element, elastic = "q4" if space == "plane stress" else "q4_fbar", MATERIALS["elastic"]
        p = problem(
            space, *mode, element, elastic, TOOLS[tool](axi), FRICTION[friction], enforcement, rule=rule
        )  # fmt: skip
        problems.append(p)
    check_all(problems)


@pytest.mark.parametrize("element", ["t6", "q8"])
@pytest.mark.parametrize("mode", MODES, ids="-".join)
def test_quadratic_edges_on_the_axis(mode, element):
    """Within 1e-6 of differences where points lie between three nodes, areas that stretch included; stick and slip occur."""
    problems = []
    enforcements = (pr.Penalty(beta_T=60.0), pr.Augmented(beta=20.0, beta_T=60.0), pr.Exact(beta=20.0, beta_T=60.0))
    tools, frictions = ("plane", "circle", "profile"), ("coulomb", "capped", "shear")
    for tool, friction, enforcement in itertools.product(tools, frictions, enforcements):
        material, law = MATERIALS["elastic"], FRICTION[friction]
        p = problem("axisymmetric", *mode, element, material, TOOLS[tool](True), law, enforcement, left=0.0)
        problems.append(p)
    check_all(problems)


ELEMENTS = ["q4", "q4_fbar", "q4_bbar", "q4_enhanced", "q4_sheet", "t3", "t6", "q8", "q8_full"]


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("kinematics", ["small", "finite"])
@pytest.mark.parametrize("space", ["plane strain", "plane stress", "axisymmetric"])
def test_elements_and_materials(space, kinematics, element):
    """Within 1e-6 of differences for every element × material × kinematics × space, follower loads included."""
    for material in MATERIALS:
        arguments = (
            space, kinematics, "current", element, MATERIALS[material], TOOLS["plane"](False), FRICTION["coulomb"],
            pr.Penalty(), True,
        )  # fmt: skip
        if material in ("neo_hooke", "svk") and kinematics == "small":
            with pytest.raises(ValueError, match="finite"):
                problem(*arguments)
            continue
        if element in ("q4_fbar", "q4_bbar") and space == "plane stress":
            with pytest.raises(ValueError, match="-bar has no meaning in plane stress"):
                problem(*arguments)
            continue
        for seed in range(2):
            check(problem(*arguments), seed)


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_the_frictionless_tangent_is_symmetric_where_it_should_be(kinematics):
    """Frictionless contact against any curved tool keeps K symmetric to round-off (standard element, tool unknowns too)."""
    p = problem(
        "plane strain", kinematics, "current", "q4", MATERIALS["elastic"], TOOLS["circle"](False), None, pr.Penalty()
    )
    system = pr.discretise(p)
    plan = plan_step(system, 0, np.zeros(system.ndof))
    c = system.context(system.initial(), plan, 0.5)
    rng = np.random.default_rng(0)
    e = system.evaluate(c, 0.01 * rng.normal(size=system.ndof), system.initial().lam)
    from scipy.sparse import csc_matrix

    K = csc_matrix((e.data, system.pattern.indices, system.pattern.indptr), (system.ndof, system.ndof))
    assert abs(K - K.T).max() <= 1e-12 * abs(K).max()


def test_a_residual_has_no_memory():
    """Evaluating elsewhere in between changes nothing, bit for bit."""
    p = problem(
        "plane strain",
        "finite",
        "current",
        "q4_fbar",
        MATERIALS["j2"],
        TOOLS["circle"](False),
        FRICTION["hardening"],
        pr.Penalty(),
    )
    system = pr.discretise(p)
    plan = plan_step(system, 0, np.zeros(system.ndof))
    c = system.context(system.initial(), plan, 0.5)
    rng = np.random.default_rng(0)
    u = 0.01 * rng.normal(size=system.ndof)
    first = system.evaluate(c, u, system.initial().lam)
    system.evaluate(c, 0.02 * rng.normal(size=system.ndof), system.initial().lam)
    again = system.evaluate(c, u, system.initial().lam)
    assert np.array_equal(first.r, again.r)
    assert np.array_equal(first.data, again.data)


@pytest.mark.parametrize("rule", ["nodal", "gauss1", "gauss2", "gauss3", "simpson", "kikuchi"])
def test_tool_force_and_moment_are_the_sum_of_the_nodal_ones(rule):
    """The tool's rows hold minus the sum of the nodal contact forces and of their moments, to round-off."""
    p = problem(
        "plane strain",
        "finite",
        "current",
        "q4",
        MATERIALS["elastic"],
        TOOLS["circle"](False),
        FRICTION["coulomb"],
        pr.Penalty(),
        rule=rule,
    )
    system = pr.discretise(p)
    plan = plan_step(system, 0, np.zeros(system.ndof))
    c = system.context(system.initial(), plan, 0.5)
    u = 0.01 * np.random.default_rng(1).normal(size=system.ndof)
    f = system.evaluate(c, u, system.initial().lam).contacts[0]
    points = system.surfaces[0].points
    x = system.positions(u)[points.nodes]
    arm = x - (system.tools[0].at + u[-3:-1])
    nodal = points.to_nodes(f.vectors)
    assert np.allclose(-nodal.sum(0), f.F[:, -3:-1].sum(0), rtol=1e-13)
    assert np.isclose(-(arm[:, 0] * nodal[:, 1] - arm[:, 1] * nodal[:, 0]).sum(), f.F[:, -1].sum(), rtol=1e-12)


@pytest.mark.parametrize("mode", MODES, ids="-".join)
def test_springs_of_tools(mode):
    """Within 1e-6 of differences with the tool on springs in all its motions."""
    from dataclasses import replace

    base = problem(
        "plane strain", *mode, "q4", MATERIALS["elastic"], TOOLS["circle"](False), FRICTION["coulomb"], pr.Penalty()
    )
    tool = replace(base.tools["tool"], spring=pr.Springs(x=300.0, y=500.0, rz=2000.0))
    steps = (pr.Step("one", move={"tool": pr.Motion(x=0.1, y=-0.1, rz=0.01)}),)
    check(replace(base, tools={"tool": tool}, steps=steps), seed=0)
