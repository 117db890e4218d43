"""Contact in space: every tool × friction law × enforcement × geometry against differences, by all six motions of the tool."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.sparse import csc_matrix

import prensa as pr
from prensa.contact.pairing import rotation
from prensa.kernels.record import where
from prensa.registry import DOORS
from prensa.system.planning import plan_step
from prensa.verify.stl import icosphere, write

DOWN = -np.eye(3)[1]


class Users(pr.FrictionLaw):
    """A bound in NumPy that rises with the slip."""

    mu: float
    most: float

    def bound(self, p, kappa, at):
        return np.minimum(self.mu * p, self.most) + 3.0 * kappa / (1.0 + kappa)


class UsersOfPoint(pr.FrictionLaw):
    """A bound of one point, from which machine code is generated."""

    mu: float
    most: float

    def bound_of_point(self, p, kappa, at):
        free = self.mu * p / (1.0 + kappa)
        return where(free < self.most, free, self.most)


LAWS = {
    "none": None, "coulomb": pr.Coulomb(0.2), "linear": pr.Coulomb(pr.MuLinear(0.1, 0.5, 0.3)),
    "hardening": pr.Coulomb(pr.MuExponential(0.1, 0.3, 0.05)), "softening": pr.Coulomb(pr.MuExponential(0.3, 0.1, 2.0)),
    "mu_table": pr.Coulomb(pr.MuTable((0.0, 0.02, 0.5), (0.1, 0.2, 0.3))), "stribeck": pr.Stribeck(0.3, 0.1, 0.2),
    "shear": pr.Shear(0.5, k=4.0), "of the metal": pr.Shear(0.01), "capped": pr.Capped(0.3, m=0.5, k=2.5),
    "rounded": pr.Capped(0.3, m=0.5, k=6.0, sharpness=2), "wanheim_bay": pr.WanheimBay(0.6, k=4.0),
    "levanov": pr.Levanov(0.6, k=4.0), "wang_osakada": pr.WangOsakada(0.2, k=2.0),
    "table": pr.FrictionTable(
        pressure=((0.0, 0.3), (8.0, 0.2), (900.0, 0.1)), slip=((0.0, 1.0), (3.0, 1.5)), speed=((0.0, 1.0), (1.0, 0.8))
    ),
    "users": Users(0.3, 0.8), "users' of a point": UsersOfPoint(0.3, 1.2),
}  # fmt: skip
ENFORCEMENTS = {"penalty": pr.Penalty(), "augmented": pr.Augmented(), "exact": pr.Exact()}
COMBINATIONS = list(product(LAWS, ENFORCEMENTS))
PLACES = np.array([(5.0 * (i % 7), 0.0, 5.0 * (i // 7)) for i in range(len(COMBINATIONS))])
DIE = pr.Profile(points=((-5.0, 0.8), (-1.5, 0.8), (-0.7, 0.0), (0.7, 0.0), (1.5, 0.8), (5.0, 0.8)), fillet=0.5)
ROUND_DIE = pr.Profile(points=((0.0, 0.0), (0.7, 0.0), (1.5, 0.8), (5.0, 0.8)), fillet=(0.0, 0.5, 0.5, 0.0))
PUNCH = pr.Profile(points=((-9.0, 0.0), (0.0, 0.0), (0.0, 9.0)), fillet=(0.0, 1.0, 0.0))
PLAN = pr.Polygon(points=((-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)), fillet=1.0)
CUBE = tuple(np.array(list(product((-1.0, 1.0), repeat=3))).tolist())
ACROSS = ((0.4, -0.5), (1.6, -0.4), (0.9, 0.5), (1.2, 0.4))
"""Where (x, z) points lie under the dies with fillets: under the flats and under fillets either way."""
TOOLS = {
    "plane": (pr.Plane(normal=(0.2, -1.0, 0.1)), ((-0.5, -0.5), (0.5, -0.4), (-0.4, 0.5), (0.5, 0.6))),
    "cylinder": (pr.Extruded(pr.Circle(2.0), axis=(0.6, 0.0, 0.8)), ((-0.5, -0.5), (0.6, -0.4), (-0.4, 0.5), (0.5, 0.6))),
    "sphere": (pr.Sphere(3.0), ((-0.5, -0.5), (0.6, -0.4), (-0.4, 0.5), (0.5, 0.6))),
    "spheroid": (pr.Revolved(pr.Ellipse((3.0, 1.5))), ((-0.5, -0.5), (0.6, -0.4), (-0.4, 0.5), (0.5, 0.6))),
    "cup": (pr.Revolved(pr.Circle(4.0, concave=True)), ((-0.5, -0.5), (0.6, -0.4), (-0.4, 0.5), (0.5, 0.6))),
    "torus": (pr.Revolved(pr.Circle(1.0, at=(2.0, 0.0))), ((1.6, -0.4), (2.4, -0.5), (1.7, 0.5), (2.3, 0.6))),
    "cone": (pr.Revolved(pr.Profile(points=((0.0, 0.0), (10.0, 8.0)))), ((1.0, -0.4), (2.0, -0.5), (0.9, 0.5), (2.1, 0.6))),
    "extruded die": (pr.Extruded(DIE, axis=(0.0, 0.0, 1.0)), ACROSS),
    "revolved die": (pr.Revolved(ROUND_DIE), ACROSS),
    "swept punch": (pr.Swept(PUNCH, PLAN), ((0.8, -0.5), (1.8, -0.4), (0.9, 1.7), (1.55, 1.5))),
    "pyramid": (pr.Pyramid(of="vickers", radius=0.3), ((0.02, -0.03), (0.9, 0.02), (0.03, 0.6), (0.7, 0.65))),
    "cube": (pr.Polyhedron(points=CUBE, radius=0.4), ((0.3, 0.2), (0.9, 0.25), (0.25, 0.85), (0.85, 0.9))),
    "stl": (None, ((-0.5, -0.5), (0.6, -0.4), (-0.4, 0.5), (0.5, 0.6))),
}  # fmt: skip
MODES = [("small", "reference"), ("small", "current"), ("finite", "current")]
GROUPS = [*product(TOOLS, MODES)]
STEP = 5e-7
DEPTH = 0.003
STICK, SLIDE = np.array([2e-5, -1e-5]), np.array([0.07, 0.04])


def test_nothing_is_left_out():
    """Tools of space, friction laws and enforcements are all of those that there are."""
    spatial = {cls for cls in DOORS["tool"].own().values() if 3 in cls.dimensions}
    assert {type(tool) for tool, _ in TOOLS.values() if tool is not None} | {pr.Stl} == spatial
    assert set(DOORS["friction"].own().values()) <= {type(law) for law in LAWS.values()}
    assert {type(e) for e in ENFORCEMENTS.values()} == set(DOORS["enforcement"].own().values())


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """A ball of triangles in a file."""
    return pr.Stl(write(tmp_path_factory.mktemp("stl") / "ball.stl", *icosphere(3.0, 2)))


def under(shape, feet, flat):
    """A brick (8, 3) whose upper corners lie on a tool above (x, z), or ``flat`` as low as one of them; two high and more."""
    x = np.insert(np.array(feet), 1, 0.0, axis=1)
    x[:, 1] = 0.0 if (shape.closest(x).g > 0.5).all() else -20.0  # within a cavity
    for _ in range(400):
        x[:, 1] += 0.9 * shape.closest(x).g
    assert np.abs(shape.closest(x).g).max() < 1e-9
    x[:, 1] = x[:, 1].min() if flat else x[:, 1]  # one direction of rays from the undeformed surface: a quarter of the time
    base = x.copy()
    base[:, 1] = x[:, 1].min() - 2.0
    a, b, c, d = range(4)
    return np.concatenate([base[[a, c, d, b]], x[[a, c, d, b]]])


def posed(tool, brick, kinematics, geometry):
    """Bricks side by side, each with a tool of its own, a law and an enforcement."""
    n, count = len(brick), len(COMBINATIONS)
    cells = [list(range(i * n, i * n + n)) for i in range(count)]
    X, sides = (brick + PLACES[:, None]).reshape(-1, 3), {f"top{i}": [i * n + k for k in range(4, 8)] for i in range(count)}
    metal = pr.J2(100.0, 0.3, pr.Perfect(600.0))
    return pr.Problem(
        "t", space="solid", kinematics=kinematics, contact_geometry=geometry, allow_large_strain=kinematics == "small",
        bodies={"b": pr.Body(pr.Bricks(X.tolist(), cells, sides), metal, "h8")},
        tools={f"t{i}": replace(tool, at=tuple(PLACES[i])) for i in range(count)}, steps=(pr.Step("s"),),
        contacts=tuple(
            pr.Contact(f"b.top{i}", f"t{i}", friction=LAWS[law], enforcement=ENFORCEMENTS[e])
            for i, (law, e) in enumerate(COMBINATIONS)
        ),
    )  # fmt: skip


class Blocks:
    """The unknowns of each combination, and where contact points are in a state with tools at given places."""

    def __init__(self, system, share):
        self.system, self.share = system, share
        count = len(COMBINATIONS)
        self.tools = np.array([system.dofs.tool.dofs(i) for i in range(count)])
        self.owner = np.full(system.ndof, -1)
        self.owner[system.dofs.displacement.slice] = np.repeat(np.arange(count), len(system.X) // count * 3)
        for i, s in enumerate(system.surfaces):
            self.owner[self.tools[i]] = i
            if s.exact:
                self.owner[np.arange(s.unknowns.start, s.unknowns.stop)] = i

    def moved(self, u, place):
        """Unknowns with the tools moved by a share of a place (6,) from where they are, and the bodies with them."""
        u = u.copy()
        u[self.tools] += self.share * np.array(place)
        tool = next(iter(self.system.tool_masters.values())).place(u)
        x = self.system.X - np.repeat(PLACES, len(self.system.X) // len(PLACES), axis=0)
        self.system.displacement(u)[:] = tool[:3] + x @ rotation(tool[3:]).T - x
        return u

    def slid(self, u, state, ways):
        """Unknowns with the contact points at the depth, and along the tangents where ways (4, 2) from the committed ones end."""
        u = u.copy()
        for _ in range(6):
            most = 0.0
            for s in self.system.surfaces:
                x = self.system.stencils(s, u, state)
                off = ways - (x.s - state.contact.coordinate[s.rows])
                d = (-DEPTH * np.array([1.0, 1.2, 0.9, 1.1]) - x.g)[:, None] * x.n + (off[:, :, None] * x.e).sum(axis=1)
                self.system.displacement(u)[s.points.nodes] += d
                most = max(most, float(np.abs(d).max()))
            if most < 1e-7:
                break
        return u


def committed(system, blocks):
    """A state with contact whose tools have turned in a step before, and unknowns in which points stick and slide."""
    state, ways = system.initial(), np.array([STICK, STICK, SLIDE, -0.8 * SLIDE[::-1]])
    u = system.step_begun(blocks.moved(state.u, (0.02, -0.05, 0.01, 0.3, -0.1, 0.2)))
    start = replace(state, contact=replace(state.contact, coordinate=np.concatenate(
        [system.stencils(s, u, state).s for s in system.surfaces]
    )))  # fmt: skip
    u = blocks.slid(u, start, 0.0 * ways)
    plan = plan_step(system, 0, u)
    first = system.evaluate(system.context(replace(start, u=u), plan, 0.3), u, state.lam)
    contact = start.contact
    for s, f in zip(system.surfaces, first.contacts, strict=True):
        contact = contact.replaced(s.rows, f.record)
    lam = np.tile([[5.0, 0.05, -0.03], [6.0, -0.02, 0.04], [4.0, 0.3, 0.2], [5.0, -0.2, -0.4]], (len(COMBINATIONS), 1))
    contact = replace(contact, traction=0.2 * lam[:, 1:], speed=np.full(len(lam), 0.3), slip=np.full(len(lam), 0.1))
    state = replace(state, u=u, contact=contact, history=first.history, lam=lam)
    u = blocks.slid(blocks.moved(u, (0.01, -0.04, 0.02, 0.05, 0.08, -0.06)), state, ways)
    for s in system.surfaces:
        if s.exact:
            u[s.unknowns] = (lam[s.rows] / s.unit[:, None]).ravel()
    return state, plan, u


def states_of(e):
    """Of each point whether it is open, sticks or slides: 0, 1, 2 (combinations, 4)."""
    return np.array([(f.p > 0).astype(int) + f.slip for f in e.contacts])


@pytest.mark.parametrize(("tool", "mode"), GROUPS, ids=["-".join([tool, *mode]) for tool, mode in GROUPS])
def test_the_tangent_is_the_derivative(tool, mode, ball):
    """Each law with each enforcement within 1e-6 of the largest entry, by each motion of the tool while nodes go their ways."""
    given, feet = TOOLS[tool]
    given = given or ball
    system = pr.discretise(posed(given, under(given.shape(DOWN, 0.0), feet, mode[1] == "reference"), *mode))
    blocks = Blocks(system, 1.0 if mode[0] == "finite" else 0.2)
    state, plan, u = committed(system, blocks)
    c, lam = system.context(state, plan, 0.6), state.lam
    base = system.evaluate(c, u, lam)
    assert not base.failed
    states, rubs = states_of(base), np.array([LAWS[law] is not None for law, _ in COMBINATIONS])
    assert (states[:, :2] == 1).all() and (states[:, 2:] == 1 + rubs[:, None]).all()
    assert np.array_equal([f.stretched is not None for f in base.contacts], [
        mode[0] == "finite" and LAWS[law] is not None and not LAWS[law].proportional for law, _ in COMBINATIONS
    ])  # fmt: skip
    K = csc_matrix((base.data, system.pattern.indices, system.pattern.indptr), (system.ndof, system.ndof))
    mine = blocks.owner >= 0
    worst, largest = np.zeros((2, len(COMBINATIONS)))
    np.maximum.at(largest, blocks.owner[mine], abs(K).max(axis=1).toarray()[mine, 0])
    h, rng = STEP, np.random.default_rng(5)
    motions = np.eye(6)
    if mode == ("small", "current"):  # parts of which the other two have already been tried: two motions at once
        motions = motions[:3] + motions[3:]
    for motion in motions:
        v = np.where(mine, 0.3 * rng.normal(size=system.ndof), 0.0)
        v[blocks.tools] = motion
        a, b = (system.evaluate(c, u + s * h * v, lam, stiffness=False) for s in (1, -1))
        assert (states_of(a) == states).all() and (states_of(b) == states).all()
        np.maximum.at(worst, blocks.owner[mine], np.abs((a.r - b.r) / (2.0 * h) - K @ v)[mine])
    wrong = {COMBINATIONS[i]: float(q) for i, q in enumerate(worst / largest) if not q <= 1e-6}
    assert not wrong
