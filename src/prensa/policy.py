"""Tuning constants of the solver, in groups; dimensionless where no unit is named. You should rarely need to change them.

A group is a dataclass of its own, and `Policy` is all of them: a function that needs the lengths of increments takes `StepRules`.
Thresholds that only one check has stand beside that check.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerances:
    """How exactly equations are solved. Relative residuals are over the sum of the forces' sizes."""

    finish_from_residual: float = 1e-5
    """Relative residual below which the factors at hand may finish the work: substitutions then converge quickly enough."""
    fine_residual: float = 1e-11
    """Relative residual to which converged iterates are improved, because sums over all nodes need these digits."""
    fine_ratio_moved_tools: float = 10.0
    """Multiple of `fine_residual` that is enough where all tools are moved, because no force balance rests on those digits."""
    contact_share_moved_tools: float = 1e-8
    """Share of the contact forces that the residual may be where `fine_ratio_moved_tools` holds."""
    sum_share_moved_tools: float = 1e-10
    """Share of the contact forces that the residual's sum along an axis may be where `fine_ratio_moved_tools` holds."""
    linear_share_last_step: float = 0.3
    """Share of the residual still allowed that the linear equations of a step that can be the last leave."""
    exact_gap_ratio: float = 1e-12
    """Penetration and elastic slip over the element depth that exact contacts reach, about the round-off of coordinates."""
    substitutions_per_factorisation: int = 4
    """Substitutions, with an evaluation each, that cost as much as a factorisation with its own."""
    expected_rate: float = 1e-3
    """Ratio of successive residuals that a substitution with new factors is expected to have."""
    expected_rate_last_step: float = 3e-3
    """Ratio of residuals that must be enough for the first substitution before its evaluation also makes the matrix at
    the solution.
    """
    max_substitution_rate: float = 0.3
    """Ratio of successive residuals above which substitutions with old factors are given up."""
    round_off_ratio_at_rest: float = 10.0
    """Residual over its estimated round-off at which an iterate that substitutions no longer change counts as converged."""
    small_slip_ratio: float = 1e-3
    """Share of the increment's slip below which the tangential error of an augmented contact does not matter."""
    weak_multiplier_share: float = 1e-6
    """Share of a multiplier's equation on free dofs below which the equation counts as redundant."""
    redundant_shift_ratio: float = 1e-10
    """Share of a redundant multiplier's equation put on its diagonal, so that redundant constraints share what they carry."""
    beyond_bound_ratio: float = 10.0
    """Tangential traction over pressure that lies beyond every friction bound in use."""
    until_share: float = 1e-8
    """Share of its target (of the element depth for a contact) within which the criterion that ends a step is met."""
    until_time_share: float = 1e-12
    """Share of the step within which the end of a step is located where its criterion jumps."""
    until_force_strain: float = 1e-3
    """Elastic strain whose forces are the scale of a force that is to vanish."""
    until_early_share: float = 1e-3
    """Share of a step after which a criterion that is still far from met is questioned, because units differ by factors
    of 1000.
    """
    gripped_strain: float = 1e-6
    """Elastic strain whose forces count as tools having gripped a body that is fed to them."""


@dataclass(frozen=True)
class StepRules:
    """How long increments are."""

    first_share: float = 0.0025
    """First increment of a step without 'increments', as a share of the step; small, since contact and yielding begin there."""
    max_share: float = 0.1
    """Longest automatic increment, as a share of the step."""
    travel_in_elements: float = 0.3
    """Tool travel per automatic increment in contact element sizes, so that no element is passed unseen."""
    plastic_strain_increment: float = 0.01
    """Equivalent plastic strain per automatic increment, which bounds the error of the return map's path."""
    plastic_quantile: float = 0.95
    """Share of the points that `plastic_strain_increment` bounds; a singular corner would rule the step otherwise."""
    second_order_factor: float = 2.0
    """Factor on travel and strain where plastic flow is of second order in time."""
    unsteady_share: float = 0.05
    """Share of the flow by which first and second order may differ in an increment that is of second order."""
    min_plastic_shortening: float = 0.1
    """Share of an increment below which plastic strain alone does not shorten the next one."""
    easy_iterations: int = 5
    """Newton iterations up to which the next automatic increment grows by `growth_factor`."""
    recover_iterations: int = 7
    """Newton iterations up to which a given increment that was cut grows again by `recovery_factor`."""
    hard_iterations: int = 10
    """Newton iterations beyond which the next automatic increment shrinks to `shrink_factor`."""
    growth_factor: float = 1.5
    """Growth of an automatic increment after an easy one."""
    recovery_factor: float = 2.0
    """Growth of an increment back to its given length, or to the least, after a cut."""
    shrink_factor: float = 0.7
    """Ratio of an automatic increment to the hard one before."""
    cut_factor: float = 0.25
    """Ratio of an increment to the rejected one before; a quarter, since halves of what fails mostly fail too."""
    min_share: float = 1e-5
    """Share of the step below which increments become shorter by failure alone."""
    jump_share_of_step: float = 1e-12
    """Share of the step below which time would stand still, so that what needs it is treated as a jump."""
    min_share_before_touch: float = 0.02
    """Share of the increment before a first touch below which the increment is not split there."""
    min_share_left: float = 1e-9
    """Share of a step below which what is left of it is no increment of its own."""
    max_touch_samples: int = 200
    """Most times within an increment at which a first touch is looked for."""
    extra_jump_cuts: int = 8
    """Cuts of an increment beyond `Numerics.max_cutbacks` where viscous forces hold the body, because jumps are short."""
    jump_imbalance_share: float = 2e-4
    """Energy imbalance of an increment with viscous forces over the work so far, above which a jump is followed in
    shorter increments.
    """
    jump_increment_share: float = 0.1
    """Share of the increment's own work that the imbalance must exceed for `jump_imbalance_share` to apply."""
    jump_travel_in_elements: float = 0.5
    """Travel of a contact surface in element sizes that an increment must exceed for `jump_imbalance_share` to apply, unless
    viscous forces take more than is put in.
    """
    remesh_after_cuts: int = 3
    """Cuts of an increment after which a new mesh helps more than another cut."""
    retry_after_cuts: int = 2
    """Cuts of an increment after which a failed attempt is followed by one with contact steps alone; most failures need
    the cut only.
    """


@dataclass(frozen=True)
class Globalisation:
    """How Newton's method is started and kept on course: prediction, line search, secants, contact steps, rigid-body
    approach.
    """

    good_start_residual: float = 0.05
    """Relative residual of the extrapolation below which no better initial guess is looked for."""
    landed_start_ratio: float = 1e-11
    """Penetration over element depth given to a node that lands, so that round-off does not decide whether it has."""
    line_search_factors: tuple[float, ...] = (0.5, 0.25, 0.1, 0.03)
    """Fractions of a step that the line search tries after the full step."""
    close_residual: float = 2e-3
    """Relative residual below which an iteration is expected to converge, so that no further matrix is prepared."""
    unreliable_flow_first: float = 0.15
    """Relative residual of the initial guess above which the direction of plastic flow is unreliable and the matrix is
    a secant.
    """
    unreliable_flow_later: float = 0.01
    """Relative residual of later iterates above which the direction of plastic flow is unreliable."""
    unreliable_flow_elements: int = 300
    """Number of elements for which `unreliable_flow_first` and `unreliable_flow_later` hold; they fall in inverse
    proportion beyond it in second order.
    """
    min_unreliable_flow_ratio: float = 0.05
    """Least ratio to which those limits fall with the number of elements."""
    secant_share: float = 0.5
    """How far the matrix goes from the tangent (0) to the secant (1) where the flow direction is unreliable."""
    unreliable_flow_second_order: float = 0.04
    """`unreliable_flow_first` in increments of second order, which are twice as long."""
    secant_share_second_order: float = 0.75
    """`secant_share` in increments of second order."""
    first_step_growth: float = 2.0
    """Growth of the residual above which the first step of an increment of second order is shortened."""
    local_slow_ratio: float = 0.02
    """Ratio of successive residuals above which a few nodes are taken to hold up the iteration and are solved for alone."""
    local_from_residual: float = 1e-4
    """Relative residual above which a few nodes are solved for alone; below it Newton is about to converge."""
    local_residual_share: float = 0.8
    """Share of the residual that those few nodes must hold."""
    local_max_share: float = 0.35
    """Share of all dofs that those nodes and their neighbours may be at most."""
    local_small_dofs: int = 300
    """Dofs below which a body counts as small, where evaluations cost little."""
    local_max_share_small: float = 0.15
    """Share of all dofs that those nodes may be at most in a body that is not small."""
    local_max_dofs: int = 400
    """Dofs that are solved for alone at most, because their matrix is dense."""
    local_max_steps: int = 6
    """Newton steps of the few nodes at most."""
    local_search_factors: tuple[float, ...] = (0.5, 0.25, 0.1)
    """Fractions of such a step that its line search tries after the full step."""
    local_residual_ratio: float = 0.05
    """Ratio of their residual to the first at which the few nodes are left again."""
    max_displacement_ratio: float = 1e3
    """Displacement over the size of the bodies in one increment, beyond which a node or tool counts as held by nothing."""
    max_rotation: float = 10.0
    """Rotation (rad) in one increment, beyond which a tool counts as held by nothing."""
    candidate_gap_ratio: float = 0.5
    """Gap over element depth below which a contact step may close a point."""
    max_candidates: int = 1500
    """Points that a contact step considers at most, since each costs a substitution."""
    foundation_ratio: float = 1e-4
    """Stiffness over the normal contact stiffness with which a candidate resists open or closed; large against a
    sheet's bending, small against its compression.
    """
    edge_from_residual: float = 0.02
    """Relative residual below which Newton's steps decide which points open and close at the edges of contacts."""
    edge_max_points: int = 48
    """Points at edges of contacts that a step decides on at most."""
    edge_max_unknowns: int = 200_000
    """Unknowns up to which points at edges are decided on; beyond it the columns cost what they save."""
    few_candidates: int = 60
    """Candidates up to which a contact step costs no more than an iteration, and friction is decided together with pressure."""
    pivots_per_equation: int = 10
    """Pivots per equation at most in Lemke's method."""
    min_pivot_ratio: float = 1e-11
    """Pivot over the largest entry of its column below which it counts as zero."""
    adhesion_ratio: float = 1e-9
    """Share of the largest pressure that points carry beside their own while pairs are looked for, so that those that carry
    nothing do not tie.
    """
    overlap_ratio: float = 0.2
    """Penetration over element depth from which a tool that starts inside a body is drawn back and goes in again in stages."""
    overlap_stage_ratio: float = 0.25
    """Penetration over element depth by which one such stage goes in."""
    overlap_stage_residual: float = 1e-4
    """Relative residual to which those stages are solved, all but the last."""
    approach_gap_ratio: float = 1e-9
    """Gap over the bodies' size at which bodies that nothing holds follow a tool without being pressed."""
    just_touches_share: float = 1e-6
    """Share of the forces that bring tools through air, at which springs that are met count as just touched."""
    max_approach_ratio: float = 10.0
    """Way of a floating body over that of the tools, beyond which it was squeezed out from between them."""
    approach_depth_ratio: float = 1e-12
    """Depth over the bodies' size within which a tool that touches does not press: round-off of places."""
    max_rigid_steps: int = 60
    """Newton steps at most in which floating bodies find where tools clamp them."""


@dataclass(frozen=True)
class LinearPolicy:
    """How linear equations are solved: factors, GMRES, condensation, threads."""

    max_backward_error: float = 1e-10
    """Backward error ‖Ax − b‖∞ / (‖A‖∞ ‖x‖∞ + ‖b‖∞) above which a solution is refused."""
    refine_backward_error: float = 1e-13
    """Backward error above which a solution is refined."""
    max_refinements: int = 3
    """Refinements of a solution at most."""
    reuse_max_unknowns: int = 20000
    """Unknowns up to which factors at hand are tried after contact points changed; a failed attempt is cheap there."""
    single_precision_from: int = 20000
    """Unknowns from which Newton's steps take factors in single precision, or older ones, with GMRES."""
    gmres_max_iterations: int = 8
    """Iterations of GMRES at most, since more cost as much as a factorisation."""
    iterative_from: int = 10000
    """Unknowns in space from which LDLᵀ of P and GMRES (`prensa.linear.iterative`) take less time than LU."""
    multigrid_from: int = 150_000
    """Unknowns in space from which multigrid takes less time than LDLᵀ of P, and a fraction of its memory."""
    ldlt_max_iterations: int = 25
    """Iterations of GMRES at most with LDLᵀ of an earlier P, beyond which new factors cost less."""
    krylov_max_iterations: int = 100
    """Iterations of GMRES in space at most, with the preconditioner of the matrix itself. Those of multigrid cost about as much
    as LDLᵀ, those of LDLᵀ about as much as LU. Well-posed systems need fewer (book, chapter 9); those of iterates far from
    equilibrium, where P is indefinite, 40 to 60.
    """
    multigrid_flat_ratio: float = 1.6
    """Middle over short edge from which bricks are flat, long over middle edge from which they are drawn out, for multigrid."""
    multigrid_reach: float = 2.5
    """Middle edges within which nodes may be of one aggregate."""
    multigrid_incompressible: float = 0.03
    """Mean stiffness of an element's other motions over that of its dilatation that multigrid makes of smaller ones by taking
    pressures apart: 0.07 to 0.16 in elastic metals, below 0.015 where they flow, 0.004 in rubber (ν = 0.495).
    """
    multigrid_sweeps: int = 4
    """Steps of Chebyshev's polynomial before and after coarser levels: with affine motions as fast as two with rigid ones, and
    they fail less.
    """
    multigrid_arnoldi_steps: int = 10
    """Steps of the estimate of the largest eigenvalue, good to some per cent, which the polynomial's interval covers."""
    multigrid_coarsest: int = 700
    """Unknowns of the coarsest level, which is solved by its eigenvectors."""
    forcing_ratio: float = 0.1
    """Ratio of GMRES's tolerance to the relative residual, with which Newton's steps converge quadratically (Eisenstat
    & Walker 1996).
    """
    min_forcing: float = 1e-7
    """Least relative tolerance of GMRES."""
    max_forcing: float = 1e-4
    """Largest relative tolerance of GMRES."""
    soft_mode_error: float = 0.1
    """Relative error of single-precision factors in the softest mode, up to which their signs count negative modes."""
    mode_residual_share: float = 1e-4
    """Residual share to which modes are found with the matrix itself where the factors do not resolve them."""
    same_matrix_residual: float = 0.02
    """Relative residual below which an iterate's matrix is expected to be close to the one before."""
    same_matrix_points: int = 2
    """Contact points whose status may differ for the matrix to count as close to the one before."""
    gmres_iterations_per_point: int = 2
    """Further GMRES iterations that each changed contact point may cost."""
    block_values: int = 2**15
    """Values moved at once within a matrix, so that they stay in the cache."""
    shared_pattern_from: int = 50000
    """Dofs from which the pattern of all dofs is kept by that of the free ones, to save memory."""
    serial_dot_length: int = 10000
    """Length of vectors above which BLAS could share products among threads, which would make sums depend on their number."""
    threads_from_dofs: int = 8000
    """Dofs from which `threads: auto` takes more than one thread."""
    max_auto_threads: int = 8
    """Threads that `threads: auto` takes at most; the serial part takes as long as the rest by then."""
    pipeline_from_dofs: int = 1500
    """Dofs from which a thread of its own finds derivatives while the run goes on."""
    detach_max_unknowns: int = 200_000
    """Unknowns up to which factors of the run and those of its derivatives have room side by side."""
    columns_at_once: int = 64
    """Columns of the inverse of a condensed matrix computed at once."""
    column_room: int = 2**25
    """Numbers that columns computed at once hold at most (256 MiB)."""
    column_room_beside: int = 2**19
    """Numbers that they hold at most where the factors of all unknowns are in memory too."""
    kept_responses: int = 4
    """Free responses of condensed bodies that are kept; an increment asks for two repeatedly."""
    condense_from_dofs: int = 5000
    """Dofs from which factorisations are expensive enough to condense elastic bodies."""
    column_cost_ratio: float = 0.012
    """Cost of one column over that of a factorisation."""
    factorisations_per_increment: float = 2.5
    """Factorisations that an increment costs without condensation."""
    usual_increments: int = 10
    """Increments expected of a step that chooses its own."""
    reach_samples: int = 9
    """Times of a step at which the reach of its tools is sampled."""


@dataclass(frozen=True)
class DerivativePolicy:
    """How sensitivities are computed, and what is kept of a run for the way back."""

    parameter_step_ratio: float = 1e-5
    """Step over the size of a parameter for differences of the residual at fixed active sets, where round-off decides."""
    finer_step_ratios: tuple[float, ...] = (1e-6, 1e-7)
    """Smaller steps over the size of a parameter, tried where the residual along a derivative is too large."""
    derivative_residual_share: float = 1e-5
    """Share of the forces, beyond round-off, that may be left of the residual along a derivative."""
    column_residual_share: float = 3e-11
    """Share of the forces that the linear equations of a derivative may leave."""
    column_dependence: float = 1e-10
    """Squared residual below which a direction counts as a combination of those before."""
    matrix_bytes: float = 1e9
    """Bytes of matrices that a run keeps for the way back, which evaluates again where it has none."""
    factor_bytes: float = 1.4e8
    """Bytes of Newton's last factors that a run keeps likewise; new memory costs as much as new factors beyond it."""
    factor_bytes_per_increment: float = 4e6
    """Bytes of one increment's factors up to which those of all increments are kept."""
    factor_interval: int = 4
    """Increments of which one keeps its factors, where they are larger than `factor_bytes_per_increment`."""
    factor_distance: float = 0.012
    """Scatter of the logarithms of matrix diagonals up to which the factors of one matrix serve another."""
    adjoint_residual_share: float = 1e-13
    """Share of the solution that adjoint equations solved with factors of a nearby matrix may leave."""
    adjoint_max_steps: int = 12
    """Anderson-accelerated substitutions of an adjoint solve at most; more cost as much as new factors."""
    adjoint_start_solutions: int = 4
    """Increments whose solutions make the initial guess of an adjoint solve."""


@dataclass(frozen=True)
class StabilityRules:
    """Which modes are watched, and what counts as a bifurcation, a jump or a limit point."""

    watched_modes: int = 4
    """Softest modes that are looked at after every increment."""
    max_mode_sweeps: int = 8
    """Passes of subspace iteration at most; two suffice unless a mode is negative."""
    smooth_iterations: int = 2
    """Newton iterations up to which an increment may go without a look at modes that were far from negative."""
    stiffness_loss_share: float = 0.25
    """Share of its stiffness that no mode may be predicted to lose for an increment to go without a look."""
    max_unwatched: int = 8
    """Increments in a row without a look at most."""
    max_mode_residual: float = 0.1
    """Residual of a negative mode over its length, above which it does not count as one."""
    cuts_before_branching: int = 3
    """Cuts of an increment that ends in an unstable equilibrium, before another one is sought beside it."""
    branch_from_share: float = 1e-3
    """Share of the step below which another equilibrium is sought at once."""
    branch_distances: tuple[float, ...] = (1e-3, 1e-2, 3e-2)
    """Distances along the unstable mode, over the size of the bodies, at which another equilibrium is sought."""
    buckling_max_ratio: float = 0.3
    """Deflection to the other equilibrium, over the size of the bodies and the root of the share of the step, above
    which it is a jump; columns that buckle have about 0.1, a third of it.
    """
    max_prediction_error: float = 1.0
    """Deviation of an increment from its prediction, over the predicted displacement, above which it may have jumped."""
    jump_samples: tuple[float, ...] = (0.25, 0.5, 0.75)
    """Shares of such an increment's way at which stability is checked."""
    max_jump_steps: int = 300
    """Steps at most of the overdamped motion in which bodies without history jump."""
    jump_drag_factor: float = 4.0
    """Factor by which the drag of that motion changes from one step to the next."""
    limit_point_share: float = 1e-6
    """Share of a step below which an increment that repeatedly ends in unstable iterates is at a limit point."""
    extrapolation_ratios: tuple[float, ...] = (1e-5, 1e-4, 1e-3)
    """Ways beyond the last state, over the size of the bodies, at which stability is also asked at a limit point."""
    tool_mode_ratio: float = 10.0
    """Motion of a tool over that of the bodies, above which a mode is that of the tool sliding."""
    viscous_work_share: float = 2e-4
    """Share of the work of a step that viscous forces may dissipate with `stabilise: auto`."""
    viscous_warning_share: float = 0.01
    """Share of the work dissipated by viscous forces that is worth a warning."""


@dataclass(frozen=True)
class RemeshingRules:
    """When a body gets a new mesh, and which."""

    travel_in_smallest_elements: float = 2.5
    """Tool travel in smallest elements after which a mesh is judged, and made anew if a better one is possible."""
    due_samples: int = 8
    """Times in the next two increments at which the travel of the tools is predicted."""
    due_tolerance: float = 1e-2
    """Share of that travel by which force-driven tools may miss it, so that no increment is cut for less."""
    good_shape: float = 0.6
    """Least shape measure (scaled Jacobian, 0 … 1) of new meshes; a mesh that still has it gains nothing from another."""
    missing_elements_share: float = 0.05
    """Share of the wanted elements missing where elements are much too large, from which a mesh is made anew."""
    max_elements_ratio: float = 1.5
    """Elements over those wanted, from which a mesh is made anew."""
    max_size_ratio: float = 2.0
    """Element size of the first mesh over that wanted, from which the run begins with a new mesh."""
    worn_shape_ratio: float = 0.7
    """Ratio of the shape measure to that at the beginning of the mesh, below which it is worn."""
    size_factors: tuple[float, ...] = (1.0, 0.8)
    """Factors on the wanted sizes of the meshes that are tried in turn."""
    release_stages: tuple[float, ...] = (0.8, 0.6, 0.4, 0.2, 0.0)
    """Shares of the forces out of balance on a new mesh that are left after each stage of their release."""


@dataclass(frozen=True)
class CheckLimits:
    """Thresholds that several checks, or a check and the solver, share; those of one check stand beside it."""

    inverted_corner_ratio: float = -0.1
    """Signed area of a corner's triangle over the mean of the element's, below which the corner is inverted."""
    worn_out_attempts: int = 6
    """Attempts of a step that fail on one element, after which the run ends."""
    worn_shape: float = 0.2
    """Scaled Jacobian below which an element counts as out of shape."""
    max_folded_increments: int = 20
    """Increments for which an element may stay folded over, past a support, before the run ends."""
    localisation_ratio: float = 10.0
    """Plastic strain of an element over that of nearly all others, from which a failed increment names it."""
    localisation_strain: float = 1e-6
    """Plastic strain below which an element is not named."""
    on_bound_tolerance: float = 1e-6
    """Share of the friction bound within which a traction is on it."""
    full_shear_ratio: float = 0.95
    """Friction over the shear strength of the metal from which the skin flows."""
    tunnel_cosine: float = -0.5
    """Cosine between the normals where a straight way enters and leaves a tool, below which it tunnelled."""
    tunnel_gap_ratio: float = -0.05
    """Gap over the way, at both ends of the increment, of a node that is outside the tool."""
    tunnel_samples: int = 8
    """Places per element depth on a node's way at which tunnelling is checked."""
    max_tunnel_samples: int = 256
    """Such places at most."""
    metal_modulus: float = 20.0
    """Modulus (GPa) from which an elastic body is taken for a metal."""


@dataclass(frozen=True)
class Policy(Tolerances, StepRules, Globalisation, LinearPolicy, DerivativePolicy, StabilityRules, RemeshingRules, CheckLimits):
    """How the solver goes about its work. What a user decides is in `Numerics`; this is what nobody should have to."""


DEFAULT = Policy()
