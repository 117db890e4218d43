"""Transient conduction in the bodies, one step after each committed mechanical increment (staggered), heated by friction.

On the nodes, in the configuration at the end of the increment: C (T₁ − T₀)/Δt + K T₁ = q, backward Euler with the lumped capacity
of the initial volume, which has no undershoot (Zienkiewicz & Taylor 2000, The Finite Element Method, vol. 1, ch. 18). A contact
node gets the work of its friction in the increment, of which the tool takes its share away.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix, diags

from prensa.elements.shapes import square, table, triangle
from prensa.model.heat import Heat
from prensa.model.metals import metals_of
from prensa.result.increment import ContactState, Increment, Temperatures
from prensa.system.system import System
from prensa.types import Array, Index

log = logging.getLogger("prensa")


class Conduction:
    """Temperatures of the bodies of a system that describes heat."""

    def __init__(self, system: System, heat: Heat) -> None:
        self.system, self.heat = system, heat
        X = system.X
        self.T = np.full(len(X), heat.initial)
        self.capacity = np.concatenate(
            [heat.conductors[b.body].capacity * system.node_volumes(b.body) for b in system.blocks]
        )
        held = {name: system.boundary_nodes(name) for name in heat.held}
        self.held = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *held.values()]))
        self.prescribed = self.T.copy()
        for name, nodes in held.items():
            self.prescribed[nodes] = heat.held[name]
        self.seconds = 0.0
        self.before: dict[str, tuple[Array, Array]] = {}  # friction forces and slips of the contacts at the last commit
        self.friction, self.through_sides = 0.0, 0.0
        self.into_tools = dict.fromkeys(system.problem.tools, 0.0)

    def along(self, increments: Iterator[Increment]) -> Iterator[Increment]:
        """The increments with their temperatures."""
        least, most = dict[str, float](), dict[str, float]()
        for increment in increments:
            found = self.advanced(increment)
            for body, T in found.bodies.items():
                least[body], most[body] = min(least.get(body, np.inf), T.min()), max(most.get(body, -np.inf), T.max())
            yield replace(increment, temperatures=found)
        for body, metal in metals_of(self.system.problem) if least else ():
            if words := metal.beyond_temperatures(least[body], most[body]):
                log.warning("%s", f"the flow curve of body {body!r}, {words}")

    def advanced(self, increment: Increment) -> Temperatures:
        """Temperatures after an increment."""
        from scipy.sparse.linalg import spsolve

        dt, q = increment.seconds - self.seconds, np.zeros(len(self.T))
        for name, contact in increment.contacts.items():
            heat = self._rubbed(name, contact)
            share = self.heat.share(contact.body, contact.tool)
            q[contact.node + self.system.offsets[contact.body]] += share * heat
            self.friction += float(heat.sum())
            self.into_tools[contact.tool] = self.into_tools.get(contact.tool, 0.0) + (1.0 - share) * float(heat.sum())
        K = sum(self._conduction(increment, body) for body in self.system.meshes)
        A = csc_matrix(diags(self.capacity) + dt * K)
        free = np.setdiff1d(np.arange(len(self.T)), self.held)
        T = self.prescribed.copy()
        right = self.capacity * self.T + q - A[:, self.held] @ T[self.held]
        T[free] = spsolve(A[free][:, free], right[free])
        gained = self.capacity * (T - self.T)
        self.through_sides += float((gained + dt * (K @ T) - q)[self.held].sum())
        self.T, self.seconds = T, increment.seconds
        stored = float((self.capacity * (T - self.heat.initial)).sum())
        nodal = {body: T[self.system.span(body)] for body in self.system.meshes}
        return Temperatures(nodal, self.friction, dict(self.into_tools), self.through_sides, stored)

    def _rubbed(self, name: str, contact: ContactState) -> Array:
        """Work of friction (n,) at the nodes of a contact since the last commit, as the energy balance has it."""
        force = np.abs(contact.shear) * contact.weight
        was, slip = self.before.get(name, (np.zeros_like(force), np.zeros_like(force)))
        self.before[name] = force, contact.slip
        return np.asarray(0.5 * (was + force) * (contact.slip - slip))

    def _conduction(self, increment: Increment, body: str) -> csc_matrix:
        """∫ ∇N k ∇N dV (n, n) of a body on all nodes."""
        system, shape = self.system, increment.shapes[body]
        x = shape.x if system.problem.kinematics == "finite" else shape.X
        cells: Index = shape.cells
        shapes = table(cells.shape[1], square(2) if cells.shape[1] == 4 else triangle(1))
        K = np.zeros((*cells.shape, cells.shape[1]))
        for N, dN, weight in zip(shapes.N, shapes.dN, shapes.weight):
            J = np.einsum("eai,aj->eij", x[cells], dN)
            G = np.einsum("aj,eji->eai", dN, np.linalg.inv(J))
            depth = 2 * np.pi * (x[cells, 0] @ N) if system.axisymmetric else system.problem.thickness
            K += (weight * np.linalg.det(J) * depth)[:, None, None] * np.einsum("eai,ebi->eab", G, G)
        K *= self.heat.conductors[body].conductivity
        nodes = cells + system.offsets[body]
        rows, columns = (np.broadcast_to(n, K.shape).ravel() for n in (nodes[:, :, None], nodes[:, None]))
        return csc_matrix(coo_matrix((K.ravel(), (rows, columns)), shape=(len(self.T), len(self.T))))
