"""Is Newton's matrix of a step symmetric? Known from the structure of the problem, before any number of it.

It is where everything derives from an energy: hyperelastic laws and associative flow of a stress limit that does not depend
on the volume, elements whose forces are derivatives of their strains, contact without friction, dead loads. F-bar in
finite strain integrates the virtual work of another deformation gradient than that of its gradients and is not
symmetric (de Souza Neto et al. 1996); Coulomb friction is not (its limit depends on the pressure), nor are follower loads
on part of a boundary, nor weighted gaps between bodies. On the undeformed geometry the gap changes with a tool along the
tool's normal, the force acts along the surface's: symmetric among the nodes, not towards a tool that is free to move.

One F-bar element has an energy: neo-Hooke in plane strain. Its forces are those of ∫ μ/2 tr b dV + V (λ/2 ln²J₀ − μ ln J₀),
because (J/J₀) τ(f̄) = μ b + (J/J₀)(λ ln J₀ − μ) I and the area of a quadrilateral, ∫J dV, is J₀ times a constant.
"""

from __future__ import annotations

import numpy as np

from prensa.system.assembly import Block
from prensa.system.schedule import StepPlan
from prensa.system.system import System


def is_symmetric(system: System, plan: StepPlan) -> bool:
    """Whether the matrix of the free degrees of freedom is symmetric throughout a step. No matrix is ever made symmetric."""
    return (
        plan.control is None
        and all(b.law.symmetric and (b.element.symmetric(b.mode) or _has_energy(b)) for b in system.blocks)
        and all(system.frictionless(d) for d in plan.friction)
        and not system.problem.body_contacts
        and not any(load.follower for load in plan.loads.values())
        and (system.problem.contact_geometry == "current" or _tools_are_prescribed(system, plan))
    )


def is_linear(b: Block) -> bool:
    """Whether the forces of a body are linear in its displacements: Hooke's law in small strain, in any element."""
    return b.law.linear


def _has_energy(b: Block) -> bool:
    return b.element.like_neo_hooke and b.law.fbar_has_energy and not b.mode.axisymmetric


def _tools_are_prescribed(system: System, plan: StepPlan) -> bool:
    """Whether every unknown of the tools in contact is prescribed."""
    dofs = [system.masters[s.against].dofs for s in system.surfaces]
    return bool(np.isin(np.concatenate(dofs), plan.fixed).all()) if dofs else True
