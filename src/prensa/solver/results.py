"""What users see of a committed increment: tool forces, contact states, recovered fields. Computed when asked for."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.contact.recovery import recover
from prensa.elements import q4
from prensa.fem.schedule import StepPlan
from prensa.fem.state import State
from prensa.fem.system import Evaluation, System
from prensa.solver.increment import BodyState, ContactState, Force, Place, ToolState

Array = NDArray[np.float64]


def tool_forces(system: System, e: Evaluation) -> dict[str, Force]:
    """Force and moment of the bodies on each tool."""
    total = {t.name: np.zeros(3) for t in system.tools}
    for s, f in zip(system.surfaces, e.contacts):
        total[system.tools[s.tool].name] += f.F[:, 2:].sum(axis=0)
    return {k: Force(*map(float, v)) for k, v in total.items()}


def tool_states(system: System, state: State, e: Evaluation) -> dict[str, ToolState]:
    """Places and forces of the tools."""
    force = tool_forces(system, e)
    out = {}
    for t, tool in enumerate(system.tools):
        first = system.tool_dof(t)
        out[tool.name] = ToolState(
            tool.at,
            Place(*map(float, state.u[first : first + 3])),
            force[tool.name],
            (float(tool.direction[0]), float(tool.direction[1])),
        )
    return out


def contact_states(system: System, state: State, e: Evaluation) -> dict[str, ContactState]:
    """Contact results along each surface; pressures are nodal forces over current tributary areas."""
    x = system.positions(state.u)
    where = x if system.problem.kinematics == "finite" else system.X
    depth = system.depth_in(e.history) if system.problem.kinematics == "finite" else system.depth
    stress = nodal_stress(system, state, e)
    out = {}
    for s, f in zip(system.surfaces, e.contacts):
        nodes = s.points.nodes
        w = system.weights(s, where, depth)
        ratio = f.weight / w
        sig = stress[nodes]
        sn = np.stack(
            [sig[:, 0] * f.n[:, 0] + sig[:, 3] * f.n[:, 1], sig[:, 3] * f.n[:, 0] + sig[:, 1] * f.n[:, 1]], axis=1
        )
        frictionless = not f.t.any() and not f.slip.any()
        status = np.where(f.p > 0, np.where(f.slip | frictionless, 2, 1), 0).astype(np.int8)
        out[s.name] = ContactState(
            surface="+".join(s.description.surface), tool=system.tools[s.tool].name, body=s.body,
            node=nodes - system.offsets[s.body], X=system.X[nodes], x=x[nodes], gap=f.g,
            pressure=f.p * ratio, shear=f.t * f.area / w, slip=f.kappa, status=status, weight=w,
            force=f.F[:, :2].copy(), pressure_from_stress=-(sn * f.n).sum(axis=1),
            area=float(w[f.p > 0].sum()),
        )  # fmt: skip
    return out


def nodal_stress(system: System, state: State, e: Evaluation) -> Array:
    """Recovered Cauchy stress (n, 4) xx, yy, zz, xy at the nodes."""
    x = system.positions(state.u) if system.problem.kinematics == "finite" else system.X
    out = np.zeros((system.nodes, 4))
    for b, h in zip(system.blocks, e.history):
        values = b.law.cauchy(h.reshape(-1, h.shape[-1])).reshape(len(b), 4, 4)
        out[_own(b)] = _recovered(x, b, values)
    return out


def _own(b: Any) -> Any:
    return slice(int(b.cells.min()), int(b.cells.max()) + 1)


def _recovered(x: Array, b: Any, values: Array) -> Array:
    points = np.empty((len(b), 4, 2))
    q4.point_positions(x[b.cells], points)
    own = _own(b)
    return recover(x[own], b.cells - own.start, points, values)


def body_states(system: System, state: State, e: Evaluation, plan: StepPlan) -> dict[str, BodyState]:
    """Shapes, support reactions and recovered fields of the bodies."""
    x = system.positions(state.u)
    where = x if system.problem.kinematics == "finite" else system.X
    stress = nodal_stress(system, state, e)
    support = np.zeros(system.ndof)
    support[plan.fixed] = e.r[plan.fixed]
    reaction = support[: 2 * system.nodes].reshape(-1, 2)
    thickness = system.depth_in(e.history) if system.problem.space == "plane stress" else None
    out = {}
    for b, h in zip(system.blocks, e.history):
        own = _own(b)
        sig = stress[own]
        xx, yy, zz, xy = sig.T
        mises = np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3 * xy**2)
        plastic = np.zeros(len(sig))
        if b.law.plastic:
            plastic = np.maximum(_recovered(where, b, h[..., 4:5])[:, 0], 0.0)
        out[b.body] = BodyState(
            system.X[own], x[own], b.cells - own.start, reaction[own], sig, mises, plastic,
            None if thickness is None else thickness[own],
        )  # fmt: skip
    return out
