"""Contact between sides of two bodies as an interaction: frictionless, by penalty, in the plane; from Python alone so far.

`Problem.body_contacts` asks for it. Its points are not among those of the contacts with tools, so that friction, which needs a
committed record, multipliers, reports and the checks of rigid motions do not know of it yet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from prensa.contact.forces import Scale, forces
from prensa.contact.integration import depth_of, points_of
from prensa.contact.record import ContactRecord
from prensa.contact.rules.nodal import Nodal
from prensa.contact.weighted import FacingSides
from prensa.friction.law import At
from prensa.friction.return_map import DECIDE
from prensa.layout import DofMap
from prensa.materials.material import material_of
from prensa.mesh.mesh import Mesh, ordered_nodes
from prensa.model import problem as model
from prensa.precision import EPS
from prensa.system.contact_surfaces import named_edges
from prensa.system.interaction import Context, Part, Request, Response
from prensa.types import Array, Index


def body_contacts(
    problem: model.Problem, meshes: Mapping[str, Mesh], offsets: Mapping[str, int], dofs: DofMap, X: Array
) -> list[BodyContact]:
    """The contacts between bodies of a problem, as stiff as the softer side: k_n of its enforcement at the least E*/h of both."""
    out = []
    for c in problem.body_contacts:
        sides, units = [], []
        for name in (c.slave, c.master):
            owner = name.partition(".")[0]
            mesh, edges = meshes[owner], named_edges(meshes[owner], (name,))
            nodes = ordered_nodes(edges) + offsets[owner]
            depth = depth_of(edges, mesh.cells, mesh.points)
            points = points_of(Nodal(), X, nodes, edges + offsets[owner], depth, False, problem.thickness)
            modulus = material_of(problem.bodies[owner].material, problem.kinematics, problem.space).modulus()
            sides.append(nodes)
            units.append(float((modulus / points.pressed_length).min()))
        k_n, _ = c.enforcement.stiffness(np.array([min(units)]))
        out.append(BodyContact(c.name, dofs, X, sides[0], sides[1], problem.thickness * float(k_n[0])))
    return out


@dataclass(frozen=True)
class BodyContact:
    """A slave side (k,) and a master side (c,) of nodes in walking order, body on the left, at places X (n, 2).

    ``stiffness``: pressure per length, times the thickness of the bodies. Gaps are those of the moved sides,
    weighted. All master nodes are in every stencil, so that sides of more than some tens of nodes are slow.
    """

    name: str
    dofs: DofMap
    X: Array
    slave: Index
    master: Index
    stiffness: float

    @property
    def sides(self) -> FacingSides:
        """The stencils' nodes."""
        return FacingSides.of(self.slave, self.master)

    def couplings(self) -> Sequence[Index]:
        """All nodes of a stencil with each other."""
        return [self._unknowns(self.sides)]

    def _unknowns(self, sides: FacingSides) -> Index:
        return self.dofs.displacement.dofs(sides.nodes).reshape(len(sides.nodes), -1)

    def respond(self, c: Context, ask: Request) -> Response:
        """See `Interaction`."""
        sides, x = self.sides, self.X + self.dofs.displacement.of(ask.u)
        stencils = sides.stencils(x, np.zeros(sides.nodes.shape), self._unknowns(sides))
        k = len(sides.nodes)
        one, round_off = np.ones(k), np.full(k, EPS * float(np.abs(x[sides.nodes]).max()))
        k_n = self.stiffness * one
        f = forces(
            stencils, one, Scale(k_n, k_n, one, k_n), np.zeros((k, 2)), ContactRecord.initial(k, 1), None, At(), round_off,
            np.full(k, DECIDE, dtype=np.int8),
        )  # fmt: skip
        area = np.maximum(stencils.coef, 0.0).sum(axis=1)
        floor = float((area * k_n * f.dp[:, 0] * round_off).sum())
        part = Part(self.name, stencils.dofs, -f.F, f.K if ask.stiffness else None)
        return Response([part], scale=float(np.abs(f.F).sum()), floor=floor)
