"""Converged increments as plain frozen arrays. Output, reports and users read only this."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from prensa.errors import PrensaError, take
from prensa.model.names import suggest
from prensa.result.views import Drawn, Shown, Tabular
from prensa.types import Array, Bytes, Index

if TYPE_CHECKING:
    from prensa.contact.passage import Passing
    from prensa.model.problem import Problem
    from prensa.result.assembled import Assembled
    from prensa.result.folding import Folding
    from prensa.system.state import State

STATUS = ("open", "stick", "slip")
SLIDING_FIELDS = ("contact_time", "sliding_distance", "sliding_velocity")
"""Fields of a contact that follow its points along their tool."""


class Force(NamedTuple):
    """Force (x, y) and moment m about the tool's reference point: of the thickness (plane) or whole 2π (axisymmetric)."""

    x: float
    y: float
    m: float


class Place(NamedTuple):
    """Displacement (x, y) of a tool's reference point from its initial position and rotation rz (rad)."""

    x: float
    y: float
    rz: float


class SpatialForce(NamedTuple):
    """Force and moment about a tool's reference point in three dimensions."""

    x: float
    y: float
    z: float
    mx: float
    my: float
    mz: float


class SpatialPlace(NamedTuple):
    """Displacement of a tool's reference point and rotations in three dimensions."""

    x: float
    y: float
    z: float
    rx: float
    ry: float
    rz: float


@dataclass(frozen=True)
class ToolState:
    """A tool: ``at`` (2,) initial reference point, ``place`` displacement, ``force`` of the bodies on it.

    ``spring``: force of the springs that it is mounted on, on the tool (None: on none).

    ``work`` of the tool on the bodies since the step began, with what its springs store; ``wear``: normal force times way of slip
    on it since the run began (force × length), nan where it is not known; times k/H of Archard's law it is the worn volume.

    ``direction`` (d,) outward normal of the face of a plane, stamp or ring before any rotation (``place.rz`` turns it).

    ``orientation`` (3,), in space: rotation vector from how the tool was placed to how it stands. The sums ``place.rx``, ``ry``,
    ``rz`` are that only where all turns have one axis; () is taken for these sums.
    """

    at: Array
    place: Place
    force: Force
    direction: tuple[float, ...] = (0.0, -1.0)
    spring: Force | SpatialForce | None = None
    work: float = 0.0
    wear: float = float("nan")
    orientation: tuple[float, ...] = ()


@dataclass(frozen=True, repr=False)
class PointValues(Shown):
    """What the contact law holds at the k integration points of a contact, in order along the surface.

    ``X``/``x`` (k, 2) initial and current positions, ``gap``, ``pressure``, ``shear``, ``slip``, ``status`` (k,) as in
    `ContactState`, ``weight`` (k,) area of the point (2πr inside in axisymmetry). With ``integration: kikuchi`` pressure
    and shear are the projected ones, Σ N_A λ_A at the point. ``speed`` (k,) of slip in the increment (None: not known);
    ``contact_time``, ``sliding_distance``, ``sliding_velocity`` (k,) as in `ContactState`.
    """

    X: Array
    x: Array
    gap: Array
    pressure: Array
    shear: Array
    slip: Array
    status: Bytes
    weight: Array
    speed: Array | None = None
    contact_time: Array | None = None
    sliding_distance: Array | None = None
    sliding_velocity: Array | None = None


@dataclass(frozen=True, repr=False)
class ContactState(Tabular):
    """One contact along its surface; k nodes ordered along the surface (all are candidates, open ones included).

    ``node`` (k,) node numbers of the body, ``X``/``x`` (k, 2) initial and current positions, ``gap``, ``pressure`` ≥ 0
    and ``shear`` (traction along the tool's tangent): nodal force over tributary area, λ_A = Σ_q w_q N_A p_q / ∫N_A dΓ
    for every integration rule, but that the corner of a quadratic edge on the axis of revolution and the middle next to it take
    the mean of their points; ``slip`` (accumulated path length), ``status`` (k,) index into `STATUS`,
    ``weight`` (k,) tributary area (2πr inside in axisymmetry), ``force`` (k, 2) nodal contact force on the body.
    From the stresses in the body: ``pressure_from_stress`` (k,) −n·σ*n with σ* by superconvergent patches,
    ``pressure_smoothed`` with the integration points extrapolated to the nodes and averaged there (the paper's route),
    ``error`` = |pressure − pressure_from_stress| where closed, an error bar. ``area``: area of the closed points.
    ``points``: the same at the integration points. Pressures are per current area.
    ``contact_time`` (k,) seconds in contact so far, ``sliding_distance`` (k,) path along the tool while in contact, without the
    elastic part of a penalty, with or without friction, and ``sliding_velocity`` (k,) its rate per second in the increment;
    None where they are not known.

    In space positions and forces have three components, ``shear`` is the size of the traction along the tool, and both pressures
    from the stresses are those of `prensa.contact.recovery_in_space`.
    """

    surface: str
    tool: str
    body: str
    node: Index
    X: Array
    x: Array
    gap: Array
    pressure: Array
    shear: Array
    slip: Array
    status: Bytes
    weight: Array
    force: Array
    pressure_from_stress: Array
    pressure_smoothed: Array
    error: Array
    area: float
    points: PointValues
    contact_time: Array | None = None
    sliding_distance: Array | None = None
    sliding_velocity: Array | None = None
    speed: Array | None = None
    """(k,) of slip in the increment, at a node of several points their mean weighted by pressure; None: not known."""

    def _line(self) -> str:
        largest = f"largest pressure {self.pressure.max(initial=0):.4g}"
        return f"{self.surface} on {self.tool}: {len(self.node)} nodes ({self._counts()}), {largest}"

    def _counts(self) -> str:
        return ", ".join(f"{np.count_nonzero(self.status == k)} {word}" for k, word in enumerate(STATUS))

    def _card(self) -> list[tuple[str, str]]:
        rows = [("contact", f"{self.surface} on {self.tool}"), ("nodes", f"{len(self.node)}: {self._counts()}")]
        rows.append(("area", f"{self.area:.5g}"))
        largest = {"pressure": self.pressure, "|shear|": np.abs(self.shear), "slip": self.slip, "error": self.error}
        return rows + [(f"largest {name}", f"{v.max(initial=0):.5g}") for name, v in largest.items()]


def sliding(of: ContactState | PointValues) -> dict[str, Array]:
    """Times, distances and velocities (k,) along the tool by their names, as far as they are known."""
    found = {name: getattr(of, name) for name in SLIDING_FIELDS}
    return {name: values for name, values in found.items() if values is not None}


@dataclass(frozen=True, repr=False)
class BodyState(Tabular):
    """One body: n nodes, m cells of 3, 4, 6 or 8 nodes (corners counter-clockwise, then mid-side nodes).

    ``X``, ``x`` (n, 2); ``cells`` (m, a); ``reaction`` (n, 2) force of the supports on the node (0 where free);
    ``stress`` (n, 4) recovered Cauchy stress xx, yy, zz, xy; ``mises`` (n,); ``plastic_strain`` (n,) equivalent;
    ``thickness`` (n,) current, in plane stress (None elsewhere); ``damage``: D (n,) by the name of each damage law of the body;
    ``strain_rate`` (n,) rate of the equivalent plastic strain per second in the increment (None: not known);
    ``surface_expansion`` (n,) surface now over that at the beginning, of the outline (not a number inside; None: not known). In
    space vectors have three components, cells are bricks of 8 nodes, and the stress (n, 6) has yz and xz too.
    """

    X: Array
    x: Array
    cells: Index
    reaction: Array
    stress: Array
    mises: Array
    plastic_strain: Array
    thickness: Array | None = None
    damage: Mapping[str, Array] = field(default_factory=dict)
    strain_rate: Array | None = None
    surface_expansion: Array | None = None

    @property
    def displacement(self) -> Array:
        """(n, 2) displacement from the initial position."""
        return self.x - self.X

    @property
    def mean_stress(self) -> Array:
        """(n,) third of the trace of the stress, positive in tension."""
        return np.asarray(self.stress[:, :3].sum(axis=1) / 3.0)

    @property
    def triaxiality(self) -> Array:
        """(n,) mean stress over the von Mises stress (Rice and Tracey 1969): 1/3 in uniaxial tension; 0 without stress."""
        return np.divide(self.mean_stress, self.mises, out=np.zeros(len(self.mises)), where=self.mises > 0.0)

    @property
    def lode(self) -> Array:
        """(n,) Lode parameter (2 σ₂ − σ₁ − σ₃)/(σ₁ − σ₃) of the principal stresses σ₁ ≥ σ₂ ≥ σ₃ (Lode 1926).

        −1 in uniaxial tension, 0 in shear, 1 in uniaxial compression; 0 where all three are the same.
        """
        if self.stress.shape[1] == 6:
            low, mid, high = np.linalg.eigvalsh(self.stress[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)).T
        else:
            xx, yy, zz, xy = self.stress.T
            middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
            low, mid, high = np.sort([middle - radius, middle + radius, zz], axis=0)
        return np.divide(2.0 * mid - low - high, high - low, out=np.zeros(len(low)), where=high > low)

    def _line(self) -> str:
        largest = f"mises ≤ {self.mises.max(initial=0):.4g}, plastic strain ≤ {self.plastic_strain.max(initial=0):.4g}"
        return f"{len(self.x)} nodes, {len(self.cells)} elements, {largest}"

    def _card(self) -> list[tuple[str, str]]:
        moved = np.sqrt((self.displacement**2).sum(axis=1)).max(initial=0)
        rows = [("nodes, elements", f"{len(self.x)}, {len(self.cells)}"), ("largest displacement", f"{moved:.5g}")]
        largest = {"von Mises stress": self.mises, "plastic strain": self.plastic_strain}
        largest |= {f"damage {name}": values for name, values in self.damage.items()}
        return rows + [(f"largest {name}", f"{v.max(initial=0):.5g}") for name, v in largest.items()]


@dataclass(frozen=True, repr=False)
class MaterialPoints(Shown):
    """What a body holds at its q integration points of m cells, before anything is recovered at the nodes.

    ``stress`` (m, q, 4) Cauchy stress xx, yy, zz, xy, in space (m, q, 6) with yz and xz; ``plastic_strain`` (m, q) equivalent;
    ``damage``: D (m, q) by the name of each damage law of the body.
    """

    stress: Array
    plastic_strain: Array
    damage: Mapping[str, Array] = field(default_factory=dict)

    def _line(self) -> str:
        cells, points = self.plastic_strain.shape
        return f"{cells} elements of {points} points, plastic strain ≤ {self.plastic_strain.max(initial=0):.4g}"


@dataclass(frozen=True)
class Shape:
    """Where a body is, without its stresses: n nodes, m cells as in `BodyState`.

    ``X``, ``x``, ``start`` (n, 2): positions at first, now, and at the start of the step; ``edges`` of its boundaries by
    name, each (k, 2|3), body on the left; ``corners``: named points.
    """

    X: Array
    x: Array
    start: Array
    cells: Index
    edges: Mapping[str, Index]
    corners: Mapping[str, int]


class PlasticPower(NamedTuple):
    """Plastic power per initial volume at the integration points of a body, and their initial volumes, both (m, q)."""

    density: Array
    volume: Array


class Reaction(NamedTuple):
    """Force of a support on the body."""

    x: float
    y: float


class SpatialReaction(NamedTuple):
    """Force of a support on the body in three dimensions."""

    x: float
    y: float
    z: float


class Moment(NamedTuple):
    """Moment of a support on the body about the origin of the coordinates, in three dimensions."""

    mx: float
    my: float
    mz: float


FORCE_IN: Mapping[int, Any] = {2: Force, 3: SpatialForce}
PLACE: Mapping[int, Any] = {2: Place, 3: SpatialPlace}
REACTION: Mapping[int, Any] = {2: Reaction, 3: SpatialReaction}
"""By the dimension of space."""


class Mean(NamedTuple):
    """Mean of a quantity over the last element that passed through a contact, and half of what it rose and fell meanwhile."""

    mean: float
    ripple: float


@dataclass(frozen=True)
class Statistics:
    """Cost of an increment: Newton iterations (rejected attempts included), cut-backs, final relative residual."""

    iterations: int
    cutbacks: int
    residual: float
    augmentations: int = 0
    residuals: tuple[float, ...] = ()
    """Relative residual at each iteration of the accepted attempt."""
    changes: tuple[int, ...] = ()
    """Contact points whose status changed, at each of those iterations."""
    krylov: int = 0
    """Iterations of GMRES that its linear systems took, where these are solved so (in space)."""


@runtime_checkable
class Observable(Protocol):
    """A number of an increment; `prensa.measures.Measure` is one."""

    def value(self, increment: Increment) -> float:
        """The number."""


Parse = Callable[[str, "Problem"], Observable]
"""Makes the observable of a text in a problem: `prensa.measures.parse`, which reads increments and stands above them."""


class More(NamedTuple):
    """What an increment computes when it is asked for, beside its state: see `Increment.shapes` and `Increment.plastic_power`."""

    problem: Problem
    parse: Parse
    shapes: Callable[[], Mapping[str, Shape]]
    plastic_power: Callable[[], Mapping[str, PlasticPower]]
    assembled: Callable[[], Assembled] | None = None
    folding: Callable[[], Mapping[str, Folding]] | None = None
    points: Callable[[], Mapping[str, MaterialPoints]] | None = None
    wear: Callable[[str], float] | None = None


@dataclass(frozen=True)
class Derivatives:
    """Derivatives of an increment by parameters.

    ``flat`` by path: what is left of the residual along the derivative, over the forces, for a change of the parameter by its
    own size; round-off where the derivative is exact. ``switched`` by contact: points that have closed or opened in the
    increment, where forces over a parameter have kinks. ``at_kinks`` by contact: points that are at a kink themselves, since they
    just touch, or stick with the bound of friction: the derivative is that of the one side, at such times and from there on.
    """

    flat: Mapping[str, float]
    switched: Mapping[str, int]
    at_kinks: Mapping[str, int]

    def of(self, observable: Observable | Callable[[Increment], float], increment: Increment) -> dict[str, float]:
        """Derivatives of a number that is read off the increment that they belong to, by the path of the parameter."""
        raise NotImplementedError

    def measure(self, name: str, problem: Problem) -> Observable:
        """The measure of a text in a problem, that of all increments of the run."""
        raise NotImplementedError


class Temperatures(NamedTuple):
    """Temperatures (n,) of the nodes by body, and heat (force × length) since the beginning.

    Work of ``friction``, of which ``into_tools`` went away, what came in ``through_sides`` that are held at a temperature, and
    what is ``stored`` over the temperature at the beginning: friction + through_sides = stored + Σ into_tools.
    """

    bodies: Mapping[str, Array]
    friction: float
    into_tools: Mapping[str, float]
    through_sides: float
    stored: float


@dataclass(frozen=True, repr=False)
class Increment(Drawn):
    """A converged, committed increment. ``number`` counts from 1 over the whole run (0 is the initial state)."""

    step: str
    step_number: int
    number: int
    time: float
    tools: Mapping[str, ToolState]
    energy: Mapping[str, float]
    """external, elastic, plastic, friction, contact, viscous, imbalance."""
    supports: Mapping[str, Reaction]
    """By boundary: what it holds; a node of two boundaries counts for the first that holds it in that direction."""
    statistics: Statistics
    end_of_step: bool
    _state: Callable[[], State] = field(repr=False, compare=False)
    _contacts: Callable[[], Mapping[str, ContactState]] = field(repr=False, compare=False)
    _bodies: Callable[[], Mapping[str, BodyState]] = field(repr=False, compare=False)
    remeshings: int = 0
    """Meshes that have been made in the run so far."""
    stopped: str = ""
    """What ended the step here before its time, in words; '' if nothing did."""
    passing: Mapping[str, Passing] = field(default_factory=dict)
    """By contact, of those whose tool has an end: elements that passed in this increment and that lie in it, mean pressure."""
    passages: Mapping[str, float] = field(default_factory=dict)
    """The same contacts: elements that have passed in the whole run."""
    means: Mapping[str, Mean] = field(default_factory=dict)
    """By column of ``history.csv`` and ``<contact>.pressure``: over the last element that passed in this step, where one has."""
    jump: float = float("nan")
    """Share of the increment after which forces that drive the run jumped in it, as its work says; nan where they did not."""
    seconds: float = 0.0
    """Since the beginning, by the durations of the steps."""
    support_moments: Mapping[str, Moment] = field(default_factory=dict)
    """In space, of the same boundaries about the origin of the coordinates, where the bodies are; empty in the plane."""
    temperatures: Temperatures | None = field(default=None, repr=False, compare=False)
    """Of the bodies, where the problem describes heat."""
    derivatives: Derivatives | None = field(default=None, repr=False, compare=False)
    """By the parameters that `solve` was asked for; None without."""
    _more: More | None = field(default=None, repr=False, compare=False)

    def _line(self) -> str:
        forces = "; ".join(f"{name} " + ", ".join(f"{v:.4g}" for v in t.force[:-1]) for name, t in self.tools.items())
        return f"{self.number}: step {self.step}, time {self.time:.6g}" + (f", forces {forces}" if forces else "")

    def _card(self) -> list[tuple[str, str]]:
        rows = [("increment", f"{self.number}, step {self.step}, time {self.time:.6g}")]
        for name, t in self.tools.items():
            pairs = [f"{c} {v:.5g}" for kind in (t.place, t.force) for c, v in zip(kind._fields, kind)]
            half = len(t.place)
            rows.append((name, f"displacement {', '.join(pairs[:half])}; force {', '.join(pairs[half:])}"))
        rows.append(("energy", ", ".join(f"{k} {v:.4g}" for k, v in self.energy.items())))
        cost = self.statistics
        rows.append(("cost", f"{cost.iterations} iterations, {cost.cutbacks} cut-backs, residual {cost.residual:.1e}"))
        return rows

    def force(self, tool: str) -> Force:
        """Force of the bodies on *tool*, positive along +axis (a punch pressing down feels a positive y)."""
        take("force", "tool", tool, str, "give the name of a tool")
        if tool not in self.tools:
            raise PrensaError(f"unknown tool {tool!r}{suggest(str(tool), self.tools)}")
        return self.tools[tool].force

    def derivative(self, observable: str | Observable | Callable[[Increment], float]) -> dict[str, float]:
        """Derivatives of a measure, or of a function of an increment, by the parameters that `solve` was asked for, by path.

        ``increment.derivative("die.force.y")["friction.mu"]``: per unit of the parameter, in the units of the case, at the
        same time.

        Raises
        ------
        PrensaError
            If the run has no derivatives, or there is no such measure.

        """
        if self.derivatives is None:
            raise PrensaError("this run has no derivatives; ask for them: solve(problem, derivatives=['friction.mu'])")
        if not callable(observable) and not isinstance(observable, Observable):
            take("derivative", "observable", observable, str, "give the name of a measure, such as 'punch.force.y'")
            observable = self.derivatives.measure(observable, self._known.problem)
        return self.derivatives.of(observable, self)

    @cached_property
    def state(self) -> State:
        """The committed state, from which the run can be continued; of condensed bodies recovered when first asked for."""
        return self._state()

    @property
    def _known(self) -> More:
        if self._more is None:
            raise PrensaError("this increment was made by hand: it knows no shapes and no problem; solve the case")
        return self._more

    @property
    def problem(self) -> Problem:
        """The description that it belongs to."""
        return self._known.problem

    @cached_property
    def shapes(self) -> Mapping[str, Shape]:
        """Shapes of the bodies by name; no stress is recovered for them."""
        return self._known.shapes()

    @cached_property
    def folding(self) -> Mapping[str, Folding]:
        """Re-entrant corners and folds of the outlines by body."""
        if self._known.folding is None:
            raise PrensaError("an increment read back has no outlines; only increments from solve have them")
        return self._known.folding()

    @cached_property
    def points(self) -> Mapping[str, MaterialPoints]:
        """Stresses, plastic strains and damage at the integration points by body; in files with ``output: {points: true}``."""
        if self._known.points is None:
            raise PrensaError("this increment has no values at integration points; only increments from solve have them")
        return self._known.points()

    def wear_of(self, tool: str) -> float:
        """Normal force times way of slip on a tool since the run began; of a run read back, from its contact tables.

        Not a number where it is not known.
        """
        wear = self.tools[tool].wear
        if not math.isnan(wear) or self._more is None or self._more.wear is None:
            return wear
        return self._more.wear(tool)

    @cached_property
    def plastic_power(self) -> Mapping[str, PlasticPower]:
        """Plastic power by body, in this increment."""
        return self._known.plastic_power()

    def measure(self, text: str) -> float:
        """The number that *text* names, as in ``increment.measure("punch.force.y")`` (docs/guide/measures.md).

        Raises
        ------
        MeasureError
            If there is no such measure, or it has no value in this increment.

        """
        take("measure", "text", text, str, "give the name of a measure, such as 'punch.force.y'")
        return self._known.parse(text, self._known.problem).value(self)

    @cached_property
    def contacts(self) -> Mapping[str, ContactState]:
        """Contact states by name ``<surface>-<tool>``, computed when first asked for."""
        return self._contacts()

    @cached_property
    def bodies(self) -> Mapping[str, BodyState]:
        """Body states by name, stresses recovered when first asked for."""
        return self._bodies()


@dataclass(frozen=True)
class Progress:
    """A sign of life, sent to the monitor at every Newton iteration and every accepted or rejected increment."""

    step: str
    step_number: int
    number: int
    time: float
    end: float
    """Time at the end of the last step."""
    iteration: int
    residual: float
    forces: Mapping[str, Force]
    event: str = "iteration"
    """'iteration', 'accepted', 'rejected' or 'note' (first touch, approach of a force-driven tool …)."""
    message: str = ""
    places: Mapping[str, Place] = field(default_factory=dict)
    """Where the tools are, of the events that have their forces."""
    krylov: int = 0
    """Iterations of GMRES in the increment so far, where linear systems are solved so (in space)."""


Monitor = Callable[[Progress], None]
