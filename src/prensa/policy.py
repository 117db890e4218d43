"""Every tuning constant of the solver in one place. All are dimensionless; the defaults are meant to stay, studies vary them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Policy:
    """How the solver goes about its work. What a user decides is in `Numerics`; this is what nobody should have to."""

    # ------------------------------------------------------------------------------------------------ initial guess
    good_start: float = 0.05
    """Relative residual of the extrapolation below which nothing better is looked for."""
    sunk_start: float = 0.01
    """Penetration over element depth that default penalties stay below at any pressure that a body bears; contact nodes
    beyond it are not projected, since the gap of a soft penalty goes on growing."""
    landed_start: float = 1e-11
    """Penetration over element depth that a node which lands starts with: enough that round-off does not say whether it has."""

    # ------------------------------------------------------------------------------------------------------- Newton
    line_search: tuple[float, ...] = (0.5, 0.25, 0.1, 0.03)
    """Fractions of a step that the line search looks at, after the full step."""
    shrinks: float = 0.25
    """Next step over a step that raises the residual, both with its factors, below which it is accepted all the same."""
    vain: int = 4
    """Iterations, none of which has lowered the residual, after which an attempt is given up."""
    patience: int = 6
    """Iterations in which the least residual must fall to ``stagnation`` of its value: a smaller increment is cheaper."""
    stagnation: float = 0.5
    """Share to which the least residual must fall within ``patience`` iterations."""
    close: float = 2e-3
    """Relative residual from which an iteration is expected to come near: its stiffness will not be asked for."""
    turned: float = 0.15
    """Relative residual of the initial guess above which the direction of plastic flow is not trusted, …"""
    turning: float = 0.01
    """… of later iterates, …"""
    turning_elements: int = 300
    """… of bodies of so many elements; with flow of second order in time in inverse proportion where there are more, …"""
    least_turning: float = 0.05
    """… down to this part of those residuals, …"""
    secant: float = 0.5
    """… and how far the matrix goes from its tangent to its secant there."""
    long_turned: float = 0.04
    """``turned`` in increments of second order, which are twice as long, …"""
    long_secant: float = 0.75
    """… ``secant`` in them, …"""
    first_growth: float = 2.0
    """… and growth of the residual above which the first step is shortened in them."""
    turned_before: int = 3
    """Increments that so began, one after the other, from which on the next is expected to: its first matrix is made for that."""
    local_slow: float = 0.02
    """Share of the residual that is left by an iteration which a few nodes hold up: they find their equilibrium alone, …"""
    local_from: float = 1e-4
    """… above this relative residual, …"""
    local_share: float = 0.8
    """… if they make this share of it, …"""
    local_most: float = 0.35
    """… and are, with those beside them, no more than this share of all dofs, …"""
    local_small: int = 300
    """… or, where all are fewer than so many and cost little, …"""
    local_little: float = 0.15
    """… than this one, …"""
    local_dofs: int = 400
    """… nor more than so many, …"""
    local_steps: int = 6
    """… in so many steps at most, …"""
    local_search: tuple[float, ...] = (0.5, 0.25, 0.1)
    """… whole ones or these parts of them, …"""
    local_enough: float = 0.05
    """… until this share of their residual is left."""
    far: float = 1e3
    """Way, over the size of the bodies, of a node or tool in one increment that nothing holds …"""
    spin: float = 10.0
    """… and turn (rad) of such a tool."""

    # -------------------------------------------------------------------------------------------------- derivatives
    parameter_step: float = 1e-5
    """Step over the size of a parameter for differences of the residual with held branches: smooth, so round-off decides."""
    finer_steps: tuple[float, ...] = (1e-6, 1e-7)
    """Those that are tried where more is left of the residual along a derivative than there should be."""
    flat: float = 1e-5
    """Share of the forces, beyond round-off, that may be left of the residual along a derivative."""
    columns_fine: float = 3e-11
    """Share of the forces that substitutions with Newton's last factors may leave of the linear equations of a derivative."""
    columns_alike: float = 1e-10
    """A way that is this near to a combination of those before, in squares of residuals, says nothing more than they do."""
    kept_matrices: float = 1e9
    """Bytes of matrices at solutions that a run keeps for the way back, which evaluates again where it has none."""
    kept_factors: float = 1.4e8
    """Bytes of Newton's last factors likewise; beyond that, new memory costs a process as much as factors of the transposes."""
    kept_size: float = 4e6
    """Bytes of those of one increment up to which all are kept: fresh memory for larger ones costs what new factors do, …"""
    kept_apart: int = 4
    """… so that of these one in so many is kept, and serves those beside it."""
    transposed_apart: float = 0.012
    """Scatter of the logarithms of lengths between the diagonals of matrices up to which factors of one serve the other."""
    transposed_fine: float = 1e-13
    """Share of the solution of linear equations with a transpose that substitutions with factors of a matrix nearby leave, …"""
    transposed_steps: int = 12
    """… in so many at most: that costs as much as other factors."""
    transposed_begun: int = 4
    """Solutions of so many increments make the one that substitutions begin with."""

    # ------------------------------------------------------------------------------------------------------- finish
    near: float = 1e-5
    """Relative residual from which on the factors at hand may finish the work."""
    fine: float = 1e-11
    """Relative residual to which converged iterates are improved: sums over all nodes need these digits …"""
    moved: float = 10.0
    """… but this many times that is enough where tools are only moved, …"""
    moved_left: float = 1e-8
    """… if no more than this share of what contacts press is left of the residual, …"""
    moved_missed: float = 1e-10
    """… and its sum along no axis is more than this share."""
    finishing: float = 0.3
    """Of that residual, linear equations of a step that can be the last leave this part."""
    tight: float = 1e-12
    """Penetration and elastic slip over the element depth that exact contacts reach."""
    corrections: int = 4
    """Substitutions, with an evaluation each, that cost as much as a factorisation with its own."""
    usual_rate: float = 1e-3
    """Ratio of successive residuals that a substitution with new factors is expected to have."""
    likely_rate: float = 3e-3
    """That which must be enough for the first, if its evaluation is to make the matrix that somebody wants at the solution."""
    contraction: float = 0.3
    """Ratio of successive residuals above which substitutions with old factors are given up."""
    stalled: float = 10.0
    """Residual over the estimate of its round-off at which a converged iterate whose substitutions change nothing is at rest."""
    least_secant: float = 0.1
    """Change of the residual along a step, over the step, below which the step (round-off, say) teaches the next nothing."""

    # -------------------------------------------------------------------------------------------------- multipliers
    small_slip: float = 1e-3
    """Share of the slip of the increment below which the tangential error of an augmented contact does not matter."""
    weak: float = 1e-6
    """Share of a multiplier's equation on free dofs below which it says nothing (new) about them."""
    shift: float = 1e-10
    """Share of such an equation put on its diagonal: redundant constraints share what they carry."""
    met: float = 1e-11
    """Gap or slip over the element depth below which a multiplier's equation counts as met."""
    beyond_bound: float = 10.0
    """Tangential traction over pressure that is beyond every friction bound."""

    # ------------------------------------------------------------------------------------------------- contact steps
    candidates: float = 0.5
    """Gap over element depth below which a contact step lets a point close …"""
    most_candidates: int = 1500
    """… of which it takes on so many at most: each costs a substitution."""
    foundation: float = 1e-4
    """Share of its normal stiffness with which a candidate resists open or closed: far above what bends a sheet, so that the
    matrix is regular, far below what presses it, so that the response keeps its digits."""
    interior_steps: int = 100
    """Iterations of the interior point method at most …"""
    interior: float = 0.995
    """… each so much of the way to where a pressure or a gap would vanish …"""
    complementary: float = 1e-32
    """… until the mean product of scaled pressures and gaps is this: pressures of a loose end are 1e-13 of the largest."""
    edge_from: float = 0.02
    """Relative residual from which on Newton's steps decide on points that they open and close at the edges of contacts, …"""
    edge: int = 48
    """… on so many at most, …"""
    edge_largest: int = 200_000
    """… of systems with so many unknowns at most: beyond, columns one by one cost what they save, and there is no room …"""
    edge_rounds: int = 4
    """… in so many rounds: what is decided may change those beside."""
    polishing: int = 6
    """Times at most that the equations of the pairs found are solved."""
    few: int = 60
    """Candidates with which a contact step costs no more than another iteration. So many points at most have their friction
    decided with their pressure, by pivots that cost the third power of their number: …"""
    pivots: int = 10
    """… so many for each of the equations at most …"""
    least_pivot: float = 1e-11
    """… none of which is less than this share of the largest in its column."""
    adhesion: float = 1e-9
    """Traction over the largest pressure that all points can bear there: those that carry nothing would tie with one another."""

    # ---------------------------------------------------------------------------------------------- an overlap at the start
    overlap: float = 0.2
    """Penetration over element depth with which a tool starts inside a body …"""
    emerge: float = 0.25
    """… and is pressed out of it in stages of so much each, …"""
    rough: float = 1e-4
    """… solved to this relative residual, but for the last."""

    # ---------------------------------------------------------------------------------------------- after failures
    retried_after: int = 2
    """Cut-backs after which a failed attempt is followed by one with contact steps alone: most failures need the cut."""

    # --------------------------------------------------------------------------------------------------- increments
    first: float = 0.0025
    """First increment of a step without 'increments', as a share of the step."""
    longest: float = 0.1
    """Automatic increment at most, as a share of the step."""
    travel: float = 0.3
    """Tool travel per automatic increment, in contact element sizes."""
    plastic: float = 0.01
    """Equivalent plastic strain per automatic increment …"""
    spread: float = 0.95
    """… that this share of the points stays below (a singular corner would rule the step otherwise)."""
    second_order: float = 2.0
    """Both, over that, where plastic flow is of second order in time."""
    unsteady: float = 0.05
    """Share of the flow by which first and second order may differ in an increment that is of second order by itself."""
    plastic_cut: float = 0.1
    """Share of an increment below which plastic strain alone does not shorten the next."""
    easy: int = 5
    """Newton iterations up to which the next automatic increment grows by ``grow``."""
    target: int = 7
    """Newton iterations up to which a given increment that was cut doubles again."""
    hard: int = 10
    """Newton iterations beyond which the next automatic increment shrinks to ``shrink``."""
    grow: float = 1.5
    """Growth of an automatic increment after an easy one."""
    recover: float = 2.0
    """Growth of an increment back to its given length, or to the least, after a cut."""
    shrink: float = 0.7
    """Share of a hard automatic increment that the next one has."""
    cut: float = 0.25
    """Share of a rejected increment that is tried next: halves of what fails mostly fail too."""
    least: float = 1e-5
    """Share of the step below which increments become shorter by failure alone."""
    shortest: float = 1e-12
    """Share of the step below which time would soon stand still: what needs that is a jump."""
    touch: float = 0.02
    """Share of the increment before a first touch below which the increment is not split there."""
    sliver: float = 1e-9
    """Share of a step below which what is left of it is no increment."""
    clear: float = 1e-9
    """Gap over the bodies' size at which those that nothing holds are carried along by a tool, pressed by none."""
    just_touches: float = 1e-6
    """Share of the forces that bring tools and bodies through air at which the springs that they meet count as just touched."""
    carried_far: float = 10.0
    """Times as far as tools that bodies may be carried: what goes farther was squeezed out from between them."""
    rounded: float = 1e-12
    """Depth over the bodies' size within which a tool that touches does not press."""
    rigid_steps: int = 60
    """Newton steps in which bodies that nothing holds find where tools clamp them, at most."""
    looks: int = 200
    """Times at most at which a first touch within an increment is looked for."""

    # --------------------------------------------------------------------------------------------------- acceptance
    inverted: float = -0.1
    """Area of a corner's triangle over the mean of the element's below which the corner counts as inverted."""
    inversion: float = 0.5
    """Fall of that measure in one increment that is no gradual inversion."""
    collapse: float = 1.0
    """Equivalent plastic strain at any point in one increment beyond which it is refused."""
    worn_out: int = 6
    """Attempts of a step that fail on the same element …"""
    worn_dt: float = 1e-3
    """… down to increments of this share of the longest, which counts as no longer than an automatic one …"""
    worn_shape: float = 0.2
    """… with a scaled Jacobian below this, after which it is said that nothing can go on."""
    folded: int = 20
    """Increments for which an element may stay folded over, a free side of it past a support, before the run ends."""
    alone: float = 10.0
    """Plastic strain of an element over that of nearly all others in a failed increment, from which the element is named …"""
    noticed: float = 1e-6
    """… if it is more than this."""
    on_bound: float = 1e-6
    """Share of the bound of friction below which a traction misses it …"""
    full_shear: float = 0.95
    """… and friction over the shear strength of the metal from which it is as strong."""
    opposite: float = -0.5
    """Cosine between the normals where a straight way enters and leaves a tool: it has tunnelled."""
    still: float = 0.25
    """Way over element depth, or over the thickness of the tool if that is less, that tunnels through nothing."""
    outside: float = -0.05
    """Gap over the way, at both ends of the increment, of a node that is outside the tool."""
    turn: float = 0.8
    """Rotation (rad) of a tool in one increment from which on its way there is looked at …"""
    swept: float = 0.5
    """… and penetration over element depth, beyond that at the end, with which it would have gone through a body."""
    samples: int = 8
    """Places on a node's way per element depth, or thickness of the tool, at which tunnelling is looked for …"""
    most_samples: int = 256
    """… and at most."""

    # ---------------------------------------------------------------------------------------------------- stability
    modes: int = 4
    """Softest modes that are looked at after every increment …"""
    mode_sweeps: int = 8
    """… by so many passes through the factors at most; two, unless one of them is negative."""
    smooth: int = 2
    """Iterations up to which an increment need not have a look at modes that were far from turning …"""
    part: float = 0.25
    """… as long as none of them is foretold to lose this part of its stiffness …"""
    most_rest: int = 8
    """… and so many increments at most."""
    mode_error: float = 0.1
    """Residual of a negative mode, over its length, above which it is none."""
    unstable_cuts: int = 3
    """Cuts of an increment that ends in an unstable equilibrium, before another one is looked for beside it …"""
    look_beside: float = 1e-3
    """… or share of the step below which that is done at once."""
    branches: tuple[float, ...] = (1e-3, 1e-2, 3e-2)
    """How far along the unstable mode, over the size of the bodies, that is looked for; jumps as far are taken …"""
    branching: float = 0.3
    """Deflection to the equilibrium found, over the size of the bodies and the root of the share of the step, above which
    it is a jump, not buckling: columns that buckle have about 0.1, so this leaves a factor of three."""

    astray: float = 1.0
    """Way beside what the last increments foretold, over that, of an increment that may have jumped …"""
    between: tuple[float, ...] = (0.25, 0.5, 0.75)
    """… and shares of its way at which stability is looked for then."""
    jump_steps: int = 300
    """Steps of the overdamped motion in which bodies without a memory jump, at most …"""
    jump_change: float = 4.0
    """… and what their drag is multiplied or divided by from one to the next."""
    at_limit: float = 1e-6
    """Share of a step below which an increment that ends in unstable iterates again and again is one at a limit point."""
    lead_on: tuple[float, ...] = (1e-5, 1e-4, 1e-3)
    """How far on, over the size of the bodies, states that the last increment leads to are asked there too."""
    tool_alone: float = 10.0
    """Motion of a tool over that of the bodies in a mode in which the tool moves against friction that has no more to give."""

    stabilise: float = 2e-4
    """Share of the work of a step that viscous forces may dissipate with ``stabilise: auto``."""

    jump_cuts: int = 8
    """Cuts of an increment beside those of `Numerics.max_cutbacks` where viscous forces hold: jumps are short."""

    jump_missed: float = 2e-4
    """What the ledger of an increment with viscous forces misses, over the work so far, from which a jump is followed by
    shorter ones …"""
    jump_share: float = 0.1
    """… if it is more than this share of the work done in the increment and of what is dissipated there …"""
    jump_travel: float = 0.5
    """… and a surface in contact goes farther than this, in contact element sizes."""

    # ---------------------------------------------------------------------------------------------------- remeshing
    remesh_travel: float = 2.5
    """Way of a tool, in smallest elements, after which a mesh is looked at, and made anew if it can be better."""
    due_looks: int = 8
    """Times in the next two increments at which is looked whether a tool has gone the way after which a mesh is due."""
    nearly_due: float = 1e-2
    """Share of that way which may be missing or too much of tools that are driven by force: no increment is cut off for less."""
    good_shape: float = 0.6
    """Least shape measure that new meshes begin with, or better: one that still has it has nothing to gain from another one."""
    ill_sized: float = 0.05
    """Share of the elements asked for that are missing where elements are much too large from which a mesh is made anew."""
    too_many: float = 1.5
    """Elements over those asked for from which a mesh is made anew."""
    too_coarse: float = 2.0
    """Size of an element of the first mesh over that asked for from which the run begins with a new mesh."""
    worn_share: float = 0.7
    """Share of the shape measure that a mesh began with below which it is worn, where that is less than what is asked for."""
    remesh_cuts: int = 3
    """Cuts of an increment after which a new mesh helps more than another cut."""
    finer: tuple[float, ...] = (1.0, 0.8)
    """Sizes, over those asked for, of the meshes that are tried in turn at a place."""
    let_go: tuple[float, ...] = (0.8, 0.6, 0.4, 0.2, 0.0)
    """Parts in which forces are let go that a state on a new mesh is out of balance by."""

    # ----------------------------------------------------------------------------------------------------- warnings
    viscous: float = 0.01
    """Share of the work that viscous forces dissipate that is worth a warning."""
    deep: float = 0.1
    """Penetration over element depth worth a warning."""
    staircase: float = 0.025
    """Step of a force, over its mean, as elements pass, below which it is not spoken of …"""
    as_foretold: float = 0.5
    """… and over the step that as many elements in the contact make: less of it has another cause, …"""
    settled: float = 0.25
    """… and as long as its mean changes by more than this share of the step while two elements pass."""
    force_jump: float = 0.01
    """Change of the forces on prescribed ways in an increment, over themselves, from which its work is asked when that was …"""
    jump_beyond: float = 0.5
    """… and how far beyond it, in increments, that may be for it to say anything of a jump."""
    hidden: float = 100.0
    """A tool force below this many times the residual allowed is not a result."""

    small_told: float = 0.05
    """Strain, or rotation (rad), in small-strain kinematics that is worth a warning: forces are off by about as much …"""
    small_most: float = 0.1
    """… and that is refused, …"""
    small_share: float = 0.05
    """… if this share of a body's volume exceeds it: peaks under an edge depend on the mesh and hardly on anything else."""
    squeezed: float = 0.1
    """Loss of volume that flow, which keeps it, leaves to elasticity: pressures of a tenth of the bulk modulus are no metal's."""
    metal: float = 20.0
    """Modulus (GPa) of an elastic body from which on it is taken for a metal …"""
    overstrained: float = 0.05
    """… which yields long before this strain."""

    # ------------------------------------------------------------------------------------------------ linear solver
    backward_error: float = 1e-10
    """‖Ax − b‖∞ / (‖A‖∞ ‖x‖∞ + ‖b‖∞) above which a solution is refused."""
    refine: float = 1e-13
    """Backward error above which a solution is refined …"""
    refinements: int = 3
    """… at most so many times."""

    worth_trying: int = 20000
    """Unknowns up to which factors at hand are tried where contact points changed: what is in vain is cheap there."""
    worth_single: int = 20000
    """Unknowns from which on Newton's steps take factors in single precision, or those of a matrix before, with GMRES …"""
    krylov: int = 8
    """… of so many iterations at most: more cost as much as a factorisation …"""
    forcing: float = 0.1
    """… to this part, times the relative residual or what a step promises to leave, of the residual, with which steps converge
    as quadratically as exact ones …"""
    least_forcing: float = 1e-7
    """… but never to less than this part of it …"""
    most_forcing: float = 1e-4
    """… nor more than this."""
    telling: float = 0.1
    """Relative error of factors in single precision in the softest mode up to which they tell how many modes are negative, …"""
    modes_share: float = 1e-4
    """… and what is left of the residuals where they do not, and modes are looked for with the matrix itself."""
    alike: float = 0.02
    """Relative residual of an iterate up to which its matrix is expected to be close to the one before …"""
    few_changed: int = 2
    """… if no more contact points have another status than there (none where factors LDLᵀ are as cheap as what they cost); …"""
    outliers: int = 2
    """… each of them may cost so many iterations of GMRES more."""

    stretch: int = 2**15
    """Values that are moved at once within a matrix: they stay in the cache."""
    worth_sharing: int = 50000
    """Dofs from which on the pattern of all of them is kept by that of the free ones: putting it together takes a hundredth of a
    step, once or twice a step of the description."""
    shared_products: int = 10000
    """Length of vectors from which BLAS may share out products among threads, whose sums then depend on how many there are."""
    worth_threads: int = 8000
    """Dofs from which on ``threads: auto`` takes more than one thread …"""
    most_threads: int = 8
    """… and so many at most: what they leave to one of them takes as long by then."""
    worth_following: int = 1500
    """Dofs from which on another thread finds derivatives while the run goes on …"""
    most_apart: int = 200_000
    """… and up to which the factors of a run and those for its derivatives have room beside each other."""

    # ------------------------------------------------------------------------------------------------- condensation
    columns: int = 64
    """Columns of the inverse computed at once …"""
    room: int = 2**25
    """… at most so many numbers of them, …"""
    room_beside: int = 2**19
    """… and so many where all unknowns have their factors and matrix beside them: a large run has no room for more."""
    responses: int = 4
    """Free responses that are kept: an increment asks for two again and again."""
    worth_condensing: int = 5000
    """Dofs from which on factorisations cost enough to be saved."""
    column_cost: float = 0.012
    """Cost of a column, in factorisations."""
    increment_cost: float = 2.5
    """Factorisations that an increment costs otherwise."""
    usual_increments: int = 10
    """Increments of a step that chooses its own."""
    reach_looks: int = 9
    """Times of a step at which is looked how far its tools reach."""

    # ---------------------------------------------------------------------------------------------- ends of steps
    until: float = 1e-8
    """Share of its target, or of the element depth for a contact, within which what ends a step is met …"""
    instant: float = 1e-12
    """… if it does not jump there; then, share of the step within which its time is known."""
    until_strain: float = 1e-3
    """Elastic strain whose forces are the size of a force that is to vanish."""
    early: float = 1e-3
    """Part of a step after which a force, a travel or a measure that ends it is asked about: units differ by factors of 1000."""
    given_way: float = 0.99
    """Part of a mount's way that its spring takes, where nothing else drives the run, from which its stiffness is asked about."""
    gripped: float = 1e-6
    """Elastic strain with whose forces tools pull at a body that they have gripped."""

    # ---------------------------------------------------------------------------------------------- tools that tip over
    tip_reach: float = 0.5
    """Gap over the depth of the elements up to which a point may come to bear a tool."""
    tip_friction: float = 1.0
    """Coefficient of friction beyond which no tool is helped to stand."""
    tip_left: float = 1e-6
    """Share of a tool's force from which it counts as not borne."""


DEFAULT = Policy()
