"""The checks of a run by the moment at which they look; a new one is a file and an entry in one of these lists."""

from __future__ import annotations

from functools import partial

from prensa.checks.after.bent_metal import MetalBends
from prensa.checks.after.between_nodes import BetweenNodes, OnFiner
from prensa.checks.after.beyond_shear import BeyondShear
from prensa.checks.after.coarse_tools import CoarseTools
from prensa.checks.after.corners_of_faces import corners_of_faces
from prensa.checks.after.friction_hills import FrictionHills
from prensa.checks.after.out_of_shape import OutOfShape
from prensa.checks.after.quality import PenaltyShare, UntouchedTools, hidden_forces, penetrations, soft_springs
from prensa.checks.before.table_starts import table_jumps
from prensa.checks.check import (
    Attempted,
    Check,
    Committed,
    Failed,
    Finished,
    Refusal,
    Rejected,
    Solved,
    StepBegun,
)
from prensa.checks.during.acceptance import Corners, deformation, support, tunnelling, turning, unilateral_support
from prensa.checks.during.closing import Closing
from prensa.checks.during.distortion import Distortion
from prensa.checks.during.folding import Folding
from prensa.checks.during.penetration import Penetration
from prensa.checks.during.self_intersection import SelfIntersection
from prensa.checks.during.symmetry_planes import Passing, symmetry_planes
from prensa.checks.during.tool_balance import tool_balance
from prensa.checks.during.validity import Validity
from prensa.policy import Policy
from prensa.system.failure import Failure
from prensa.system.interaction import Context
from prensa.system.outcome import NewtonResult
from prensa.system.system import System


class RunChecks:
    """The checks of a run of a system; ``validity``: that of the run up to here, where it goes on on another system.

    ``on_finer``: who computes the surroundings of contacts on finer elements; None: nobody.
    """

    def __init__(
        self, system: System, policy: Policy, validity: Validity | None = None, on_finer: OnFiner | None = None
    ) -> None:
        self.policy, self.between_nodes = policy, BetweenNodes(system, on_finer)
        corners = Corners(system)
        self.folding = folding = Folding(system, policy, corners)
        self.closing = Closing(system)
        self.validity = validity or Validity(system, policy)
        self.penalties = penalties = PenaltyShare(system)
        self.untouched, self.metal_bends = UntouchedTools(system, self.between_nodes), MetalBends(system)
        self.hills = FrictionHills(system)
        self.beyond_shear = BeyondShear(system, self.hills.reported)
        self.step_begins: list[Check[StepBegun]] = [partial(table_jumps, system)]
        passing = Passing(system)
        # Each list has what there is to look at: in small strain no element folds, and no outline comes near itself.
        finite, space = system.problem.kinematics != "small", system.dofs.dimension == 3
        self.attempted: list[Check[Attempted]] = [
            partial(tunnelling, system, policy), partial(turning, system, policy), partial(support, system),
            *([partial(deformation, system, policy, corners)] if finite else []),
        ]  # fmt: skip
        self.rejected: list[Check[Rejected]] = [Distortion(system, policy)]
        self.solved: list[Check[Solved]] = [
            Penetration(system, folding if finite else None), symmetry_planes, *([passing] if passing.guard else []),
            *([self.closing] if finite else []), SelfIntersection(system), *([folding] if finite else []),
        ]  # fmt: skip
        bent = [self.metal_bends.note] if self.metal_bends.open else []
        self.committed: list[Check[Committed]] = [self.validity, penalties, folding.note, self.untouched.note, *bent]
        self.step_ends: list[Check[Committed]] = [
            partial(penetrations, system), partial(hidden_forces, system), partial(soft_springs, system),
            *([self.between_nodes] if self.between_nodes.contacts else []),
            *([self.metal_bends] if self.metal_bends.open else []), *([self.hills] if self.hills.open else []),
            *([self.beyond_shear] if self.beyond_shear.open else []),
        ]  # fmt: skip
        self.shape = OutOfShape(system, policy)
        if space:
            self.committed.append(self.shape.note)
            self.step_ends += [CoarseTools(system), partial(corners_of_faces, system)]
        self.tools_leave: list[Check[Finished]] = [self.untouched.warnings]
        self.run_ends: list[Check[Finished]] = [
            *self.tools_leave, self.validity.warnings, penalties.warnings, folding.warnings, self.shape.warnings,
        ]  # fmt: skip
        self.up_to_here: list[Check[Failed]] = [self.validity.warnings, folding.warnings, self.shape.warnings]
        # Who asks stops at the first finding that ends the run: what the run has seen up to here comes before that.
        self.failed: list[Check[Failed]] = [
            *self.up_to_here, partial(tool_balance, system), partial(unilateral_support, system),
        ]  # fmt: skip

    def of(self, system: System) -> RunChecks:
        """Those of the rest of the run, which goes on on another system of the same meshes."""
        rest = RunChecks(system, self.policy, self.validity, self.between_nodes.on_finer)
        rest.closing.known = dict(self.closing.known)
        rest.penalties.go_on_from(self.penalties)
        rest.folding.go_on_from(self.folding)
        rest.shape.go_on_from(self.shape)
        rest.untouched.reached = self.untouched.reached
        rest.between_nodes.reported |= self.between_nodes.reported
        rest.metal_bends.open &= self.metal_bends.open
        rest.hills.open &= self.hills.open
        rest.hills.reported |= self.hills.reported
        rest.beyond_shear.open &= self.beyond_shear.open
        return rest

    def refusal(self, c: Context, result: NewtonResult) -> Failure | None:
        """Why a converged attempt at an increment is refused; None if it is not, or did not converge."""
        if not result.converged or result.evaluation is None:
            return None
        given = Attempted(c, result)
        # The first refusal ends the search; `deformation`, which looks at every element, is the last in the list.
        return next((f.reason for check in self.attempted for f in check(given) if isinstance(f, Refusal)), None)
