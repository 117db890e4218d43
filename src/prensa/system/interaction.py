"""Interactions: everything besides the bodies' own elements that puts forces on degrees of freedom.

Contact, load, tool force and spring are interactions, as heat exchange or contact between bodies would be. Each states which
sets of degrees of freedom it joins and gives vectors and matrices of them; the residual is one loop and one scatter.
Here is all that the two sides agree on: what an interaction sees of the problem (`Discretisation`) and of the increment
(`Context`), what it is asked (`Request`) and how it answers (`Response`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, Protocol, TypedDict

import numpy as np

from prensa.contact.forces import ContactForces, ContactSets, Scale
from prensa.contact.masters import Geometry
from prensa.contact.record import ContactRecord
from prensa.contact.redundant import Supports
from prensa.contact.stencil import Stencils
from prensa.contact.surface import Surface
from prensa.friction.law import At, FrictionLaw
from prensa.model import problem as model
from prensa.precision import NEGLIGIBLE
from prensa.system.assembly import Block, Pattern
from prensa.system.failure import NotEvaluated
from prensa.system.schedule import StepPlan
from prensa.system.state import State
from prensa.system.time_integration import TimeRule
from prensa.types import Array, Flags, Index


class ActiveSets(NamedTuple):
    """On which side of their kinks all points are: the contacts', and which points (m q,) of each block flow plastically.

    ``contacts``: empty where that is for their gaps and tractions to decide.
    """

    contacts: tuple[ContactSets, ...]
    flows: tuple[Flags | None, ...]


class Overrides(TypedDict, total=False):
    """What an evaluation may be asked to assume; see `Request`."""

    stick: Flags | None
    guess: bool
    foundation: Array | None
    secant: float
    active_sets: ActiveSets | None


class Request(NamedTuple):
    """What an evaluation asks for: degrees of freedom u (ndof,), multipliers lam (points, 1 + t), whether matrices are wanted.

    ``stick`` (points,): contact points that are forced to stick; ``guess``: for the first guess of an increment, with tools deep
    in bodies, the frame is turned by committed tractions alone, and without a ``foundation`` points that were closed are kept
    closed and stuck. ``reach``: a length that positions do not exceed, for their round-off.
    ``foundation`` (points, 2): shares of its normal and tangential stiffness with which a contact point resists in the matrix,
    whatever its state; 0: as it does.
    ``secant``: how far the matrix of the bodies goes from the tangent to the secant of plastic flow (see `At`).
    ``active_sets``: contact points are open or closed and stick or slip, and material points flow or do not, as they do there.
    """

    u: Array
    lam: Array
    stiffness: bool = True
    stick: Flags | None = None
    guess: bool = False
    reach: float = 0.0
    foundation: Array | None = None
    secant: float = 0.0
    active_sets: ActiveSets | None = None


class Part(NamedTuple):
    """Vectors r (k, m) and matrices K (k, m, m) on the sets dofs (k, m) of degrees of freedom; either may be missing.

    ``key``: names the sets, which are the same whenever it is, so that their places in the matrix are looked up once.
    """

    key: str
    dofs: Index
    r: Array | None = None
    K: Array | None = None


class Discretisation(Geometry, Protocol):
    """What an interaction sees of the discretised problem; `prensa.system.system.System` is one."""

    problem: model.Problem
    blocks: list[Block]
    pattern: Pattern

    @property
    def ndof(self) -> int:
        """Degrees of freedom."""

    @property
    def depth(self) -> Array | None:
        """Initial thickness at the nodes (n,); None in axisymmetry."""

    def nodes_of(self, body: str) -> Index:
        """Global numbers (n,) of the nodes of a body."""
        ...

    def node_volumes(self, body: str) -> Array:
        """∫N_A dV (n,) of the nodes of a body, in the initial configuration."""

    def weights(self, s: Surface, x: Array, depth: Array | None) -> Array:
        """Areas (k,) of the contact points on node positions x (n, d) with the nodes' thickness (n,)."""

    def share(self, depth: Array | None) -> Array:
        """Thickness of the nodes over the initial one (n,); 1 but in plane stress."""

    def stencils(self, s: Surface, u: Array, since: State | None = None) -> Stencils:
        """Stencils of a contact at its integration points, for degrees of freedom u (ndof,)."""


@dataclass
class Context:
    """Committed state, plan of the step, end of the increment, its ``dt`` in steps and in ``seconds``, and arrays made of them.

    ``now``: seconds from the beginning to the end of the increment.

    ``weights`` and ``scales`` of the contacts on the committed configuration, friction ``laws`` and what their bounds depend
    on (``law_at``); ``x_n`` (n, d) node positions that increments refer to; ``depth`` (n,) thickness at the nodes at the last
    commit, None in axisymmetry; ``surfaces``: the contacts, their edges cut at sharp corners, and what is ``committed``
    of their points; ``picard_friction``: the contact stiffness is the paper's symmetric one (see `forces`);
    ``interactions``: contacts, in the order of the description, then loads. ``threads`` that may answer for elements at once.
    ``preconditioned``: whether matrices may be solved for by preconditioners, which need more of the elements.
    ``stopped``: what ends the step here before its
    time, in words; '' if nothing does. ``watched`` (criteria,): values of what may end it. ``touches``: whether a prescribed
    tool first meets a body at the end of the increment. ``brought``: whether it begins elsewhere
    than where the last one ended, since tools or bodies are brought into contact first, and ``through_air`` (ndof,) the way on
    which nothing resisted what forces brought there (None: there is none); ``floating``: bodies that nothing holds at its end.

    ``supports``: see `Surface.supports`, by contact.

    ``history``: what the bodies' laws begin with by the time ``rule``, one (elements, points, h) array per block.
    """

    state: State
    plan: StepPlan
    time: float
    dt: float
    seconds: float
    now: float
    weights: list[Array]
    scales: list[Scale]
    laws: list[FrictionLaw | None]
    law_at: list[At]
    x_n: Array
    depth: Array | None
    surfaces: list[Surface]
    committed: list[ContactRecord]
    supports: list[Supports | None]
    history: Sequence[Array]
    rule: TimeRule
    interactions: Sequence[Interaction] = ()
    picard_friction: bool = False
    threads: int = 1
    preconditioned: bool = True
    stopped: str = ""
    watched: Array = field(default_factory=lambda: np.zeros(0))
    touches: bool = False
    brought_into_contact: bool = False
    through_air: Array | None = None
    floating: Sequence[str] = ()

    @cached_property
    def extrapolated_for(self) -> float:
        """Time for which the last increment is extrapolated: that in which prescribed motions would go as far as they do now.

        It is the duration of the increment where these are steady. Speeds change at the corners of tables and along the turn of
        a crank, and where motions turn back nothing is extrapolated.
        """
        state, fixed = self.state, self.plan.fixed
        last = state.du[fixed]
        if not np.abs(last).max(initial=0.0) > NEGLIGIBLE * np.abs(state.du).max(initial=0.0):  # forces drive, or nothing moved
            return self.dt
        # Least squares: the multiple of the last way of all that is prescribed which is nearest to this one.
        way = self.plan.values(self.time) - state.u[fixed]
        return max(float(way @ last) / float(last @ last), 0.0) * state.dt_last

    @cached_property
    def ends_step(self) -> bool:
        """Whether the increment is the last one of its step."""
        return bool(self.stopped) or self.time >= self.plan.t1

    @property
    def driven_by_ways(self) -> bool:
        """Whether nothing acts on the bodies but contacts: no pushes, springs or loads, nothing of extensions."""
        return len(self.interactions) == len(self.surfaces)


@dataclass
class Response:
    """Outcome of an interaction: its parts, and what an evaluation sums up over all.

    ``scale``: Σ |forces|; ``floor``: residual that round-off alone makes; ``violation``: of conditions that must hold to
    round-off, over the length that is small; ``trial``: what may be committed; ``failed``: why it could not be evaluated.
    ``external``: the vectors are forces from outside, which have no part in the residual's scale of inner forces.
    """

    parts: Sequence[Part] = ()
    scale: float = 0.0
    floor: float = 0.0
    violation: float = 0.0
    trial: ContactForces | None = None
    failed: NotEvaluated | None = None
    external: bool = False


class Interaction(Protocol):
    """Something that puts forces on degrees of freedom. Pure: it answers the same for the same arguments."""

    def couplings(self) -> Sequence[Index]:
        """Sets of degrees of freedom (k, m) that it joins in the matrix; of a load without stiffness none."""

    def respond(self, c: Context, ask: Request) -> Response:
        """Forces, matrices and trial state for the degrees of freedom and the context of an increment."""
