"""Predictor: the first iterate of an increment (Newton's warm start).

The last increments extrapolated, or the committed state moved by the linearised system.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from prensa.precision import NEGLIGIBLE
from prensa.solver.contact_lcp import contact_step, few
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.projection import contact_corrected, project_prediction
from prensa.system.system import Evaluation
from prensa.types import Array, Flags


@dataclass
class Guess:
    """Dofs u (ndof,) to start from; their evaluation if it was made.

    ``assumed`` (points,): contact points that resisted in the linear system, if u is the answer of one. Where one of them
    is open, u is not converged before its own matrix was solved: a body that nothing holds stands still wherever it is.
    ``solved``: linear systems that it took; ``decided``: whether contact and friction were unknowns of the last of them;
    ``flows``: whether they were, and the answer is still off because metal flows.
    """

    u: Array
    evaluation: Evaluation | None = None
    assumed: Flags | None = None
    solved: int = 0
    decided: bool = False
    flows: bool = False

    def take(self) -> Evaluation | None:
        """The evaluation, handed over: its matrix is then held nowhere else."""
        e, self.evaluation = self.evaluation, None
        return e


def initial_guess(eq: Equilibrium, start: Array, lam: Array) -> Guess:
    """The extrapolation where it is good, else the answer of the linearised system; start (ndof,): the committed state."""
    values = eq.context.plan.values(eq.context.time)
    guess = _extrapolated(eq, start, values, lam)
    return guess if guess is not None else _linearised(eq, start, values, lam)


def _extrapolated(eq: Equilibrium, start: Array, values: Array, lam: Array) -> Guess | None:
    """The last increments extrapolated, contact nodes projected where that is better; None if that is poor or there are none."""
    system, c, fixed = eq.system, eq.context, eq.reduced.fixed
    if not eq.numerics.predictor or not c.state.dt_last > 0:
        return None
    # By the way of prescribed motions and not by time: speeds change at the corners of tables and along the turn of a crank.
    u = start + c.state.extrapolated(c.extrapolated_for)
    u[fixed] = values
    # what contact holds are gaps of points: with nodes put at theirs, those of points between them may be anywhere
    between = not all(s.points.are_nodes for s in system.surfaces)
    as_it_is = system.with_slaves(u.copy()) if between else None
    project_prediction(system, c, u, eq.policy)
    u[fixed] = values
    u = system.with_slaves(u)
    e = eq.evaluate(u, lam)
    if as_it_is is not None and eq.norm(eq.evaluate(as_it_is, lam, stiffness=False)) < eq.norm(e):
        u, e = as_it_is, eq.evaluate(as_it_is, lam)
    if _first_touch(eq, e):
        return None
    # plastic points answer to a linear start as if they were elastic: even a poor extrapolation is better there
    if not e.failed and (system.has_memory or eq.norm(e) <= eq.policy.good_start_residual * e.scale):
        return Guess(u, e)
    return None


def _first_touch(eq: Equilibrium, e: Evaluation) -> bool:
    """Whether tools meet bodies at rest in the evaluation e: the motion that this begins is no continuation of anything."""
    state = eq.context.state
    moved = np.abs(state.du[eq.system.dofs.displacement.slice]).max(initial=0.0)
    at_rest = moved <= NEGLIGIBLE * np.abs(state.du).max(initial=0.0)
    return bool(at_rest and e.touching.any() and not state.contact.closed.any())


def _linearised(eq: Equilibrium, start: Array, values: Array, lam: Array) -> Guess:
    """The committed state moved by the linearised system, and where metal flows by that of the middle of this way, twice.

    The first takes metal for elastic: that gives way to pressure as metal that flows cannot, and under stresses of elastic size
    plastic moduli hold nothing in place. So does the middle of an elastic way to a part; that of the way found with it does not
    (midpoint rule in two passes, with secant moduli). A pass from which the residual does not fall is the last, and discarded.
    """
    guess = _moved(eq, start, values, lam, 0.0)
    for solved in (2, 3):
        if not _flows(eq, guess):
            break
        assert guess.evaluation is not None
        before = eq.norm(guess.evaluation)
        guess.evaluation = None  # a large system has no room for two matrices
        middle = _moved(eq, 0.5 * (start + guess.u), values, lam, eq.secant)
        e = middle.evaluation
        if e is None or e.failed or not middle.decided or eq.norm(e) > (1.0 - NEGLIGIBLE) * before:
            return replace(guess, solved=solved, flows=True)
        guess = replace(middle, solved=solved)
    return replace(guess, flows=_flows(eq, guess))


def _flows(eq: Equilibrium, guess: Guess) -> bool:
    """Whether the answer of a linear system is off because metal flows: only then is its residual that large.

    Where contact was not decided with it, iterations have to find that in any case, and a better guess of flow gains nothing.
    """
    e = guess.evaluation
    if e is None or not (guess.decided and any(b.law.plastic for b in eq.system.blocks)):
        return False
    return eq.flow_direction_unreliable(eq.norm(e) / e.scale, first=False)


def _moved(eq: Equilibrium, start: Array, values: Array, lam: Array, secant: float) -> Guess:
    """Dofs ``start`` (ndof,) moved by the system linearised there, with a matrix that goes as far as ``secant``.

    That has the tools where they end, so that it closes all points that they would overlap; those that were closed stay so
    and stick. Too many closed points open in the iterations that follow; too few would let the tool sink between them.
    """
    system, reduced = eq.system, eq.reduced
    delta, tools = np.zeros(system.ndof), np.zeros(system.ndof)
    delta[reduced.fixed] = values - start[reduced.fixed]
    tools[system.dofs.tool.slice] = 1.0
    start = start + tools * delta
    delta = system.with_slaves((1.0 - tools) * delta)
    if (decided := _by_contact(eq, start, delta, lam, secant)) is not None:
        return decided
    # Deep overlaps stand for no pressure: in a guess the terms that turn the normal take the committed tractions (chapter 6).
    base = eq.evaluate(start, lam, guess=True, secant=secant)
    if base.failed or base.data is None:
        return Guess(start + delta)
    r = base.r + reduced.assembly.apply(base.data, delta)
    with eq.report.timed("factorisation and solve"):
        matrix, base = reduced.matrix(base, -r, spent=True), base._replace(data=None, history=())
        step = reduced.step(matrix, -r, 1.0)
    if eq.runaway(step) is not None:
        return Guess(start + delta, None, base.touching, 1)
    u = contact_corrected(system, eq.context, base, start, delta + step, lam)
    e = eq.evaluate(u, lam)
    # A tool that slides or turns far slips under the bodies; points that stuck to it would be dragged inside out.
    if e.failed and (still := _still(eq, start + delta, lam)) is not None:
        return Guess(start + delta, still, base.touching, 1)
    return Guess(u, e, base.touching, 1)


def _by_contact(eq: Equilibrium, start: Array, delta: Array, lam: Array, secant: float) -> Guess | None:
    """The linearised system with contact and friction decided in it, in space; None where that costs too much or fails.

    A tool that begins to slide would drag all points along that stick in the linear system, and bodies flow after them; if the
    friction that they can have is decided, it slips under them. ``start``: with the tools in place; ``delta`` (ndof,): what
    else is prescribed.
    """
    system = eq.system
    if system.dofs.dimension != 3 or not eq.globalised:
        return None
    e = eq.evaluate(start, lam, stiffness=False)
    found = None
    if not e.failed:
        found = contact_step(eq, start, lam, e, most=few(eq), for_friction=True, given=delta, secant=secant)
    if found is None or eq.runaway(found.step) is not None:
        return None
    u = contact_corrected(system, eq.context, e, start, found.step, lam)
    e = eq.evaluate(u, lam)
    return None if e.failed else Guess(u, e, found.springs, 1, True)


def _still(eq: Equilibrium, u: Array, lam: Array) -> Evaluation | None:
    """Evaluation at the committed state with the tools where they end, if they go along their surfaces; else None.

    Where a tool slides or turns far, points that stuck to it would go where elements are inside out. It slips under them.
    """
    e = eq.evaluate(u, lam)
    if e.failed:
        return None
    closed = [(f.p > 0, was.closed) for f, was in zip(e.contacts, eq.context.committed)]
    return e if closed and all((now == was).all() for now, was in closed) else None
