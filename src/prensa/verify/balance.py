"""Global equilibrium: tool forces against supports and loads. One helper that every case uses, and a case with every load.

Summing the equilibrium r(u) = f_int − f_contact − f_ext − f_support = 0 over all nodes removes the internal forces:

    F_tools = Σ R_a + F_loads            and, about the origin,            M_tools = Σ x_a × R_a + M_loads

with F_tools, M_tools the action of the bodies on the tools. Which x? The internal forces have no moment about the
positions at which equilibrium is written: the current ones in finite strain, the initial ones X in small strain (the
Cauchy stress is symmetric there). Reactions and loads of a small-strain model therefore act at X. Its contact forces
act at X too when the contact geometry is ``reference``, and the moment balance is exact as it stands. Tools are where they
are now in either geometry: a tool's moment is about its present reference point, and the point about which the balance is
taken, the origin, stays. With the
``current`` geometry they act on the tool at the moved points x = X + u, while the body answers at X, so what is exact
is

    M_tools + Σ u_a × f_a = Σ X_a × R_a + M_loads,

f_a the nodal contact force on the body. The term Σ u × f is the moment that small-strain theory neglects, of the order
of the displacement over the size; it is taken out here by name and not hidden in a tolerance. In axisymmetry only the
axial force has a balance.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import prensa as pr
from prensa.geometry.plane import cross
from prensa.result.increment import Increment
from prensa.system.discretise import discretise, on_meshes
from prensa.system.planning import plan_step
from prensa.system.schedule import BoundaryLoad
from prensa.system.system import System
from prensa.types import Array
from prensa.verify.table import Row, case, row

BALANCE_TOLERANCE = 1e-8


def wrench(points: Array, forces: Array) -> Array:
    """Points, forces (k, 2) → (3,) resultant force and moment about the origin."""
    moment = cross(points, forces)
    return np.array([*forces.sum(axis=0), moment.sum()])


def boundary_load(system: System, x: Array, load: BoundaryLoad, t: float) -> Array:
    """Resultant (3,) at time t of a load on a boundary of the configuration x (n, 2), edge by edge.

    A uniform traction on a straight edge acts at its middle; in axisymmetry (axial force only) with 2π times its radius.
    """
    out = np.zeros(3)
    live = x if load.follower else system.X
    for where, p, q, traction in (
        (live, load.pressure(t), load.shear(t), np.zeros(2)),
        (system.X, 0.0, 0.0, np.array([course(t) for course in load.traction])),
    ):
        a, b = where[load.edges[:, 0]], where[load.edges[:, 1]]
        d, middle = b - a, 0.5 * (a + b)
        outward = np.stack([d[:, 1], -d[:, 0]], axis=1)
        length = np.hypot(d[:, 0], d[:, 1])[:, None]
        depth = 2 * np.pi * middle[:, :1] if system.axisymmetric else system.problem.thickness
        # a dead traction keeps the forces of the initial boundary but acts where its points are now
        arm = 0.5 * (x[load.edges[:, 0]] + x[load.edges[:, 1]])
        out += wrench(arm, depth * (q * d - p * outward + length * traction))
    return out


def body_force(system: System, x: Array, body: str, b: Array) -> Array:
    """Resultant (3,) of a force per initial volume b (2,) on a body in the configuration x (n, 2)."""
    block = next(k for k in system.blocks if k.body == body)
    return wrench(block.positions(x).reshape(-1, 2), block.volume.reshape(-1, 1) * b)


def imbalance(system: System, inc: Increment) -> tuple[float, float]:
    """Force and moment imbalance of an increment over the largest force, and over that times the size of the model.

    Uses what a user sees (tool forces, support reactions, nodal contact forces) and resultants of the loads computed
    from the description. The worst of: tools against supports and loads; each tool against the nodal forces of its
    contacts; each tool pushed by a force against that force.
    """
    finite = system.problem.kinematics == "finite"
    moved = system.problem.contact_geometry == "current"
    plan = plan_step(system, inc.step_number - 1, inc.state.step_start, inc.state.ends)
    x = system.positions(inc.state.u) if finite else system.X
    actions = [boundary_load(system, x, load, inc.time) for load in plan.loads.values()]
    actions += [
        body_force(system, x, body, np.array([bx(inc.time), by(inc.time)]))
        for body, (bx, by) in plan.body_force.items()
    ]
    actions += [wrench(b.x if finite else b.X, b.reaction) for b in inc.bodies.values()]
    release = system.being_released(inc.state, plan)
    others = release.copy()
    for group in plan.released:  # which are among the reactions
        others[group.dofs] = 0.0
    actions.append(wrench(x, system.displacement(others)))
    tools = {}
    for name, tool in inc.tools.items():
        at = tool.at + np.array(tool.place[:2])  # where it is now, whatever the geometry
        f = np.array(tool.force)
        tools[name] = np.array([f[0], f[1], f[2] + at[0] * f[1] - at[1] * f[0]])
    gaps, neglected = [], np.zeros(3)
    nodal = {name: np.zeros(3) for name in tools}
    for c in inc.contacts.values():
        nodal[c.tool] += wrench(c.x if moved else c.X, c.force)
        if moved and not finite:
            neglected[2] += wrench(c.x - c.X, c.force)[2]
    gaps += [tools[name] + nodal[name] for name in tools]
    gaps.append(sum(tools.values(), np.zeros(3)) + neglected - sum(actions, np.zeros(3)))
    for dof, amplitude in plan.push.items():
        t, component = (int(v) for v in system.dofs.tool.split(np.asarray(dof)))
        force = list(inc.tools.values())[t].force
        gaps.append(np.eye(3)[component] * (force[component] + amplitude(inc.time) + release[dof]))
    for dof in plan.springs:
        t, component = (int(v) for v in system.dofs.tool.split(np.asarray(dof)))
        tool = list(inc.tools.values())[t]
        gaps.append(np.eye(3)[component] * (tool.force[component] + (tool.spring or tool.force)[component]))
    if system.axisymmetric:
        gaps = [g * np.array([0.0, 1.0, 0.0]) for g in gaps]
    largest = max(float(np.hypot(a[0], a[1])) for a in [*actions, *tools.values()])
    if largest == 0.0:
        return 0.0, 0.0
    length = max(system.length, float(np.abs(x).max()))
    worst = np.abs(gaps)
    return float(worst[:, :2].max()) / largest, float(worst[:, 2].max()) / (largest * length)


class Balance:
    """Watches solutions and remembers the worst imbalance of all their increments."""

    def __init__(self) -> None:
        self.force, self.moment, self.plane = 0.0, 0.0, False

    def watch(self, problem: pr.Problem, numerics: pr.Numerics | None = None) -> Iterator[Increment]:
        """The increments of a problem, each checked."""
        system = discretise(problem)
        self.plane |= not system.axisymmetric
        described, meshes = system, 0
        for inc in pr.solve(system, numerics):
            if inc.remeshings > meshes:
                meshes, remeshed = inc.remeshings, inc.state.remeshed
                assert remeshed is not None
                system = on_meshes(described, remeshed)
            force, moment = imbalance(system, inc)
            self.force, self.moment = max(self.force, force), max(self.moment, moment)
            yield inc

    def last(self, problem: pr.Problem, numerics: pr.Numerics | None = None) -> Increment:
        """The last increment of a problem, all of them checked."""
        *_, inc = self.watch(problem, numerics)
        return inc

    def rows(self) -> Iterator[Row]:
        """The two rows of the balance, one in axisymmetry."""
        yield row("forces out of balance / largest force", 0.0, self.force, BALANCE_TOLERANCE, "absolute")
        if self.plane:
            yield row("moments out of balance / (force × length)", 0.0, self.moment, BALANCE_TOLERANCE, "absolute")


@case("balance, every kind of load", suite="contact", expected_warnings=("small against the elements",))
def every_load(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Tools that press, turn and are pushed by a force balance pressure, shear, dead traction, weight and supports."""
    for kinematics, geometry in (("small", "reference"), ("small", "current"), ("finite", "current")):
        balance = Balance()
        for _ in balance.watch(loaded_block(kinematics, geometry, E_scale, mu_scale)):
            pass
        for r in balance.rows():
            yield row(f"{kinematics} strain, {geometry} geometry: {r.quantity}", 0.0, r.ours, r.tolerance, r.kind)


def loaded_block(kinematics: str, geometry: str, E_scale: float = 1.0, mu_scale: float = 1.0) -> pr.Problem:
    """A soft block on its bonded base under every load there is, a turning cylinder and a stamp driven by force."""
    # off the origin, so that a wrong arm shows
    mesh = pr.Rectangle(size=(12, 8), n=(24, 12), origin=(5, -3))
    follower = pr.Load(pressure=0.4, shear=0.3)
    return pr.Problem(
        "every load", kinematics=kinematics, contact_geometry=geometry, thickness=1.7,
        bodies={"block": pr.Body(mesh, pr.Elastic(E=100.0 * E_scale, nu=0.3))},
        tools={
            "cylinder": pr.Circle(radius=6, at=(8.0, 11.0)),
            "stamp": pr.Stamp(width=3, fillet=0.5, at=(15.0, 5.0), facing=(0, -1)),
        },
        contacts=(pr.Contact("block.top", "cylinder"), pr.Contact("block.top", "stamp")),
        friction=pr.Coulomb(0.3 * mu_scale),
        fixed={"block.bottom": "xy"},
        loads={"block.left": follower, "block.right": pr.Load(traction=(0.2, 0.1))},
        body_force={"block": (0.01, -0.03)},
        steps=(
            pr.Step(
                "press", move={"cylinder": pr.Motion(y=-0.3), "stamp": pr.Motion(rz=0.0)},
                push={"stamp": pr.Push(y=-4.0)}, increments=2,
            ),
            pr.Step("turn", move={"cylinder": pr.Motion(x=0.1, rz=0.05)}, push={"stamp": pr.Push(y=-4.0)}, increments=2),
        ),
    )  # fmt: skip
