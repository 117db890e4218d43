"""A scalar field beside displacements in the same map of degrees of freedom: steady conduction, solved by the same Newton."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.elements.shapes import square, table
from prensa.linear.reduction import Reduced
from prensa.policy import Policy
from prensa.solver.equilibrium import Equilibrium, Reporter
from prensa.solver.newton import newton
from prensa.solver.predictor import initial_guess
from prensa.system.discretise import Extension, discretise
from prensa.system.interaction import Part, Response
from prensa.system.outcome import NewtonResult
from prensa.system.planning import plan_step
from prensa.system.schedule import Prescribed
from prensa.system.system import Evaluation
from problems import single_block

LENGTH, COLD, HOT = 4.0, 20.0, 100.0


class Conduction:
    """∫ ∇N · λ(T) ∇T dV with λ = conductivity (1 + beta T): linear for beta = 0, else Newton has something to do."""

    def __init__(self, field, X, cells, conductivity=30.0, beta=0.0):
        self.field, self.X, self.cells, self.conductivity, self.beta = field, X, cells, conductivity, beta

    def couplings(self):
        return [self.field.dof(self.cells, "T")]

    def respond(self, c, ask):
        shapes, dofs = table(4, square(2)), self.field.dof(self.cells, "T")
        T, x = ask.u[dofs], self.X[self.cells]
        r, K = np.zeros(dofs.shape), np.zeros((*dofs.shape, 4))
        for N, dN, weight in zip(shapes.N, shapes.dN, shapes.weight):
            J = np.einsum("eai,aj->eij", x, dN)
            G = np.einsum("aj,eji->eai", dN, np.linalg.inv(J))
            w = weight * np.linalg.det(J)
            value, slope = T @ N, np.einsum("ea,eai->ei", T, G)
            k = self.conductivity * (1 + self.beta * value)
            r += (w * k)[:, None] * np.einsum("eai,ei->ea", G, slope)
            K += (w * k)[:, None, None] * np.einsum("eai,ebi->eab", G, G)
            K += (w * self.conductivity * self.beta)[:, None, None] * np.einsum("eai,ei->ea", G, slope)[:, :, None] * N
        scale = float(np.abs(r).sum())
        return Response([Part("conduction", dofs, r, K if ask.stiffness else None)], scale=scale)


def solved(beta):
    problem = single_block(
        pr.Step("heat", increments=1), material=pr.Elastic(2e5, 0.3), size=(LENGTH, 1.0), n=(8, 2), body="bar",
        fixed={"bar.left": "xy"}, kinematics="small",
    )  # fmt: skip
    heat = Extension(
        "temperature",
        ("T",),
        lambda dofs, X, cells: [Conduction(dofs.fields["temperature"], X, cells["bar"], beta=beta)],
    )
    system = discretise(problem, [heat])
    plan, state, field = (
        plan_step(system, 0, system.initial().step_start),
        system.initial(),
        system.dofs.fields["temperature"],
    )
    ends = [np.flatnonzero(np.isclose(system.X[:, 0], x)) for x in (0.0, LENGTH)]
    held = [Prescribed(field.dof(nodes, "T"), np.full(len(nodes), T)) for nodes, T in zip(ends, (COLD, HOT))]
    plan = replace(plan, groups=[*plan.groups, *held])
    policy, report = Policy(), Reporter(lambda *_: None, lambda _: nullcontext())
    reduced = Reduced.of(system, plan.fixed, pr.Numerics(), policy=policy)
    eq = Equilibrium(system, system.context(state, plan, 1.0), reduced, pr.Numerics(), policy, report)
    lam = system.initial_multipliers(state)
    result = NewtonResult(False, None, state.u, None, lam, 0)
    e = newton(eq, initial_guess(eq, state.u, lam), lam, result)
    assert isinstance(e, Evaluation)
    return system, field, result, e, ends


@pytest.mark.parametrize("beta", [0.0, 0.01])
def test_steady_conduction_in_a_bar(beta):
    """Temperatures are those of the closed form (Kirchhoff's transform), the flux is the same at both ends, nothing moves."""
    system, field, result, e, ends = solved(beta)
    T, x = field.of(result.u)[:, 0], system.X[:, 0] / LENGTH

    def transformed(t):
        return t + 0.5 * beta * t**2

    exact = transformed(COLD) + x * (transformed(HOT) - transformed(COLD))
    if beta:
        exact = (np.sqrt(1 + 2 * beta * exact) - 1) / beta
    assert np.abs(T - exact).max() <= (1e-10 if beta == 0 else 0.06)  # linear elements between nodes, eight of them
    flux = [float(e.r[field.dof(nodes, "T")].sum()) for nodes in ends]
    assert flux[0] == pytest.approx(-flux[1], rel=1e-9)
    if beta == 0:
        assert flux[1] == pytest.approx(30.0 * (HOT - COLD) / LENGTH, rel=1e-12)
    assert np.abs(system.displacement(result.u)).max() <= 1e-12
    if beta:
        assert len(result.residuals) > 2
