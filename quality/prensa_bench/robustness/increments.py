"""The answers of `prensa_bench.robustness.blocks`, checked at every increment as the solver holds them.

Equilibrium, complementarity, the friction bound, the sign of the dissipations and the volume of every element; a sample is run
again at half the step and ten times the penalty.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

import prensa as pr
from prensa.errors import PrensaError
from prensa.friction.law import At
from prensa.result.increment import Increment
from prensa.system.discretise import discretise
from prensa_bench.robustness.outcome import Outcome

RERUN_EVERY = 10  # one problem in so many is solved again with smaller increments and a larger penalty
CONVERGING = 0.75  # ratio of successive changes of the peak force, as the step is halved, below which it converges
BALANCE = 1e-7  # allowed force imbalance, relative to the largest tool force so far
AGREE = 0.05  # allowed relative difference of the peak tool force between the two solutions


def reason_of(error: PrensaError) -> str:
    """Type of what was said: of the failure where the solver gave up, else of the error."""
    reason = getattr(error, "reason", None)
    cause = getattr(getattr(reason, "cause", None), "why", None)
    return f"{type(reason or error).__name__}{f'.{cause.name}' if cause is not None else ''}"


def tool_force(system: Any, inc: Increment) -> float:
    """Size of the force on the tool; in axisymmetry along the axis."""
    f = inc.force("tool")
    return abs(f.y) if system.axisymmetric else float(np.hypot(f.x, f.y))


def unbalanced(system: Any, inc: Increment) -> float:
    """What the forces are out of balance by, as a force."""
    from prensa.verify.balance import imbalance

    return max(imbalance(system, inc)) * tool_force(system, inc)


def resolution(system: Any, inc: Increment) -> float:
    """Force of the round-off of places at all closed penalty contacts: what no state need balance better than.

    A gap is one of three numbers rounded to the nearest: the place of the point, that of the tool's reference point, and their
    difference, from which a shape tells distances. The state may have places between those: the gap does not follow it, but goes
    in steps of the coarsest of the three, and differs from the true one by half a unit in the last place of each at most.
    At ten times the penalty it may have few digits left: moved so that the surface lies at the origin, a problem under a tool
    whose reference point lies in its face balances to 1e-12 of its forces, moved away in proportion to the distance.
    """
    out = 0.0
    for s in system.surfaces:
        c = inc.contacts[s.name]
        pressed = (c.pressure > 0) & (c.gap < 0)
        if s.description.enforcement.type == "penalty" and pressed.any():
            stiffness = c.pressure[pressed] * c.weight[pressed] / -c.gap[pressed]
            force = c.force[pressed]  # none at nodes of no weight, as on the axis
            across = np.abs(force) / np.maximum(np.hypot(*force.T), np.finfo(float).tiny)[:, None]
            tool = inc.tools[c.tool]
            out += float((stiffness * (across * rounded(c.x[pressed], tool.at + np.array(tool.place[:2]))).sum(axis=1)).sum())
    return out


def rounded(x: np.ndarray[Any, Any], centre: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Largest round-off (k, 2) of x − centre, x (k, 2), ``centre`` (2,): half a unit in the last place of all three."""
    return np.asarray(0.5 * sum(np.spacing(np.abs(part)) for part in (x, centre, x - centre)))


def check(system: Any, inc: Increment) -> str:
    """What is wrong with an increment besides the balance of forces, in words; '' if nothing is."""
    for s in system.surfaces:
        c = inc.contacts[s.name].points
        h = s.points.depth
        if (c.pressure < 0).any():
            return "negative pressure"
        open_ = (c.pressure == 0) & np.isfinite(c.gap)
        if (c.gap[open_] < -1e-9 * h[open_]).any():
            return "an open point lies inside the tool"
        # the gap of a closed point is zero to round-off in the exact form, within the tolerance in the augmented one
        slack = s.description.enforcement.slack * h
        closed = c.pressure > 0
        if (closed & (c.gap > slack)).any():
            return "pressure across an open gap"
        if s.exact and (closed & (c.gap < -slack)).any():
            return "penetration in spite of exact enforcement"
        law = s.description.friction
        if law is None:
            bound = np.zeros_like(c.pressure)
        elif law.type == "shear":
            # the traction at the points: in plane stress its area has the thickness of the start of the increment. k only
            # grows: that of the state reached bounds that of the start
            k = np.full(len(s.points), law.k) if law.k is not None else system.shear_strength(s, inc.state)
            t, p = np.abs(inc.state.lam[s.rows, 1]), inc.state.lam[s.rows, 0]
            if (t > law.m * k * (p > 0) * (1 + 1e-9)).any():
                return "friction above its bound"
            continue
        else:
            bound = law.bound(c.pressure, c.slip, At())[0]
        if (np.abs(c.shear) > bound + 1e-9 * max(float(bound.max()), 1e-300)).any():
            return "friction above its bound"
    for key in ("plastic", "friction"):
        if inc.energy[key] < -1e-9 * max(abs(inc.energy["external"]), 1e-300):
            return f"{key} dissipation {inc.energy[key]:.2e} is negative"
    for b in (
        inc.bodies.values() if system.problem.kinematics == "finite" else ()
    ):  # in small strain the shape is not updated
        x = b.x[b.cells]
        corners = 3 if x.shape[1] in (3, 6) else 4
        if x.shape[1] > corners:  # round the outline: corner, mid-side node, corner, …
            x = x[:, np.arange(2 * corners).reshape(2, corners).T.ravel()]
        y = np.roll(x, -1, axis=1)
        if ((x[..., 0] * y[..., 1] - x[..., 1] * y[..., 0]).sum(axis=1) <= 0).any():
            return "an element has no volume"
    return ""


def solve_checked(p: pr.Problem) -> tuple[float, int, int, str]:
    """Largest tool force over the history, iterations, cut-backs, and what is wrong ('' if nothing)."""
    system = discretise(p)
    peak, iterations, cutbacks = 0.0, 0, 0
    early: list[tuple[float, float]] = []
    for inc in pr.solve(system):
        iterations += inc.statistics.iterations
        cutbacks += inc.statistics.cutbacks
        peak = max(peak, tool_force(system, inc))
        # after unloading there is little force left to compare with: the peak so far is the reference
        if not (error := unbalanced(system, inc) - resolution(system, inc)) <= BALANCE * max(peak, 1e-300):
            early.append((error, inc.time))
        wrong = check(system, inc)
        if wrong:
            return peak, iterations, cutbacks, f"time {inc.time:.4g}: {wrong}"
    # the same holds before contact is established: round-off there is judged against the peak of the whole history
    for error, at in early:
        if not error <= 0.1 * BALANCE * peak:
            return (
                peak,
                iterations,
                cutbacks,
                f"time {at:.4g}: forces out of balance by {error / peak:.1e} of the largest",
            )
    return peak, iterations, cutbacks, ""


def finer(p: pr.Problem, factor: int = 2) -> pr.Problem:
    """The same problem at 1/``factor`` of the step and ten times the penalty (the default one for other enforcements)."""
    steps = tuple(replace(s, increments=factor * (s.increments or 40)) for s in p.steps)
    now = [c.enforcement if isinstance(c.enforcement, pr.Penalty) else pr.Penalty() for c in p.contacts]
    stiff = [pr.Penalty(beta=10 * e.beta, beta_T=10 * e.beta_T) for e in now]
    contacts = tuple(replace(c, enforcement=e) for c, e in zip(p.contacts, stiff))
    return replace(p, steps=steps, contacts=contacts)


AS_DRAWN = "drawn"
ENFORCEMENTS = {"penalty": pr.Penalty(), "augmented": pr.Augmented(), "exact": pr.Exact()}


def enforced(p: pr.Problem, enforcement: str) -> pr.Problem:
    """The problem with all its contacts enforced in one of the forms of `ENFORCEMENTS`, or as it was drawn.

    What is remeshed keeps penalties.
    """
    if p.remesh != "off" or enforcement == AS_DRAWN:
        return p
    return replace(p, contacts=tuple(replace(c, enforcement=ENFORCEMENTS[enforcement]) for c in p.contacts))


def judge(p: pr.Problem, number: int, compare: bool) -> Outcome:
    """Solve and check one problem; ``compare``: also against half the step and ten times the penalty.

    Steps are too large on purpose, so that the two may differ by the error of the first. Then runs at a quarter and, if it
    takes that, an eighth of the step decide: a sequence that closes in on something is a coarse answer, one that does not a
    wrong one.
    """
    start = time.process_time()
    try:
        peak, iterations, cutbacks, wrong = solve_checked(p)
    except PrensaError as error:
        spent = time.process_time() - start
        return Outcome(number, p.name, "reported", str(error), seconds=spent, reason=reason_of(error))
    status, words = ("wrong" if wrong else "right"), wrong
    if compare and not wrong:
        try:
            again, _, _, worse = solve_checked(finer(p))
            if worse:
                status, words = "wrong", f"at half the step and ten times the penalty: {worse}"
            elif abs(again - peak) > AGREE * max(again, peak):
                forces = [peak, again]
                for factor in (4, 8):  # a sequence may begin far from where it closes in
                    forces.append(solve_checked(finer(p, factor))[0])
                    if converging := abs(forces[-1] - forces[-2]) <= CONVERGING * abs(forces[-2] - forces[-3]):
                        break
                first, *others = (f"{force:.4g}" for force in forces)
                words = f"peak force {first}, at ten times the penalty and a half, a quarter, … of the step {', '.join(others)}"
                if not converging:
                    status = "wrong"
        except PrensaError as error:
            words = f"(the finer run used for comparison failed: {error})"
    return Outcome(number, p.name, status, words, iterations, cutbacks, time.process_time() - start)
