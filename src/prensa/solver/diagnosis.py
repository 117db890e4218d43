"""Diagnosis of an increment that failed for good: what, where, why, and what to try."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from prensa.checks.during.distortion import IN_A_SECTION
from prensa.errors import SolveError, coordinates
from prensa.linear.rigid_modes import CLOSED, free_to_move
from prensa.model.problem import stabilised
from prensa.result.increment import Increment
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.limits import friction_limits, limits, mostly_sheared, worn
from prensa.system.failure import (
    BeyondSmall,
    Collapsed,
    CornerInverted,
    Distorted,
    Diverged,
    ElementFailed,
    Failure,
    Folded,
    FreeToMove,
    FrictionTooSoft,
    Jumped,
    LimitPoint,
    MetalInside,
    NotConverged,
    Past,
    PastSupport,
    Stagnated,
    StartsInside,
    TipsOver,
    ToolRunaway,
    Tunnelled,
    TurnedThrough,
    Unevaluable,
    Unsettled,
    Unstable,
    Why,
    sentence,
)
from prensa.system.interaction import Context
from prensa.system.outcome import NewtonResult
from prensa.system.release import release_in_words
from prensa.system.system import Evaluation, System


@dataclass(frozen=True)
class InUse:
    """What of the advice a step has no use for: what is switched on already, and what is not there to be changed."""

    viscous_forces: bool = False
    remeshing: bool = False
    friction: bool = True
    forces: bool = True
    """Whether tools are pushed or hang on springs, or boundaries are loaded."""
    space: bool = False
    """Whether the problem is in space, where no mesh is made anew."""

    @classmethod
    def of(cls, system: System, c: Context) -> InUse:
        """That of the step of an increment."""
        p, number = system.problem, c.plan.number
        forces = any(step.push or step.loads for step in p.steps[: number + 1]) or any(t.spring for t in p.tools.values())
        friction = any(law is not None for law in c.laws)
        return cls(stabilised(p, number) != "off", p.remesh != "off", friction, forces, system.dofs.dimension == 3)


def hint(failure: Failure, in_use: InUse = InUse()) -> str:
    """What to try against a failure, but for what is in use already."""
    match failure:
        case _ if isinstance(failure, FreeToMove):
            return _what_holds(failure)
        case Unevaluable(ElementFailed(why=Why.INVERTED)) | CornerInverted() | Collapsed():
            return _of_elements(failure, in_use)
        case Unevaluable(FrictionTooSoft()):
            return "a smaller slope of mu, a larger 'beta_T', more 'increments'"
        case Tunnelled():
            return "more 'increments', or a shorter travel"
        case BeyondSmall():
            return "'kinematics: finite'; 'allow_large_strain: true' with 'small' to get the result anyway"
        case TurnedThrough():
            return "more 'increments', or a smaller turn"
        case MetalInside(node):
            return node.remedy
        case StartsInside():
            return "place the tool where it touches ('touching') and move it in over the first step"
        case Folded(hang=hang) if hang is not None:
            return _past_a_corner(in_use)
        case Folded():
            return "a tool between the two sides, or a step that ends before they meet: bodies have no contact with themselves"
        case Distorted(past=Past(side, support)) | PastSupport(past=Past(side, support)):
            return (
                f"a tool (a plane, say, or a stamp where the support ends) in place of the support {support!r}, with {side!r} "
                "in its contact too; a step that ends before"
            )
        case Distorted():
            return _listed(
                ("a mesh that is finer there, or designed so that elements are well shaped when they get there", True),
                ("a larger fillet of the tool" + (" or less friction" if in_use.friction else ""), True),
                (
                    "'remesh: auto', which remeshes a body of 't6' elements when they become distorted",
                    not in_use.remeshing and not in_use.space,
                ),
                (IN_A_SECTION, in_use.space),
            )
        case LimitPoint() | Unstable() | Jumped():
            return _against_jumps(in_use)
        case Unsettled():
            return "a larger 'beta', or 'penalty'"
    return "more 'increments', a smaller motion per step, a larger fillet or a finer mesh where it happens, or less softening"


def _of_elements(failure: Failure, in_use: InUse) -> str:
    """For elements that fold, turn over or collapse."""
    match failure:
        case CornerInverted():
            words = "smaller increments; make the free side part of the contact surface, or support it"
        case Collapsed():
            words = "a hardening flow curve, a larger fillet of the tool, a finer mesh there, more 'increments'"
        case _:
            others = "of bricks h8_fbar, h8_enhanced" if in_use.space else "q4_fbar, q4, q4_enhanced"
            words = (
                f"more 'increments', a mesh that is coarser or better shaped there, another 'element' ({others}); if a free side "
                "slides past the tool, make it part of the contact surface"
            )
    return _listed((words, True), (f"where the mesh is worn, a finer one, or {IN_A_SECTION}", in_use.space))


def _past_a_corner(in_use: InUse) -> str:
    """For nodes that are caught on a corner of a tool."""
    t6 = "'element: t6' with edges that are short compared with the tool, whose nodes slide round its corner"
    remesh = "" if in_use.remeshing else ", and 'remesh: auto' where metal flows round it"
    return _listed(
        (
            "'stabilise: auto' where the tool slides with friction: edges of four-noded elements then lie on corners",
            in_use.friction and not in_use.viscous_forces,
        ),
        (t6 + remesh, True),
        ("a 'fillet' of the tool as long as an edge there", True),
        ("less friction", in_use.friction),
    )


def _against_jumps(in_use: InUse) -> str:
    """For equilibria that end."""
    first = "'stabilise: auto', which lets the jump happen against small viscous forces"
    if in_use.viscous_forces:
        first = "a larger number for 'stabilise', with which viscous forces slow the jump down more"
    moved = (
        "a tool that is moved ('move') instead of pushed or mounted on a spring, or displacement control of its push "
        "('control')"
    )
    return _listed((first, True), (moved, in_use.forces), ("a step that ends before", True))


def _listed(*advice: tuple[str, bool]) -> str:
    """Those of some pieces of advice that apply."""
    return "; ".join(words for words, applies in advice if applies)


def _what_holds(failure: FreeToMove) -> str:
    match failure:
        case TipsOver(tool=tool):
            return (
                f"the reference point of {tool!r} ('at') over what supports it, more of the contact surface under it, or no "
                "'m' in its 'push': without it, the tool does not turn"
            )
        case ToolRunaway(axis=axis) if axis.startswith("r"):
            return (
                f"a prescribed rotation ('{axis}' in 'move'), or a spring on it; for a tool that rolls: shorter elements in "
                "contact, so that some points stick, or more friction"
            )
    return (
        "support the body or the tool in that direction, or hold it until contact does; springback needs no supports in a "
        "step with 'remove_tools: true'"
    )


def remedy(eq: Equilibrium, failure: Failure) -> str:
    """What to try against a failure, and against friction that shears the surface of the metal where it would slide."""
    state = eq.context.state
    words = hint(failure, InUse.of(eq.system, eq.context))
    without_way_on = LimitPoint | Unstable | Jumped | Stagnated | NotConverged | Diverged | Collapsed
    if isinstance(failure, without_way_on) and mostly_sheared(eq.system, state, eq.policy):
        words = f"friction below the metal's shear strength ('shear' with m below 1, or 'capped'): the surface slides; {words}"
    in_space = eq.system.dofs.dimension == 3 and isinstance(failure, without_way_on) and not isinstance(failure, Collapsed)
    return f"{words}; {IN_A_SECTION}" if in_space and any(worn(eq.system, eq.context, eq.policy)) else words


def where(eq: Equilibrium, failure: Failure, result: NewtonResult) -> str:
    """Where the last iterate of a failed attempt is worst: node, element, contact and tool, with coordinates; '' unknown."""
    if isinstance(failure, FreeToMove):
        e = eq.evaluate(result.u, result.lam, stiffness=False)
        slides = [] if e.failed else friction_limits(eq.system, eq.context, e, eq.policy)
        tools = [] if isinstance(failure, TipsOver) else _free_tools(eq)
        return "; ".join(filter(None, [_free_bodies(eq), *tools, *slides]))
    if not result.residuals or isinstance(failure, BeyondSmall | Distorted | StartsInside):
        return ""
    system, reduced = eq.system, eq.reduced
    e = eq.evaluate(result.u, result.lam, stiffness=False)
    if e.failed or not len(reduced.free):
        return ""
    limit = "".join(f"; {words}" for words in limits(system, eq.context, e, eq.policy))
    dof = int(reduced.restriction.rows[np.argmax(np.abs(reduced.weight * reduced.restriction.part(e.r)))])
    for s in system.surfaces:
        if s.multipliers is not None and s.multipliers.owns(np.array(dof)):
            dof = int(s.dofs[int(s.multipliers.split(np.array(dof))[0]), 0])
    field = system.dofs.field_of(dof)
    entity, component = (int(v) for v in field.split(np.array(dof)))
    if field is system.dofs.tool:
        name = system.tools[entity].name
        return f"the largest residual is that of tool {name!r} along {field.components[component]}{limit}"
    return f"the largest residual is at {_node(system, entity, result, e)}{limit}"


def _free_bodies(eq: Equilibrium) -> str:
    """The rigid motions that are left to bodies, or would be without their contacts, which open now."""
    system, c = eq.system, eq.context
    ways = [f"body {b!r} can {words}" for b in system.problem.bodies if (words := free_to_move(system, b, c))]
    if not ways:
        ways = [
            f"without its contacts body {b!r} can {words}"
            for b in system.problem.bodies
            if (words := free_to_move(system, b, c, contacts=False))
        ]
    return "; ".join(ways)


def _free_tools(eq: Equilibrium) -> Iterator[str]:
    """Tools driven by force that nothing resists in the committed state."""
    system, c = eq.system, eq.context
    for t, tool in enumerate(system.tools):
        dofs = zip(system.dofs.tool.components, system.dofs.tool.dofs(t).tolist())
        pushed = [axis for axis, dof in dofs if dof in c.plan.push]
        if not pushed:
            continue
        own = system.against(tool.name)
        if all(system.nodes_seen(s, c.state.u).g.min() > CLOSED * s.points.depth.min() for s in own):
            yield f"tool {tool.name!r} touches nothing and is driven by force along {' and '.join(pushed)}"
        elif system.dofs.dimension == 2 and pushed[-1] == "rz" and np.isfinite(tool.shape.period):
            yield f"tool {tool.name!r} is free to turn, and as it is round only friction resists that"


def _node(system: System, node: int, result: NewtonResult, e: Evaluation) -> str:
    """A node with its body, place, an element, and what it does at its tools."""
    body = system.body_of(node)
    block = next(b for b in system.blocks if b.body == body)
    x = system.positions(result.u)[node]
    element = int(np.flatnonzero((block.cells == node).any(axis=1))[0])
    text = f"node {node - system.offsets[body]} of {body!r} at ({coordinates(x)}), element {element}"
    for s, f in zip(system.surfaces, e.contacts):
        k = np.flatnonzero(((s.points.support == node) & (s.points.N > 0.0)).any(axis=1))
        if len(k) and np.isfinite(f.g[k[0]]):
            status = "open" if f.p[k[0]] <= 0 else "slipping" if f.slip[k[0]] else "sticking"
            text += f", {status} at {'tool ' if s.opposite is None else ''}{s.against!r} (gap {f.g[k[0]]:.3g})"
    return text


def last_good(last: Increment | None) -> str:
    """What there is to go back to, in words."""
    if last is None:
        return "No increment of this run had converged before."
    return f"The last good state is at time {last.time:.6g} (increment {last.number})."


def failed_increment(
    eq: Equilibrium, result: NewtonResult, cutbacks: int, most_cutbacks: int | None, last: Increment | None
) -> SolveError:  # fmt: skip
    """The error that says what failed, where, why, and what to try; ``most_cutbacks``: None where times were asked for."""
    c, reason = eq.context, result.reason
    assert reason is not None
    place = where(eq, reason, result)
    cut = f"The increment was cut {cutbacks} times without success."
    if most_cutbacks is None:
        cut = "Its end is one of the times that were asked for, so it was not cut."
    elif isinstance(reason, LimitPoint):
        cut = f"Increments were down to {c.dt:.1g} of time: shorter ones do not help."
    elif isinstance(reason, Distorted):
        cut = f"Increments were down to {c.dt:.1g} of time."
    elif isinstance(reason, StartsInside):
        cut = "Shorter increments begin with the same overlap."
    elif isinstance(reason, BeyondSmall):
        cut = "A shorter increment would end there too."
    elif cutbacks < most_cutbacks:
        cut += " It is too short for another cut: the body jumps here, or there is no equilibrium."
    good = last_good(last)
    if held := release_in_words(eq.system, c.state, c.plan):
        good += f" {held}"
    return SolveError(
        f"step {c.plan.name!r}, time {c.time:.6g}: {sentence(reason)}{'; ' + place if place else ''}. {cut} "
        f"{good} What to try: {remedy(eq, reason)}.",
        last,
        reason,
    )
