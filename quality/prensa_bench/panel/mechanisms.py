"""All special mechanisms of the solver by name: those that save time or cuts, and those that guard against wrong answers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from prensa import analysis
from prensa.checks.after import passages
from prensa.checks.after.passages import Passages
from prensa.checks.during import acceptance, penetration, self_intersection
from prensa.checks.during.distortion import Distortion
from prensa.checks.during.validity import Validity
from prensa.result.increment import Mean
from prensa.solver import attempt, contact_lcp, increment_solver, newton, predictor, stability, time_stepping
from prensa.solver.approach import Approach
from prensa.solver.before_folds import Halved
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.finish import Finish
from prensa.solver.newton_state import NewtonState
from prensa.solver.predictor import Guess
from prensa.solver.stabilisation import Stabilisation
from prensa.solver.step_control import StepControl
from prensa.system.failure import NotConverged
from prensa.system.state import State
from prensa.tools import patches
from prensa.tools.curved import Curved
from prensa.types import Array, Index
from prensa_bench.panel.composition import Mechanism, Replaced, replaced

NEVER = 10**12


def _nothing(*_: Any, **__: Any) -> None:
    """The neutral element of whatever may find nothing."""


def _no(*_: Any, **__: Any) -> bool:
    return False


def _as_it_is(new: Any, outcome: Any, *_: Any) -> Halved:
    """The increment as long as it was."""
    return Halved(outcome, False)


def _yes(*_: Any, **__: Any) -> bool:
    return True


def _none_of_them(*_: Any, **__: Any) -> list[Any]:
    return []


def _forgetful(original: Callable[..., Any]) -> Callable[..., Any]:
    """Newton's direction (see `newton._newton_direction`) without the points that reversed their slip."""

    def direction(eq: Equilibrium, state: NewtonState, stick: Any) -> Any:
        return original(eq, state, None)

    return direction


def _on_and_on(original: Callable[..., Any]) -> Callable[..., Any]:
    """A line search (see `newton._search_line`) that remembers nowhere where it failed."""

    def search(eq: Equilibrium, state: NewtonState, *more: Any) -> Any:
        state.stuck.clear()
        return original(eq, state, *more)

    return search


def _without_stick(original: Callable[..., Any]) -> Callable[..., Any]:
    """A contact step in which nothing is forced to stick."""

    def step(eq: Equilibrium, u: Any, lam: Any, e: Any, stick: Any = None, **more: Any) -> Any:
        return original(eq, u, lam, e, None, **more)

    return step


def _frictionless_alone(original: Callable[..., Any]) -> Callable[..., Any]:
    """Candidates whose friction a contact step decides: none, where any has friction."""

    def rubbing(eq: Equilibrium, e: Any, at: Any) -> Any:
        found = original(eq, e, at)
        return None if found is not None and found.any() else found

    return rubbing


def _by_newton(original: Callable[..., NewtonState]) -> Callable[..., NewtonState]:
    """The state before the first iteration (see `newton.init`), from which the next step is Newton's."""

    def init(eq: Equilibrium, guess: Guess, lam: Any) -> NewtonState:
        state = original(eq, guess, lam)
        state.by_contact = False
        return state

    return init


def _plain_step(eq: Equilibrium, start: Any, values: Any, lam: Any) -> Guess:
    """The committed state with what is prescribed where it ends: no linear system is solved for a first guess."""
    u = start.copy()
    u[eq.reduced.fixed] = values
    return Guess(eq.system.with_slaves(u))


def _unfinished(eq: Equilibrium, done: Finish, lam: Any, followed: Any = None) -> tuple[Finish, bool]:
    """A converged iterate as it is (see `finish`)."""
    return done, _within(done, eq)


def _within(self: Finish, eq: Equilibrium) -> bool:
    """Whether residual and constraints are within the tolerance, with no regard to digits beyond it."""
    return self.within(eq) and not self.evaluation.violation > eq.policy.exact_gap_ratio


def _as_it_was(system: Any, c: Any, e: Any, u: Any, step: Any, lam: Any) -> Any:
    return system.with_slaves(u + step)


def _straight(self: State, du: Any, dt: float, nodal: slice) -> tuple[Any, float]:
    return np.zeros_like(du), 0.0


def _attempted(eq: Equilibrium, result: Any, *_: Any) -> Any:
    return result


def _uncut(system: Any, state: Any, plan: Any, end: float, *_: Any) -> tuple[float, list[str]]:
    return end, []


def _where_they_are(system: Any, c: Any, *_: Any) -> Approach:
    return Approach(c.state.u)


def _unlimited(*_: Any) -> float:
    return float("inf")


def _last_values(self: Passages) -> dict[str, Mean]:
    """Forces at the end of the increment in the place of their means over a passage."""
    return {column: Mean(float(value), 0.0) for column, value in zip(self.columns, self._rows[-1].values)}


def _nearest_patch(self: Curved, xi: Array) -> tuple[Index, Index, Array]:
    """Triangles nearest to points (k, 3) with no ties between them: as if all were flats, of which there are none."""
    k, flats = len(xi), np.ones(len(self.facets.flats), dtype=bool)
    triangle, where, at = np.zeros(k, dtype=np.int64), np.zeros(k, dtype=np.int64), np.zeros((k, 2))
    patches.nearest(
        self._P, self._C, self._R, self._T, self._curved, flats, self._kinds, *self.facets.around, *self._tree,
        xi, triangle, where, at,
    )  # fmt: skip
    return triangle, where, at


TIMELY = (
    # ------------------------------------------------------------------------------------------------ globalisation
    Mechanism(
        "line_search",
        "A full step that raises the residual is shortened to the best of a few fractions.",
        (replaced(newton, newton._accepted, _yes),),
    ),
    Mechanism(
        "nonlinear_elimination",
        "The few nodes that alone hold up an iteration find their equilibrium with all others held.",
        (replaced(newton, newton.eliminated, _nothing), replaced(newton, newton.applies, _no)),
    ),
    Mechanism(
        "secant_where_flow_turns",
        "Where plastic flow is likely to turn, the matrix goes part of the way to the secant moduli.",
        (replaced(Equilibrium, Equilibrium.flow_direction_unreliable, _no),),
    ),
    Mechanism(
        "gap_correction",
        "After a step closed contact nodes are put at the gap of the linear model.",
        (
            replaced(newton, newton.contact_corrected, _as_it_was),
            replaced(predictor, predictor.contact_corrected, _as_it_was),
        ),
    ),
    Mechanism(
        "cycling",
        "An attempt ends where no part of a step lowers the residual, the second time in the same active set of contact.",
        (replaced(newton, newton._search_line, _on_and_on(newton._search_line)),),
    ),
    # ------------------------------------------------------------------------------------------ contact and friction
    Mechanism(
        "edge_step",
        "Newton's step decides on the points that it opens and closes at the edges of contacts.",
        (replaced(newton, newton.edge_step, lambda eq, e, lam, step: step),),
    ),
    Mechanism(
        "contact_step",
        "Steps with the contact conditions as inequalities, where Newton's assumptions on them were wrong.",
        (
            replaced(newton, newton.contact_step, _nothing),
            replaced(attempt, attempt._by_contact, lambda eq, start, lam, result: NotConverged(0, float("inf"))),
        ),
    ),
    Mechanism(
        "contact_step_retry",
        "An attempt that failed while contact changed is made again with contact steps alone.",
        (replaced(attempt, attempt._by_contact, lambda eq, start, lam, result: NotConverged(0, float("inf"))),),
    ),
    Mechanism(
        "friction_step",
        "Contact steps decide which points stick and slip together with their pressures.",
        (replaced(contact_lcp, contact_lcp._rubbing, _frictionless_alone(contact_lcp._rubbing)),),
    ),
    Mechanism(
        "forced_stick",
        "A point that reversed its slip sticks in the next matrix, where no contact step decides on it.",
        (
            replaced(newton, newton._newton_direction, _forgetful(newton._newton_direction)),
            replaced(newton, newton.contact_step, _without_stick(newton.contact_step)),
        ),
    ),
    # ------------------------------------------------------------------------------------------------- initial guess
    Mechanism("predictor", "An increment starts where the last two lead.", numerics={"predictor": False}),
    Mechanism(
        "quadratic_predictor",
        "The second difference of the last increments goes into the predictor, as far as it repeats itself.",
        (replaced(State, State.damped_difference, _straight),),
    ),
    Mechanism(
        "prediction_projected",
        "Predicted contact nodes are put at their extrapolated gaps, others out of the tools.",
        (replaced(predictor, predictor.project_prediction, _nothing),),
    ),
    Mechanism(
        "linearised_start",
        "Where nothing is extrapolated, an increment starts from the answer of the linearised system.",
        (replaced(predictor, predictor._linearised, _plain_step),),
    ),
    Mechanism(
        "contact_in_first_guess",
        "In space the linearised system of the first guess decides which points are in contact, stick and slip.",
        (replaced(predictor, predictor._by_contact, _nothing),),
    ),
    Mechanism(
        "flow_in_first_guess",
        "Where metal flows in a first guess with contact decided, that is found twice more, from its middle with secant moduli.",
        (replaced(predictor, predictor._flows, _no),),
    ),
    Mechanism(
        "contact_after_first_guess",
        "Where metal still flows in a first guess with contact decided, Newton's iteration begins with contact steps.",
        (replaced(newton, newton.init, _by_newton(newton.init)),),
    ),
    Mechanism(
        "volume_put_right",
        "Where metal still flows in a first guess, steps are corrected with their factors while that lowers the residual.",
        (replaced(newton, newton._volume_put_right, lambda eq, u, lam, full, secant: (u, full)),),
    ),
    Mechanism(
        "linear_start_at_first_touch",
        "Where tools meet bodies at rest, their rest is not extrapolated: the increment starts from the linearised system.",
        (replaced(predictor, predictor._first_touch, _no),),
    ),
    # ------------------------------------------------------------------------------------------------------- finish
    Mechanism(
        "finish",
        "Nearly converged iterates are brought home by substitutions with the factors at hand.",
        (replaced(newton, newton.finish, _unfinished), replaced(newton, newton._followed, _nothing)),
        policy={"finish_from_residual": 0.0},
    ),
    Mechanism(
        "following",
        "Finishing corrections go by the matrix at the iterate, with factors of the one before and GMRES.",
        (replaced(newton, newton._followed, _nothing), replaced(newton, newton._follows, _no)),
    ),
    # --------------------------------------------------------------------------------------------------- increments
    Mechanism(
        "bdf2",
        "Plastic flow of second order in time, with increments twice as long.",
        numerics={"time_rule": "backward_euler"},
    ),
    Mechanism(
        "bdf2_where_steady",
        "Flow is of second order in time by itself only where it is steady.",
        policy={"unsteady_share": 1e9},
    ),
    Mechanism(
        "strain_bound",
        "Automatic increments are bounded by the plastic strain of the last one.",
        (replaced(StepControl, StepControl._strain, lambda self, grown, allowed: 0.0),),
    ),
    Mechanism(
        "travel_bound",
        "Automatic increments are bounded by the travel of tools past the contact elements.",
        (replaced(StepControl, StepControl._speeds, lambda self: np.zeros(len(self.system.surfaces))),),
    ),
    # ------------------------------------------------------------------------------------------------- linear algebra
    Mechanism(
        "condensation",
        "Linear bodies are factored once and condensed onto their contact unknowns.",
        numerics={"condense": False},
    ),
    Mechanism(
        "single_precision",
        "Large systems are factored in single precision, and GMRES makes the rest.",
        policy={"single_precision_from": NEVER},
    ),
    Mechanism(
        "iterative_in_space",
        "Large systems in space are solved by GMRES with LDLᵀ of a symmetric matrix or with multigrid.",
        policy={"iterative_from": NEVER, "multigrid_from": NEVER},
    ),
    Mechanism(
        "pressures_apart",
        "Multigrid in space takes most of the bulk stiffness of elements that hardly change their volume apart, as pressures.",
        policy={"multigrid_incompressible": 0.0},
    ),
    Mechanism(
        "reuse_of_factors",
        "Factors of a matrix before serve where the iterate's is close to it.",
        numerics={"reuse_factors": False},
    ),
    Mechanism(
        "factors_of_last_step",
        "A step takes the factors of the matrix before it and GMRES where few contact points changed.",
        policy={"same_matrix_residual": 0.0},
    ),
    Mechanism(
        "inexact_steps",
        "Linear systems are solved to the digits that quadratic convergence promises.",
        (Replaced(NewtonState, "promised", property(lambda self: 0.0)),),  # type: ignore[arg-type]
    ),
    Mechanism(
        "stability_rests",
        "Stability is not looked at while its softest modes were far from turning.",
        (replaced(stability, stability.rests, _no),),
    ),
)

GUARDS = (
    Mechanism(
        "balanced_increments",
        "Automatic increments are as short as the energy balance asks for.",
        (replaced(time_stepping, time_stepping.balanced, lambda outcome, *_: outcome),),
        guard="tests/solver/test_time_stepping.py::test_automatic_increments_balance_where_a_tool_passes_from_node_to_node",
    ),
    Mechanism(
        "stability",
        "Unstable equilibria are refused, and limit points are named.",
        (replaced(increment_solver, increment_solver.judged, _attempted),),
        guard="tests/solver/test_stability.py::test_a_pushed_arch_ends_at_its_limit_point",
    ),
    Mechanism(
        "jump_noticed",
        "An increment that leads past unstable states to another branch is cut, or ends at a limit point.",
        (replaced(stability, stability.jumped, _no),),
        guard="tests/solver/test_stability.py::test_a_push_far_beyond_the_limit_load_does_not_jump_over_it",
    ),
    Mechanism(
        "limit_points_of_friction",
        "A failure between active sets whose tangents have determinants of opposite signs is named a limit point.",
        (replaced(stability, stability.eigenvalue_across_sets, _nothing),),
        guard="tests/solver/test_branches.py::test_an_ironing_that_friction_ends_is_a_limit_point_with_its_eigenvalue",
    ),
    Mechanism(
        "branch_beside",
        "Where an equilibrium is unstable, a stable one is looked for beside it: perfect structures buckle.",
        (replaced(stability, stability.beside, _nothing),),
        guard="tests/solver/test_stability.py::test_a_straight_column_buckles_and_says_so",
    ),
    Mechanism(
        "elastic_jump",
        "Elastic bodies without friction go from a limit point to the next stable equilibrium.",
        (replaced(stability, stability.jump, _nothing),),
        guard="tests/solver/test_stability.py::test_elastic_bodies_without_friction_jump_by_themselves",
    ),
    Mechanism(
        "jump_under_viscous_forces",
        "An increment under viscous forces that jumps too far for its energy to be seen is cut.",
        (replaced(Stabilisation, Stabilisation.jumped_over, _no),),
        guard="tests/contact/test_held_corners.py::test_a_jump_is_cut_where_the_energy_balance_misses_too_much",
    ),
    Mechanism(
        "passages",
        "Forces that ripple as elements pass are given as means over one passage.",
        (replaced(Passages, Passages.means, _last_values),),
        guard="tests/checks/test_passages.py::test_means_of_drawing_are_nearer_to_those_of_many_increments_than_the_trapezoid",
    ),
    Mechanism(
        "force_jumps",
        "The time of a jump of forces within an increment is read off its work.",
        (replaced(passages, passages.jump_of, lambda *_: float("nan")),),
        guard="tests/checks/test_passages.py::test_means_of_drawing_are_nearer_to_those_of_many_increments_than_the_trapezoid",
    ),
    Mechanism(
        "small_after_touch",
        "Metals begin with a small increment after a first touch.",
        (replaced(StepControl, StepControl._landed, _unlimited),),
        guard="tests/solver/test_time_stepping.py::test_the_energy_balance_sees_a_flat_side_land",
    ),
    Mechanism(
        "digits",
        "Converged iterates are improved beyond the tolerance, since tools' forces are sums over all nodes.",
        (replaced(Finish, Finish.fine, _within),),
        guard="tests/solver/test_enough_digits.py::test_forces_between_tools_balance_beyond_the_tolerance",
    ),
    Mechanism(
        "penetration",
        "A run ends where metal lies inside a tool with which it has no contact.",
        (replaced(penetration, penetration.inside, _nothing),),
        guard="tests/checks/test_penetration.py::test_metal_inside_a_tool_stops_the_run",
    ),
    Mechanism(
        "self_intersection",
        "A run ends where the outline of a body passes through itself.",
        (replaced(self_intersection, self_intersection.fold, _nothing),),
        guard="tests/checks/test_early_end.py::test_a_body_that_passes_through_itself_is_reported",
    ),
    Mechanism(
        "contacts_on_finer_elements",
        "Contacts of few nodes are computed once more on finer elements, and forces that are off are reported.",
        (replaced(analysis, analysis.missed_on_finer, _nothing),),
        guard="tests/checks/test_between_nodes.py::test_forces_that_are_too_large_are_reported_too",
    ),
    Mechanism(
        "before_folds",
        "Increments end before an outline closes on itself, so that a fold is reported while it is open.",
        (replaced(time_stepping, time_stepping.before_it_closes, _as_it_is),),
        guard="tests/checks/test_before_folds.py::test_a_fold_is_reported_while_it_is_open",
    ),
    Mechanism(
        "release",
        "Forces that a step no longer asks for go linearly to zero over it.",
        (replaced(time_stepping, time_stepping.release_forces, _nothing),),
        guard="tests/system/test_step_release.py::test_a_support_is_released_linearly",
    ),
    Mechanism(
        "tunnelling",
        "An increment in which a node goes through a thin tool, or a tool turns through a body, is refused.",
        (
            replaced(acceptance, acceptance.tunnelled, _nothing),
            replaced(acceptance, acceptance.turned_through, _nothing),
        ),
        guard="tests/contact/test_turns.py::test_a_tool_that_is_not_round_does_not_turn_through_the_body",
    ),
    Mechanism(
        "lost_support",
        "An increment in which a body's last hold opens is refused.",
        (replaced(acceptance, acceptance.lost_support, _nothing),),
        guard="tests/solver/test_guards.py::test_a_strip_that_its_last_tool_has_left_is_refused",
    ),
    Mechanism(
        "jumped_elements",
        "Corners that jump beyond 180° and plastic strains above 1 within an increment are refused.",
        (replaced(acceptance, acceptance._deformed, lambda *_: iter(())),),
        guard="tests/solver/test_guards.py::test_an_increment_that_is_far_too_long_is_not_taken_to_another_solution",
    ),
    Mechanism(
        "validity",
        "Small-strain kinematics and tables used beyond what they hold for are refused or reported.",
        (replaced(Validity, Validity.look, _nothing),),
        guard="tests/checks/test_validity.py::test_small_strain_is_refused_where_it_means_nothing",
    ),
    Mechanism(
        "worn_elements",
        "A run ends where the same element fails again and again.",
        (replaced(Distortion, Distortion.rejected, _nothing),),
        guard="tests/checks/test_early_end.py::test_an_element_on_which_attempts_fail_again_and_again_ends_the_run",
    ),
    Mechanism(
        "lines_of_symmetry",
        "A free side that comes to a line or plane of symmetry meets its mirror image there.",
        (replaced(analysis, analysis.guard_of, _nothing),),
        guard="tests/system/test_symmetry_planes.py::test_a_line_of_symmetry_is_a_plane_written_by_hand",
    ),
    Mechanism(
        "checks_before_a_run",
        "Descriptions that cannot be solved are refused before the run.",
        (replaced(analysis, analysis.preflight, _none_of_them),),
        guard="tests/checks/test_preflight.py::test_a_tool_that_lies_within_a_body_is_refused",
    ),
    # ------------------------------------------------------------ what some inputs cannot be solved, or ended, without
    Mechanism(
        "runaway",
        "Steps farther than any meant motion end an attempt, with the part that is free to move.",
        (replaced(Equilibrium, Equilibrium.runaway, _nothing),),
        guard="tests/solver/test_guards.py::test_a_roll_that_friction_cannot_brake_is_named_at_once",
    ),
    Mechanism(
        "cut_before_touch",
        "An increment in which a tool first touches a body ends there.",
        (replaced(time_stepping, time_stepping.first_touch, _uncut),),
        guard="tests/solver/test_time_stepping.py::test_the_energy_balance_sees_a_flat_side_land",
    ),
    Mechanism(
        "pushed_tools_brought",
        "Tools driven by force are brought to where they touch before the increment is solved.",
        (replaced(increment_solver, increment_solver.approach_of_tools, _where_they_are),),
        guard="tests/solver/test_time_stepping.py::test_a_pushed_tool_comes_from_afar_and_says_so",
    ),
    Mechanism(
        "floating_bodies",
        "Bodies that nothing holds yet move as rigid ones with the tools until they are clamped.",
        (replaced(increment_solver, increment_solver.approach_of_bodies, _nothing),),
        guard="tests/solver/test_floating_bodies.py::test_a_billet_between_two_gaps_is_pressed_as_one_that_touches",
    ),
    Mechanism(
        "overlap_stages",
        "Tools that start inside bodies are drawn back and go in again in stages.",
        (replaced(attempt, attempt.overlap_stages, _none_of_them),),
        guard="tests/checks/test_early_end.py::test_a_tool_three_elements_inside_an_elastic_body_is_pressed_out_at_once",
    ),
    Mechanism(
        "ties_of_patches",
        "Within a band about a smooth side of STL patches the first of the triangles there has a point, whichever is nearer.",
        (replaced(Curved, Curved._nearest, _nearest_patch),),
        guard="tests/tools/test_stl.py::test_nodes_that_symmetry_keeps_on_sides_and_corners_of_triangles",
    ),
    Mechanism(
        "friction_that_holds",
        "Where friction alone holds a tool, a step decides which of its points stick before the tool runs away.",
        (replaced(newton, newton.held_by_friction, _no),),
        guard="tests/solver/test_idle_pulleys.py::test_belts_of_any_size_go_over_idle_pulleys",
    ),
)

MECHANISMS = {m.name: m for m in (*TIMELY, *GUARDS)}
SETS = {"edge_step, cycling": ("edge_step", "cycling")}
