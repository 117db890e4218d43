"""One increment: Newton on r(u) = 0 with the exact tangent, a start by extrapolation, a line search; failure is a value."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.contact.pairing import Pairs
from prensa.fem.system import Circumstances, Evaluation, Surface, System
from prensa.model import problem as model
from prensa.solver.continuation import ROUGH, stages, stiffened
from prensa.solver.eliminated import Tied
from prensa.solver.linear import Factorisation, SingularError, running
from prensa.solver.multipliers import BlockedError, Equations, determined

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]

STEPS = (0.5, 0.25, 0.1, 0.03)  # line search, after the full step
GOOD = 0.05  # relative residual of the extrapolation below which nothing better is looked for
TIGHT = 1e-12  # penetration and elastic slip over the element depth that exact contacts reach
FINE = 1e-11  # relative residual to which converged unknowns are improved: sums over all nodes need these digits
NEAR = 1e-5  # relative residual from which on the factors at hand may finish the work
FAR = 1e3  # way over the size of the bodies in one increment of what nothing holds …
SPIN = 10.0  # … and its turn (rad)
CLOSE = 2e-3  # relative residual from which an iteration is expected to come near: its stiffness will not be asked for
CORRECTIONS = 4  # substitutions, with an evaluation each, that cost as much as a factorisation with its own
BEND = 0.1  # below, a step did next to nothing to the residual (round-off, say) and says nothing about the next
SOFT = 0.01  # penetration over element depth that default penalties stay below at any pressure that a body bears
PATIENCE = 6  # iterations in which the least residual must at least halve: beyond, a smaller increment is cheaper
WATCH = 2  # full steps taken on trust although the residual grows, when points open or close …
WATCH_FLIPS = 6  # … and when points reverse their slip


@dataclass
class Trial:
    """Outcome of an attempt: converged or ``reason``; unknowns, evaluation there, multipliers, cost.

    ``recover``: gives all unknowns where u has only those that the next increment needs.
    """

    converged: bool
    reason: str
    u: Array
    evaluation: Evaluation | None
    lam: Array
    iterations: int
    residual: float = np.nan
    residuals: list[float] = field(default_factory=list)
    changes: list[int] = field(default_factory=list)
    augmentations: int = 0
    recover: Callable[[], Array] | None = None


def weights_of(system: System) -> Array:
    """Weights (ndof,) with which residuals are summed: rows of rotations are moments, divided by a length they are forces."""
    weight = np.ones(system.ndof)
    for t in range(len(system.tools)):
        weight[system.tool_dof(t) + 2] = 1.0 / system.length
    return weight


def equations_of(system: System, fixed: Index) -> list[Equations]:
    """Multiplier equations of the exact contacts, with ``fixed`` unknowns prescribed."""
    free = np.ones(system.ndof, dtype=bool)
    free[fixed] = False
    return [
        Equations(i, s, system.pair_slots(s)[:, -2:], free[s.coupled]) for i, s in enumerate(system.surfaces) if s.exact
    ]


class Reduced:
    """The free part of the system: indices of free unknowns, their sub-matrix, its factorisation analysed once."""

    def __init__(self, system: System, fixed: Index, numerics: model.Numerics, symmetric: bool = False):
        n = system.ndof
        self.fixed = fixed
        mask = np.ones(n, dtype=bool)
        mask[fixed] = False
        self.free = np.flatnonzero(mask)
        indptr, indices = system.pattern.indptr, system.pattern.indices
        cols = np.repeat(np.arange(n, dtype=np.int32), np.diff(indptr))
        self.tied: Tied | None = None
        if system.ties is not None:
            self.tied = Tied(system.ties, n, fixed, indices, cols)
            self.free = self.tied.free
            pattern = self.tied.indptr, self.tied.indices
        else:
            number = np.cumsum(mask, dtype=np.int32) - 1
            self.entries = mask[indices] & mask[cols]  # as flags: their places take as much memory as the matrix
            ends = running(self.entries)[indptr]
            pattern = np.append(ends[self.free], ends[-1]), number[indices[self.entries]]
        del cols
        # multipliers make a matrix indefinite; without them that takes a free tool, or large compression
        definite = not any(s.exact for s in system.surfaces)
        self.factorisation = Factorisation(
            len(self.free), *pattern, numerics.solver, numerics.threads, symmetric, definite
        )
        self.symmetric = symmetric
        self.weight = weights_of(system)[self.free]
        self.equations = equations_of(system, fixed)
        self.shape = (n, n)
        self.indptr, self.indices = indptr, indices

    def norm(self, r: Array) -> float:
        """Sum of the absolute free residuals, moments divided by a length."""
        return float(np.abs(self.weight * self.part(r)).sum())

    def part(self, r: Array) -> Array:
        """Residuals of the free unknowns, those of tied nodes with their masters'."""
        return r[self.free] if self.tied is None else self.tied.part(r)

    def whole(self, x: Array, n: int) -> Array:
        """All unknowns (n,) from the free ones, zero where prescribed."""
        if self.tied is not None:
            return self.tied.whole(x)
        out = np.zeros(n)
        out[self.free] = x
        return out

    def apply(self, data: Array, delta: Array) -> Array:
        """K δ with the whole matrix."""
        from scipy.sparse import csc_matrix

        return np.asarray(csc_matrix((data, self.indices, self.indptr), self.shape) @ delta)

    def matrix(self, e: Evaluation, b: Array) -> Array:
        """Values of K_ff for the matrix of an evaluation and the right-hand side b (ndof,) it is for; a copy.

        With it the evaluation can let its own go before the factors come: a tenth of what a run takes at its peak.
        """
        assert e.data is not None
        data = determined(e, b, self.equations) if self.equations else e.data
        return data[self.entries] if self.tied is None else self.tied.values(data)

    def solve(self, matrix: Array, b: Array) -> Array:
        """Free unknowns (ndof,) with K_ff x_f = b_f, zero where prescribed."""
        return self.whole(self.factorisation.solve(matrix, self.part(b)), len(b))

    def again(self, b: Array) -> Array:
        """As `solve`, with the last factors, unchecked: only for corrections whose effect is looked at."""
        return self.whole(self.factorisation.again(self.part(b)), len(b))


class Reporter(NamedTuple):
    """Callbacks of an attempt: ``iteration(trial, evaluation)``; ``timed(section)`` context manager."""

    iteration: Callable[[Trial, Evaluation], None]
    timed: Callable[[str], Any]


def signature(e: Evaluation) -> NDArray[np.int8]:
    """Status of all contact points: 0 open, 1 stick, 2 slip along +, 3 slip along −."""
    if not e.contacts:
        return np.zeros(0, dtype=np.int8)
    return np.concatenate(
        [np.where(f.p > 0, np.where(f.slip, np.where(f.t < 0, 3, 2), 1), 0) for f in e.contacts]
    ).astype(np.int8)


def _start(
    system: System,
    c: Circumstances,
    reduced: Reduced,
    start: Array,
    lam: Array,
    numerics: model.Numerics,
    report: Reporter,
) -> tuple[Array, Evaluation | None, Flags | None]:
    """First iterate: the last increments extrapolated, or the committed state moved by the linearised system.

    That has the tools where they end, so that it closes all points that they would overlap; those that were closed stay so
    and stick. Too many closed points open in the iterations that follow; too few would let the tool sink between them.

    Returns the iterate, its evaluation if it was made, and the points (points,) closed in the linear system if one was solved.
    """
    values = c.plan.values(c.time)
    if numerics.predictor and c.state.dt_last > 0:
        u = start + c.state.foretold(c.dt)
        u[reduced.fixed] = values
        _keep_on_tools(system, c, u)
        u[reduced.fixed] = values
        u = system.followed(u)
        with report.timed("assembly"):
            e = system.evaluate(c, u, lam)
        # plastic points answer to a linear start as if they were elastic: even a poor extrapolation is better there
        if not e.failed and (system.has_memory or reduced.norm(e.r) <= GOOD * e.scale):
            return u, e, None
    delta, tools = np.zeros(system.ndof), np.zeros(system.ndof)
    delta[reduced.fixed] = values - start[reduced.fixed]
    tools[system.tool_dof(0) : system.tool_dof(len(system.tools))] = 1.0
    start = start + tools * delta
    delta = system.followed((1.0 - tools) * delta)
    with report.timed("assembly"):
        base = system.evaluate(c, start, lam, begin=True)
    if base.failed or base.data is None:
        return start + delta, None, None
    r = base.r + reduced.apply(base.data, delta)
    with report.timed("factorisation and solve"):
        matrix, base = reduced.matrix(base, -r), base._replace(data=None)
        step = reduced.solve(matrix, -r)
    far = _runaway(system, reduced.fixed, step)
    start = start + delta if far else _along(system, c, base, start, delta + step, lam)
    return start, None, base.touching


def _keep_on_tools(system: System, c: Circumstances, u: Array) -> None:
    """Move extrapolated contact nodes along the tool normal: closed ones to their committed gap, others out of the tool.

    A node that has just landed would otherwise be extrapolated deep into the tool, at the speed it came with. Where a soft
    penalty lets the tool sink in, gaps go on growing, and nodes are left where the extrapolation has them.
    """
    nodal = u[: 2 * system.nodes].reshape(-1, 2)
    for s in system.surfaces:
        closed = s.points.any_at_nodes(c.state.contact[s.rows, 3] > 0)
        pairs, was = system.node_pairs(s, u), system.node_pairs(s, c.state.u).g
        # an open node may lie inside: points of rules that are not the nodes, or of quadratic edges, are what contact holds
        target = np.where(closed, was, np.maximum(pairs.g, np.minimum(was, 0.0)))
        held = s.points.any_at_nodes(np.ones(len(s.points), dtype=bool))  # a node on the axis may have no area
        seen = held & np.isfinite(pairs.g) & np.isfinite(target) & ~(closed & (was < -SOFT * s.points.depth.min()))
        move = np.where(seen, target, 0.0) - np.where(seen, pairs.g, 0.0)
        nodal[s.points.nodes] += move[:, None] * pairs.n


def attempt(
    system: System, c: Circumstances, reduced: Reduced, start: Array, numerics: model.Numerics, report: Reporter,
    soften: bool = True,
) -> Trial:  # fmt: skip
    """Try to solve the increment; the committed state is not touched.

    soften: whether a failure is followed by another try with contacts that stiffen stage by stage, if they ask for it.
    """
    trial = _attempt(system, c, [], reduced, start, numerics, report)
    path = stages(system, c) if soften and not trial.converged else []
    if not path:
        return trial
    again = _attempt(system, c, path, reduced, start, numerics, report)
    again.iterations += trial.iterations
    return again


def _attempt(
    system: System,
    c: Circumstances,
    path: list[Circumstances],
    reduced: Reduced,
    start: Array,
    numerics: model.Numerics,
    report: Reporter,
) -> Trial:
    """One attempt; ``path``: circumstances to be solved roughly before, each from the answer to the last."""
    reduced.factorisation.begin()
    lam = system.initial_multipliers(c.state)
    trial = Trial(False, "", start, None, lam, 0)
    try:
        u, *first, assumed = _start(system, path[0] if path else c, reduced, start, lam, numerics, report)
        trial.iterations += int(assumed is not None)
        rough = replace(numerics, tolerance=ROUGH)
        for now, then in pairwise([*path, c]):
            if _newton(system, now, reduced, u, first, lam, rough, report, trial, assumed) is None:
                return trial
            u, first, assumed = stiffened(system, now, then, trial.u), [None], None
        while True:
            e = _newton(system, c, reduced, u, first, lam, numerics, report, trial, assumed)
            if e is None:
                return trial
            u = trial.u
            update, change = _augment(system, c, e, lam)
            if change <= 1.0:
                trial.converged, trial.evaluation, trial.lam = True, e, lam
                return trial
            trial.augmentations += 1
            limit = max(s.description.enforcement.max_updates for s in system.surfaces)
            if trial.augmentations > limit:
                trial.reason = f"the multipliers did not settle in {limit} updates; a larger beta converges faster"
                return trial
            lam, first, assumed = update, [None], None
    except BlockedError as error:
        trial.reason = str(error)
        return trial
    except SingularError as error:
        trial.reason = (
            f"the stiffness matrix is singular ({error}): some body or tool is free to move without resistance; "
            "support it, or hold it until contact does"
        )
        return trial


def _newton(
    system: System,
    c: Circumstances,
    reduced: Reduced,
    u: Array,
    first: list[Evaluation | None],
    lam: Array,
    numerics: model.Numerics,
    report: Reporter,
    trial: Trial,
    assumed: Flags | None,
) -> Evaluation | None:
    """Iterate to convergence (returns the evaluation, trial.u set) or fail (returns None, trial.reason set).

    first: the evaluation at u if there is one; it is taken out, so that its matrix is held nowhere else.

    assumed (points,): u is the answer of a linear system in which these points were closed. Where one of them has opened, u is
    not converged before its own matrix was solved: a body that nothing holds stands still wherever it is.

    A full step that opens or closes contact points may raise the residual and still be right (it is then a step of
    the active-set method), so up to `WATCH` of them are taken on trust before the search goes back to the best iterate
    and shortens its step (watchdog of Chamberlain et al. 1982); likewise while points reverse their slip. Any other step
    that raises the residual is shortened.
    """
    e, status = first.pop(), None
    best, anchor, watched = np.inf, None, 0
    came_by: Array | None = None  # the last step, if its factors are at hand
    least: list[float] = []
    closed = c.state.contact[:, 3] > 0
    for iteration in range(numerics.max_iterations):
        if e is None:
            with report.timed("assembly"):
                e = system.evaluate(c, u, lam)
        if e.failed:
            trial.reason = e.failed
            return None
        norm = reduced.norm(e.r)
        relative = norm / e.scale if e.scale > 0 else 0.0
        now = signature(e)
        trial.residuals.append(relative)
        trial.changes.append(int((now != status).sum()) if status is not None else len(now))
        turned = reversed_slip(status, now)
        settled = np.array_equal(now > 0, closed if status is None else status > 0)
        status = now
        trial.u = u
        report.iteration(trial, e)
        trial.reason = _runaway(system, reduced.fixed, u - c.state.u)
        if trial.reason:
            return None
        near = relative <= max(numerics.tolerance, NEAR if iteration and numerics.reuse_factors else 0.0)
        opened = iteration == 0 and assumed is not None and (assumed & (now == 0)).any()
        if (near or norm <= e.floor) and not opened:
            done = _finished(system, c, reduced, u, e, lam, numerics.tolerance, report, trial, came_by)
            if done is not None:
                return done
        if not np.isfinite(norm):
            trial.reason = "the iteration diverged"
            return None
        least.append(min(norm, least[-1]) if least else norm)
        if len(least) > PATIENCE + 2 and least[-1] > 0.5 * least[-1 - PATIENCE]:
            trial.reason = f"the residual stagnates at {relative:.1e} of the forces"
            return None
        if e.data is None:
            with report.timed("assembly"):
                e = system.evaluate(c, u, lam)
        if turned.any():
            # a point that slipped one way and now slips the other would flip for ever: it sticks for this solve
            with report.timed("assembly"):
                held = system.evaluate(c, u, lam, hold=turned)
            if not held.failed:
                e = held
        with report.timed("factorisation and solve"):
            matrix, e = reduced.matrix(e, -e.r), e._replace(data=None)
            step = reduced.solve(matrix, -e.r)
            del matrix
        trial.iterations += 1
        trial.reason = _runaway(system, reduced.fixed, step)
        if trial.reason:
            return None
        if norm < best:
            best, anchor, watched = norm, (u, step), 0
        moved_to = _along(system, c, e, u, step, lam)
        with report.timed("assembly"):
            full = system.evaluate(c, moved_to, lam, stiffness=not (relative <= CLOSE and settled))
        size = reduced.norm(full.r) if not full.failed else np.inf
        after = now if full.failed else signature(full)
        flips = turned.any() or reversed_slip(now, after).any()
        discrete = flips or not np.array_equal(after > 0, now > 0)
        trust = iteration == 0 or size < best or not numerics.line_search
        trust |= discrete and watched < (WATCH_FLIPS if flips else WATCH)
        if trust and not full.failed:
            watched += size >= best
            came_by = moved_to - u
            u, e = moved_to, full
            del full  # or its matrix would be kept with it
            continue
        if full.failed or anchor is None:
            anchor = (u, step)
        u = _shortened(system, c, reduced, *anchor, lam, report)
        e, best, watched, anchor, status, came_by = None, np.inf, 0, None, None, None
    trial.reason = (
        f"no convergence in {numerics.max_iterations} iterations (relative residual {trial.residuals[-1]:.1e})"
    )
    return None


def _runaway(system: System, fixed: Index, step: Array) -> str:
    """Why a change of the unknowns (ndof,) is too large to be meant: what is free to move; '' if it is not."""
    step = step.copy()
    step[fixed] = 0.0
    for t, tool in enumerate(system.tools):
        x, y, rz = np.abs(step[system.tool_dof(t) :][:3])
        if max(x, y) > FAR * system.length or rz > SPIN:
            what = "turn" if rz > SPIN else "move along " + ("x" if x > y else "y")
            return (
                f"tool {tool.name!r} is free to move without resistance (to {what}): less force or moment, or hold it until "
                "contact does"
            )
    if np.abs(step[: 2 * system.nodes]).max(initial=0.0) > FAR * system.length:
        return (
            "a displacement a thousand times the size of the bodies: some body or tool is free to move without "
            "resistance; support it, or hold it until contact does"
        )
    return ""


def reversed_slip(before: NDArray[np.int8] | None, now: NDArray[np.int8]) -> Flags:
    """Points that slip along + in one signature and along − in the other."""
    if before is None:
        return np.zeros(len(now), dtype=bool)
    return (before >= 2) & (now >= 2) & (before != now)


def _along(system: System, c: Circumstances, e: Evaluation, u: Array, step: Array, lam: Array) -> Array:
    """U + step, with closed contact nodes put at the gap that the linear model gave them; e: the evaluation at u.

    A straight step along a curved tool changes the gap by d²/2R, more than the penetration p/k_n: without the correction
    a Newton step opens points that stay closed. Supported nodes are left where they are.
    """
    moved = u + step
    if system.problem.contact_geometry != "current":
        return moved
    nodal, delta = (v[: 2 * system.nodes].reshape(-1, 2) for v in (moved, step))
    after_lam = system.multipliers(moved, lam)
    for s, f, scale in zip(system.surfaces, e.contacts, c.scales):
        linear = _linear_gap(system, s, f.pairs, step, s.points.at(delta))
        stays = s.points.any_at_nodes(after_lam[s.rows, 0] - scale.k_n * linear > 0)
        nodes = s.points.nodes
        stays &= ~system.supported(nodes, c.plan)
        if not s.points.are_nodes:
            linear = _linear_gap(system, s, system.node_pairs(s, u), step, delta[nodes])
        after = system.node_pairs(s, moved)
        nodal[nodes] += np.where(stays, linear - after.g, 0.0)[:, None] * after.n
    return system.followed(moved)


def _linear_gap(system: System, s: Surface, before: Pairs, step: Array, moved: Array) -> Array:
    """Gaps (k,) after a step by the linear model: before (k pairs), moved (k, 2) the step of their body points."""
    tool = step[system.tool_dof(s.tool) :][:3]
    return np.asarray(before.g + (before.dg[:, :2] * moved).sum(axis=1) + before.dg[:, 2:] @ tool)


class Secant:
    """Steps of Broyden's first method on factors that stay: what each step did to the residual improves the next.

    Broyden (1965); recursion on the steps alone after Kelley (1995, Iterative Methods for Linear and Nonlinear Equations, 7.3).
    """

    def __init__(self, first: Array | None) -> None:
        self.steps = [] if first is None or not float(first @ first) > 0 else [first]

    def step(self, z: Array) -> Array:
        """Step (n,) from z = −K₀⁻¹ r with the factors at hand."""
        for s, then in pairwise(self.steps):
            z = z + then * (float(s @ z) / float(s @ s))
        if self.steps:
            s = self.steps[-1]
            bend = 1.0 - float(s @ z) / float(s @ s)
            z = z / bend if abs(bend) > BEND else z
        self.steps.append(z)
        return z


def _finished(
    system: System, c: Circumstances, reduced: Reduced, u: Array, e: Evaluation, lam: Array, tolerance: float,
    report: Reporter, trial: Trial, came_by: Array | None,
) -> Evaluation | None:  # fmt: skip
    """A nearly converged iterate brought home with the factors at hand: a substitution costs next to nothing.

    Returns None when that does not reach the tolerance; Newton then goes on from where it was. What is converged is
    improved further: the residual is summed over all nodes, so a tool's balance needs digits that the stop leaves open.
    """
    norm, rate = reduced.norm(e.r), 0.0
    secant = Secant(came_by)
    while (
        (norm > FINE * e.scale or e.violation > TIGHT)
        and reduced.factorisation.factored
        and norm * rate**CORRECTIONS <= FINE * e.scale
    ):
        with report.timed("factorisation and solve"):
            step = secant.step(reduced.again(-e.r))
        with report.timed("assembly"):
            better = system.evaluate(c, u + step, lam, stiffness=False)
        size = reduced.norm(better.r)
        if better.failed or not size < 0.3 * norm:
            break
        u, e, norm, rate = u + step, better, size, size / norm
    if not (norm <= tolerance * e.scale or norm <= e.floor):
        return None
    if (norm > FINE * e.scale and norm > e.floor) or e.violation > TIGHT:
        # old factors do not help everywhere (a limit load, say): one more step with new ones
        with report.timed("assembly"):
            here = system.evaluate(c, u, lam)
        with report.timed("factorisation and solve"):
            step = reduced.solve(reduced.matrix(here, -here.r), -here.r)
        trial.iterations += 1
        with report.timed("assembly"):
            better = system.evaluate(c, u + step, lam, stiffness=False)
        if not better.failed and reduced.norm(better.r) < norm:
            u, e, norm = u + step, better, reduced.norm(better.r)
    if e.violation > TIGHT:
        return None
    trial.u, trial.residual = u, norm / e.scale
    return e


def _shortened(
    system: System, c: Circumstances, reduced: Reduced, u: Array, step: Array, lam: Array, report: Reporter
) -> Array:
    """The best of a few fractions of a step, by the residual; a failed evaluation is no candidate."""
    best, factor = np.inf, STEPS[-1]
    for f in STEPS:
        with report.timed("line search"):
            e = system.evaluate(c, u + f * step, lam, stiffness=False)
        size = reduced.norm(e.r) if not e.failed else np.inf
        if size < best:
            best, factor = size, f
    return u + factor * step


def _augment(system: System, c: Circumstances, e: Evaluation, lam: Array) -> tuple[Array, float]:
    """Updated multipliers and the largest change over its tolerance (≤ 1: settled; 0 without augmented contacts)."""
    update, worst = lam.copy(), 0.0
    for s, f, sc in zip(system.surfaces, e.contacts, c.scales):
        slip = f.kappa - c.state.contact[s.rows, 1]
        update[s.rows], change = s.description.enforcement.update(f, lam[s.rows], sc, slip)
        worst = max(worst, change)
    return update, worst
