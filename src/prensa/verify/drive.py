"""Bodies driven through prescribed displacements of single nodes, which no description has: for patch tests and bending."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

import prensa as pr
from prensa.system.discretise import discretise
from prensa.system.planning import plan_step
from prensa.system.system import Evaluation
from prensa.types import Array, Index


class Drive:
    """One body without tools; ``reaction`` (n, 2) holds the forces on the nodes at the last `to`."""

    def __init__(self, body: pr.Body, space: str, kinematics: str) -> None:
        problem = pr.Problem(
            "drive", bodies={"body": body}, space=space, kinematics=kinematics,
            steps=(pr.Step("only"),),
        )  # fmt: skip
        self.system = discretise(problem)
        self.plan = plan_step(self.system, 0, np.zeros(self.system.ndof))
        self.state = self.system.initial()
        self.X = self.system.X
        self.reaction = np.zeros_like(self.X)

    def to(self, time: float, dofs: Index, values: Array, halvings: int = 3) -> Evaluation:
        """Equilibrium at *time* with degrees of freedom dofs (k,) at values (k,), committed; in two halves if it fails.

        Raises
        ------
        RuntimeError
            If it does not converge with an eighth of the increment either.

        """
        old = self.state
        try:
            return self._newton(time, dofs, values)
        except RuntimeError:
            # plain Newton has no line search: where it diverges, half the increment starts nearer to its answer
            if halvings == 0:
                raise
        begun, start = old.clock.time, old.u[dofs]
        self.to(0.5 * (begun + time), dofs, 0.5 * (start + values), halvings - 1)
        return self.to(time, dofs, values, halvings - 1)

    def _newton(self, time: float, dofs: Index, values: Array) -> Evaluation:
        """One increment by plain Newton; raises RuntimeError if it does not converge in 30 iterations."""
        system, state = self.system, self.state
        c = system.context(state, self.plan, time)
        free = np.setdiff1d(np.arange(system.ndof), dofs)
        u, step = state.u, np.zeros(system.ndof)
        step[dofs] = values - u[dofs]
        for _ in range(30):
            e = system.evaluate(c, u, state.lam)
            if e.failed:
                raise RuntimeError(str(e.failed))
            if not step[dofs].any() and np.linalg.norm(e.r[free]) <= 1e-11 * e.scale:
                self.state = replace(state, u=u, history=e.history, clock=state.clock._replace(time=time))
                self.reaction = system.displacement(e.r).copy()
                return e
            assert e.data is not None
            pattern = system.pattern
            K = csc_matrix((e.data, pattern.indices, pattern.indptr), (system.ndof, system.ndof))
            # what is prescribed moves with the first step, by the stiffness of the committed state
            step[free] = -splu(K[free][:, free].tocsc()).solve((e.r + K @ step)[free])
            u = u + step
            step = np.zeros(system.ndof)
        raise RuntimeError("no equilibrium in 30 iterations")

    def outline(self) -> Index:
        """Unknowns (k,) of the nodes on the boundary."""
        edges = self.system.meshes["body"].edges
        nodes = np.unique(np.concatenate([e.ravel() for e in edges.values()]))
        return self.system.dofs.displacement.dofs(nodes).ravel()

    def cauchy(self) -> Array:
        """Cauchy stress (points, 4) xx, yy, zz, xy at the integration points."""
        (block,) = self.system.blocks
        return block.law.cauchy(block.at_law(self.state.history[0]).reshape(-1, block.law.size))

    def imbalance(self) -> float:
        """Resultant of the forces on the nodes over the sum of their sizes; axial in axisymmetry."""
        r = self.reaction[:, 1:] if self.system.axisymmetric else self.reaction
        return float(np.abs(r.sum(axis=0)).max() / np.abs(r).sum())
