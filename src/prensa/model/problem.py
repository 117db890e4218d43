"""The vocabulary: frozen, validated dataclasses that describe a problem and say nothing about how it is solved.

A class is its YAML ``type`` and a field is its YAML key, so a file and a script describe the same thing and
``prensa.load(path).problem == problem``. Nothing here imports the numerics.

Numbers are in one consistent system of units (``Problem.units`` names it); in a file, strings such as
``8 cm`` or ``10 GPa`` are converted to it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import copy
from dataclasses import field, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator

from prensa.model.crank import Crank
from prensa.model.default_elements import element_name
from prensa.model.doors import name_of, union
from prensa.model.feed import Feed
from prensa.model.fields import (
    AngleValue,
    DisplacementValue,
    ForceDensity,
    ForceValue,
    MomentValue,
    PressureValue,
    Springs,
    Traction,
    as_names,
    as_table,
    described,
    in_order,
    value_kind,
)
from prensa.model.heat import Heat
from prensa.model.interference import Interference, InterferenceValue
from prensa.model.meshes import (
    Annulus,
    ArcSide,
    Box,
    Bricks,
    Cylinder,
    Disc,
    Extrusion,
    File,
    Grade,
    Mesh,
    Nose,
    Outline,
    Patch,
    Points,
    Rectangle,
    Revolution,
    SplineSide,
    Strip,
    Tetrahedra,
    Wire,
)
from prensa.model.names import Finding
from prensa.model.not_in_space import words_of
from prensa.model.press import OPPOSITE_SIDES, Press, mirrored_side, unknown_bodies
from prensa.model.python_alone import WHOLE
from prensa.model.remeshing import Remesh, RemeshValue, Sizes, When
from prensa.model.units import (
    Displacement,
    ForceUnit,
    Length,
    LengthUnit,
    Number,
    Seconds,
    Whole,
    in_one_second,
)
from prensa.model.until import ToolForce, ToolTravel, Until
from prensa.registry import DOORS


def _switched_off(value: Any) -> Any:
    """'off', which older YAML reads as false."""
    return "off" if value is False else value


def _stabilise_kind(value: Any) -> str:
    share = isinstance(value, str) and value.rstrip().endswith("%")
    return "number" if share or isinstance(value, int | float) else "word"


Stabilise = Annotated[
    Annotated[Literal["auto", "off"], Tag("word")] | Annotated[Number, Field(gt=0, le=0.1), Tag("number")],
    Discriminator(_stabilise_kind),
    BeforeValidator(_switched_off),
]


# --------------------------------------------------------------------------------------------------------- materials
if TYPE_CHECKING:  # members are known when the program runs
    Material: TypeAlias = Any
else:
    Material = union("material")


if TYPE_CHECKING:  # members are known when the program runs
    ElementName: TypeAlias = str
else:
    ElementName = name_of("element")


def _chosen(value: Any) -> Any:
    """``auto`` is what an element is that nobody names."""
    return None if value == "auto" else value


# ---------------------------------------------------------------------------------------------------- damage
def _as_laws(value: Any) -> Any:
    """Accept one law for a list of one."""
    return tuple(value) if isinstance(value, list | tuple) else (value,)


if TYPE_CHECKING:  # members are known when the program runs
    Damage: TypeAlias = Any
    OneOrMore: TypeAlias = Any
else:
    Damage = union("damage")
    OneOrMore = BeforeValidator(_as_laws, json_schema_input_type=tuple[Damage, ...] | Damage)


@described
class Body:
    """Deformable body: a mesh of one material and ``element``.

    ``q4_fbar`` does not lock in volume and withstands large plastic flow; ``q4_enhanced`` does not lock in bending either;
    ``q4_bbar`` is ``q4_fbar`` with forces that derive from the energy stored and dissipated, so that balances close;
    ``q4_sheet`` is ``q4_enhanced`` with nine points across each layer, for elastic-plastic bending and springback;
    ``q8`` (2 × 2 points) and ``t6`` are quadratic; ``q4``, ``t3`` and ``q8_full`` (3 × 3 points) are the textbook elements,
    which lock in plastic flow.
    Without ``element``, or with ``auto``: ``q4_fbar``, and ``q4`` in plane stress, where nothing locks in volume and F-bar has no
    meaning;
    ``q4_enhanced`` for elastic bodies whose layers would err by 5 % in bending and that nothing presses across their thickness;
    ``q4_bbar`` for bodies that flow where a tool works with a given energy; ``t6`` for bodies that flow and are remeshed, and for
    outlines, whose meshes are of triangles.
    In space: ``h8_fbar``, for such elastic bodies ``h8_enhanced``; ``h8_bbar`` as in the plane; ``h8`` is the textbook brick.
    Tetrahedra are ``t10``.
    ``damage``: a damage law or a list of several, evaluated along with plastic flow; the mechanics do not depend on it.
    """

    mesh: Mesh
    material: Material
    element: Annotated[ElementName | None, BeforeValidator(_chosen)] = None
    damage: Annotated[tuple[Damage, ...], OneOrMore] = ()



# ---------------------------------------------------------------------------------------------------------- friction
if TYPE_CHECKING:  # members are known when the program runs
    Friction: TypeAlias = Any
else:
    Friction = union("friction")


# -------------------------------------------------------------------------------------------------------------- tools
if TYPE_CHECKING:
    Tool: TypeAlias = Any
else:
    Tool = union("tool")


# ------------------------------------------------------------------------------------------------------------ contact
if TYPE_CHECKING:  # members are known when the program runs
    Enforcement: TypeAlias = Any
    RuleName: TypeAlias = str
else:
    Enforcement = union("enforcement")
    RuleName = name_of("integration rule")


def _default_enforcement() -> Any:
    # Multipliers would make every system a saddle point, to remove a penetration of a thousandth of an element.
    return DOORS["enforcement"].find("penalty")()


@described
class Contact:
    """Contact of ``surface`` (a body: its whole outline; a boundary ``body.name`` or a list of them) against a tool.

    The outline of a body excludes sides that other contacts with the same tool name (with their own friction, say), sides in
    ``no_contact``, and what no tool touches: the axis, lines of symmetry (held along their normal in all steps) and tied sides.
    ``friction`` overrides the problem's. ``integration``: where the contact terms are integrated; ``enforcement``: how contact
    is enforced. The rule to use is ``nodal`` (trapezoid); the others are for comparison: ``gauss1``, ``gauss2``, ``gauss3``,
    ``simpson`` on each edge, and ``kikuchi``, two Gauss points with pressures projected to the nodes. ``interference``: an
    intended overlap of surface and tool: a length, ``geometry`` (the overlap as it is drawn) or an `Interference`.
    """

    surface: Annotated[tuple[str, ...], BeforeValidator(as_names), Field(min_length=1)]
    against: str
    friction: Friction | None = None
    enforcement: Enforcement = field(default_factory=_default_enforcement)
    integration: RuleName = "nodal"
    interference: InterferenceValue | None = None

    whole_in_space: ClassVar[bool] = False
    """Whether the surface may be a whole body in space; that is not available to descriptions."""

    @property
    def name(self) -> str:
        """``<surface>-<tool>``, the name used in files and by steps."""
        return "+".join(self.surface) + "-" + self.against


@described
class NoContact:
    """Sides that a tool may go through: ``surface`` (a body, a boundary ``body.name`` or a list of them) ``against`` a tool.

    No contact acts between them, and metal may lie inside the tool there. ``symmetry`` in place of a tool: bodies that may go
    beyond lines or planes of symmetry and the axis, which are rigid smooth planes to free sides otherwise.
    """

    surface: Annotated[tuple[str, ...], BeforeValidator(as_names), Field(min_length=1)]
    against: str


def _run_folder(run: Any, info: Any) -> Any:
    from prensa.model.tables import found_run

    return found_run(run, info.context) if isinstance(run, str) else run


@described
class Start:
    """The case begins where an earlier run ended: ``run`` is its folder of results, relative to the case file.

    Bodies of the same name have the same mesh, material and element, and begin with their displacements and histories; tools of
    the same name and description begin where they were left, their contacts as they were; other tools are placed on the deformed
    bodies. Supports, tools and loads that no longer exist are released linearly during the first step. ``digest`` is filled in
    by the program: a run is resumed only from the run that it began with.
    """

    run: Annotated[str, BeforeValidator(_run_folder)]
    digest: str | None = None

    @model_validator(mode="after")
    def _check(self) -> Start:
        from prensa.model.tables import digest_of

        digest = digest_of(f"{self.run}/checkpoint.h5")
        if self.digest not in (None, digest):
            raise ValueError(f"the run in {self.run!r} has changed since this case was written; run the case again")
        object.__setattr__(self, "digest", digest)
        return self


@described
class Tie:
    """Two bodies joined along a boundary of each, without slip or opening: the ``slave`` side follows the ``master`` side.

    Nodes at the same places become one. Otherwise every slave node follows as a weighted mean of the master's nodes (dual mortar
    conditions, exactly eliminated): the finer side, or the softer body, is the slave, and it lies on the master all along. Gaps
    and overlaps of the two are removed without stress, except for an intended ``interference``: a length, ``geometry`` (gaps and
    overlaps as they are drawn, up to an edge of the slave side) or an `Interference`.
    """

    slave: str
    master: str
    interference: InterferenceValue | None = None


@described
class BodyContact:
    """Contact of two bodies along a side of each: they press on each other, slide with friction, and open.

    Gaps are weighted with the shape functions of the ``slave`` side, the finer or softer one (mortar method): a uniform pressure
    goes through meshes that do not match. ``enforcement``: a `Penalty`, at M/h of the softer side. ``friction`` overrides the
    problem's.
    """

    slave: str
    master: str
    enforcement: Enforcement = field(default_factory=_default_enforcement)
    friction: Friction | None = None

    offered: ClassVar[bool] = False
    integration: ClassVar[str] = "nodal"
    """The slave's nodes are the contact points."""

    @property
    def surface(self) -> tuple[str, ...]:
        """The side whose points are in contact: the slave's."""
        return (self.slave,)

    @property
    def against(self) -> str:
        """What they lie against: the master's side."""
        return self.master

    @property
    def name(self) -> str:
        """``<slave>-<master>``."""
        return f"{self.slave}-{self.master}"


# -------------------------------------------------------------------------------------------------- motion and loads
def _support_kind(value: Any) -> str:
    return "held" if isinstance(value, str) and value == "held" else value_kind(value)


SupportValue = Annotated[
    Annotated[Literal["held"], Tag("held")]
    | Annotated[Displacement, Tag("number")]
    | Annotated[tuple[tuple[Number, Displacement], ...], Field(min_length=2), AfterValidator(in_order), Tag("table")],
    Discriminator(_support_kind),
    BeforeValidator(as_table),
]


SPATIAL_AXES = ("x", "y", "z")
"""Along which bodies and tools are displaced; those of the plane are the first two."""


@described
class Fixed:
    """Support of a boundary along ``x``, ``y`` and in space ``z``: ``held``, a displacement, a table of it, or none.

    ``normal: held``, of the problem or its first step, holds a flat side in space along its normal, whatever the axes, in all
    steps: a plane of symmetry of a sector. ``free`` releases what earlier entries prescribed there: its force goes linearly to
    zero over the step.
    """

    x: SupportValue | None = None
    y: SupportValue | None = None
    free: bool = False
    z: SupportValue | None = None
    normal: Literal["held"] | None = None


def _as_fixed(value: Any) -> Any:
    """'x', 'y', 'xy', in space also 'z', 'xz', 'yz', 'xyz', 'normal', are short for held components, 'free' for a release."""
    if isinstance(value, list | tuple | bool):
        raise ValueError("write 'x', 'y', 'xy', 'free' or a mapping of x and y to values")
    if isinstance(value, str):
        if value == "free":
            return {"free": True}
        if value == "normal":
            return {"normal": "held"}
        if value not in ("x", "y", "xy", "z", "xz", "yz", "xyz"):
            words = "'xyz', 'normal' (a plane of symmetry), 'free' or a mapping of x, y (and z) to values"
            raise ValueError(f"{value!r} is not 'x', 'y', 'xy', in space also 'z', 'xz', 'yz', {words}")
        return dict.fromkeys(value, "held")
    return value


FixedValue = Annotated[Fixed, BeforeValidator(_as_fixed)]


@described
class Motion:
    """Displacement (or velocity) ``x``, ``y`` of a tool's reference point and its rotation ``rz``, counter-clockwise.

    In space ``z``, ``rx`` and ``ry`` too. There the changes of ``rx``, ``ry``, ``rz`` since the start of a step are the rotation
    vector of the step: the tool turns about one axis in space through its reference point, right-handed, from how it stood at
    the start of the step. They add up over the steps, and turns about different axes come one after the other.
    """

    x: DisplacementValue | None = None
    y: DisplacementValue | None = None
    rz: AngleValue | None = None
    z: DisplacementValue | None = None
    rx: AngleValue | None = None
    ry: AngleValue | None = None


def _per_second(value: Any) -> Any:
    """Unit strings of a velocity, such as ``100 mm/s`` (also in its tables), as the displacement of one second."""
    if isinstance(value, dict):
        return {k: v if isinstance(v, dict) else _per_second(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        pairs = (isinstance(p, list | tuple) and len(p) == 2 and isinstance(p[1], str) for p in value)
        return [[p[0], _per_second(p[1])] if pair else p for p, pair in zip(value, pairs)]
    if isinstance(value, str):
        return in_one_second(value)
    return value


Velocity = Annotated[Motion, BeforeValidator(_per_second)]


@described
class Push:
    """Force ``x``, ``y`` on a tool at its reference point and moment ``m``; 0 leaves the tool free to move along or to turn.

    In space forces ``x``, ``y``, ``z`` and moments ``mx``, ``my``, ``mz``, whose directions stay in space when the tool turns.

    A number is reached linearly from the force that the tool carries at the start of the step, pushed or moved before.
    In plane problems of the whole ``thickness`` (so per unit thickness where that is 1); strings may be per length of
    thickness too, such as ``-35 N/mm``. In axisymmetry of the whole circumference.
    """

    x: ForceValue | None = None
    y: ForceValue | None = None
    m: MomentValue | None = None
    z: ForceValue | None = None
    mx: MomentValue | None = None
    my: MomentValue | None = None
    mz: MomentValue | None = None


@described
class Load:
    """Load on a boundary: ``traction`` (dead: fixed direction, per undeformed area) or ``pressure`` and ``shear``.

    A traction has two components, in space three; there is no ``shear`` in space, where a side has no direction of its own.

    ``pressure`` pushes into the body, ``shear`` acts along the boundary (body on the left when walking along +).
    With ``follower`` (default ``true``) both turn with the surface and act on its current area; without, on the undeformed
    one. A later load on the boundary that does not say ``follower`` keeps what an earlier one said. A later traction replaces
    pressure and shear, and they replace a traction, linearly over the step.
    """

    pressure: PressureValue | None = None
    shear: PressureValue | None = None
    traction: Traction | None = None
    follower: bool | None = None

    @model_validator(mode="after")
    def _check(self) -> Load:
        if (self.traction is None) == (self.pressure is None and self.shear is None):
            raise ValueError("give either 'traction' or 'pressure' and/or 'shear'")
        return self


@described
class Step:
    """One stage of the history; step k spans time k − 1 … k, and lasts ``duration``.

    ``move``: tool displacement from the initial position reached at the end of the step (or a table);
    ``by``: the same from where the tool is at the start of the step, also of a boundary, whose support it prescribes from then
    on; ``velocity``: tool velocity during the step; ``crank``: of a mechanical press; ``push``: tool force.
    ``feed``: boundaries that push a strip or a wire to the tools, until these have gripped it or ``until`` ends the step; then
    it is free.
    Numbers ramp linearly from the value at the start of the step. What is not mentioned is held. What is released or changed
    ramps linearly over the step from the force that it carries to the requested one; so does friction that is lowered.
    ``remove_tools``: all tools leave the bodies, their forces going linearly to zero over the step, and are gone from then on;
    rigid motions that no support then prevents are held at the fewest points needed, without any force at the end.
    ``increments``: the number of equal increments asked for (each is cut further when it does not converge); without it the
    step size is chosen automatically.
    ``duration``: seconds, or a text such as ``20 ms``; without, one second, or as long as a ``crank`` takes. Velocities,
    rates, speeds of slip and powers are per second; the times of tables count steps.
    ``control``: displacement control of what the step pushes and loads. The tool moves by the given distance (as with ``by``,
    from where it is at the start of the step), and one load factor on all forces that the step changes, 1 at the requested
    ones, follows from equilibrium: a load may pass a maximum on the way. Give one component that ``push`` drives.
    ``name`` stands in tables and overrides. ``fixed``, ``loads``, ``body_force`` and ``friction`` are as in the problem, and
    hold from this step on. ``stabilise`` overrides the problem's. ``until``: what ends the step before that; the rest of its
    time is skipped, and the next step starts from the state that was reached.
    """

    name: str
    move: Mapping[str, Motion] = field(default_factory=dict)
    by: Mapping[str, Motion] = field(default_factory=dict)
    velocity: Mapping[str, Velocity] = field(default_factory=dict)
    crank: Mapping[str, Crank] = field(default_factory=dict)
    feed: Mapping[str, Feed] = field(default_factory=dict)
    push: Mapping[str, Push] = field(default_factory=dict)
    fixed: Mapping[str, FixedValue] = field(default_factory=dict)
    loads: Mapping[str, Load] = field(default_factory=dict)
    body_force: Mapping[str, ForceDensity] = field(default_factory=dict)
    friction: Mapping[str, Friction | None] = field(default_factory=dict)
    remove_tools: bool = False
    duration: Annotated[Seconds, Field(gt=0)] | None = None
    increments: Annotated[Whole, Field(ge=1)] | None = None
    control: Mapping[str, Motion] = field(default_factory=dict)
    stabilise: Stabilise | None = None
    until: Until | None = None


@described
class Units:
    """The consistent system of the case's numbers: ``length`` and ``force``; durations are in seconds, temperature in kelvin."""

    length: LengthUnit = "mm"
    force: ForceUnit = "N"


@described
class Problem:
    """All the physics of a case.

    ``name`` stands in pictures and tables. ``bodies`` deform, ``tools`` are rigid, ``steps`` say one after the other what
    happens; all three, and ``contacts``, ``ties``, ``fixed`` (supports) and ``loads``, are described below. ``friction``
    applies to all contacts without their own. ``units``: the system of all numbers. ``start``: an earlier run that this one
    continues. ``space``: ``plane strain``, ``plane stress`` or ``axisymmetric`` (x is the radius, y the axis), or ``solid``,
    bodies in space. Plane problems have ``thickness``, in plane stress the initial one; axisymmetric ones have none.
    ``kinematics``: ``finite`` (updated Lagrangian) or ``small``. ``contact_geometry``: ``current`` (moved surface, true tool
    normal) or ``reference`` (gap on the undeformed surface along its own normal: linear Signorini). ``allow_large_strain``:
    what ``small`` gives where strains or rotations are beyond 0.1, which is refused otherwise.
    ``body_force``: force per volume ρb on each body.
    ``contacts`` left out (or empty): every tool against the outline of every body; ``no_contact``: what tools may pass
    through.
    ``stabilise``: viscous forces on the velocities of the nodes carry bodies over limit points, where they snap or buckle:
    ``auto``, or the share of the work that they may dissipate (``auto``: 2e-4); ``off`` without. What they do dissipate is in
    the energy balance, and reported when it is more than 1 % of the work. ``measures``: numbers recorded in every increment
    under names of your choice, such as ``bore: ring.left.x at y=0``. ``remesh``: bodies that flow plastically get new meshes
    where theirs become distorted: ``auto``, or a `Remesh`; ``off`` without.
    """

    name: str
    bodies: Mapping[str, Body]
    steps: tuple[Step, ...]
    tools: Mapping[str, Tool] = field(default_factory=dict)
    contacts: tuple[Contact, ...] = ()
    no_contact: tuple[NoContact, ...] = ()
    ties: tuple[Tie, ...] = ()
    fixed: Mapping[str, FixedValue] = field(default_factory=dict)
    loads: Mapping[str, Load] = field(default_factory=dict)
    body_force: Mapping[str, ForceDensity] = field(default_factory=dict)
    friction: Friction | None = None
    space: Literal["plane strain", "plane stress", "axisymmetric", "solid"] = "plane strain"
    kinematics: Literal["finite", "small"] = "finite"
    contact_geometry: Literal["current", "reference"] = "current"
    allow_large_strain: bool = False
    thickness: Annotated[Length, Field(gt=0)] = 1.0
    stabilise: Stabilise = "off"
    remesh: RemeshValue = "off"
    units: Units = field(default_factory=Units)
    start: Start | None = None
    measures: Mapping[str, str] = field(default_factory=dict)
    body_contacts: Annotated[tuple[BodyContact, ...], WHOLE] = ()
    heat: Annotated[Heat | None, WHOLE] = None

    stated: ClassVar[frozenset[str]] = frozenset()
    """Fields that the script or the file which described it names; the others have their defaults."""
    mirrored: ClassVar[tuple[str, ...]] = ()
    """Sides that the output of its case names as planes of symmetry."""
    contacts_filled_in: ClassVar[bool] = False
    """Whether ``contacts`` was left out, and all tools may touch all bodies."""

    def __repr__(self) -> str:
        many = {"body": list(self.bodies), "tool": list(self.tools), "step": [s.name for s in self.steps]}
        parts = (f"{what} {', '.join(names)}" for what, names in many.items() if names)
        return f"<Problem {self.name!r}: {self.space}, {'; '.join(parts)}>"

    def driven(self, step: Step) -> dict[str, Motion | Feed]:
        """Boundaries that a step moves ``by`` a way, what it says of no tool, and those that it feeds."""
        return {name: motion for name, motion in step.by.items() if name not in self.tools} | dict(step.feed)

    def element_name(self, body: str) -> str:
        """Name of the element of a body, the default filled in."""
        return element_name(self, body)

    def has_quadratic_edges(self, body: str) -> bool:
        """Whether edges of a body's elements have nodes in their middles."""
        element: Any = DOORS["element"].find(self.element_name(body))
        return bool(element.quadratic)

    def with_elements(self, chosen: Mapping[str, str]) -> Problem:
        """The same problem with elements ``chosen`` for bodies that name none; what was written in it stays known."""
        made = copy(self)
        bodies = {name: replace(b, element=chosen.get(name, b.element)) for name, b in self.bodies.items()}
        object.__setattr__(made, "bodies", bodies)
        return made

    def with_mirrored(self, sides: tuple[str, ...]) -> Problem:
        """The same problem, of whose sides its case names these as planes of symmetry."""
        made = copy(self)
        object.__setattr__(made, "mirrored", sides)
        return made

    @model_validator(mode="after")
    def _check(self) -> Problem:
        from prensa.model.checks import FindingsError, find

        if not self.contacts:
            # Filled in here, so that solver, reports and 'dump' see the contacts that count.
            object.__setattr__(self, "contacts", self.every_contact())
            object.__setattr__(self, "contacts_filled_in", bool(self.contacts))
        if findings := tuple(find(self)):
            raise FindingsError(findings)
        return self

    @property
    def all_contacts(self) -> tuple[Contact | BodyContact, ...]:
        """The contacts with tools, then those between bodies."""
        return (*self.contacts, *self.body_contacts)

    def every_contact(self) -> tuple[Contact, ...]:
        """Every tool against the outline of every body, but those that ``no_contact`` lists as a whole."""
        none = {(s, n.against) for n in self.no_contact for s in n.surface}
        return tuple(Contact((body,), tool) for tool in self.tools for body in self.bodies if (body, tool) not in none)


def stabilised(problem: Any, number: int) -> float | Literal["auto", "off"]:
    """What ``stabilise`` is in step *number* (from 0) of a problem."""
    own = problem.steps[number].stabilise if number < len(problem.steps) else None
    return problem.stabilise if own is None else own


def support_names(problem: Problem) -> list[str]:
    """Boundaries and points that are held in some step, in the order of the description."""
    later = (name for step in problem.steps for name in (*step.fixed, *problem.driven(step)))
    return list(dict.fromkeys([*problem.fixed, *later]))


def tools_removed(problem: Any, number: int) -> bool:
    """Whether the tools are gone in step *number* (from 0) of a problem."""
    return any(step is not None and step.remove_tools for step in problem.steps[: number + 1])


def ever_stabilised(problem: Any) -> bool:
    """Whether any step of a problem is stabilised."""
    return any(stabilised(problem, k) != "off" for k in range(len(problem.steps)))


SPATIAL_SOLVERS = ("ldlt", "multigrid")
"""Values of ``numerics.solver`` of problems in space alone."""


def why_not(solver: str, problem: Problem) -> str:
    """Why a linear ``solver`` is refused for a problem; '' if it is not."""
    if solver not in SPATIAL_SOLVERS:
        return ""
    if problem.space != "solid":
        why = "is of 'space: solid'; in the plane factors of the matrix itself cost less"
    elif any(c.enforcement.has_multipliers for c in problem.all_contacts):
        why = "has no place for multipliers; with exact enforcement the matrix itself is factored"
    else:
        return ""
    return f"'numerics.solver' is {solver!r}, which {why}: write 'auto', 'pardiso', 'rslab' or 'superlu'"


@described
class Numerics:
    """How the problem is solved. You should rarely need to change the defaults; every threshold is dimensionless.

    ``tolerance``: residual over the sum of absolute element forces; ``max_iterations`` of an attempt; ``line_search`` and
    ``predictor`` (an increment starts where the last two lead) may be switched off; ``max_cutbacks``: how often an increment may
    be cut to a quarter; ``reuse_factors``: finish nearly converged iterates with the factors at hand; ``solver``: ``auto`` takes
    PARDISO when installed, else rslab, else SuperLU; in space from 10 000 unknowns on GMRES, preconditioned by factors ``ldlt``
    of a symmetric matrix, and from 150 000 on by ``multigrid``. ``iteration``: ``newton`` with the exact tangent, or ``paper``:
    the founding paper's, whose contact matrix is symmetric because friction takes the pressure of the last iterate; for
    comparison. ``condense``: linear elastic bodies in small strain are factored once and condensed onto their contact unknowns:
    ``auto`` where it pays, ``true`` wherever it can be done (refused elsewhere), ``false`` never. ``threads`` for elements and
    factorisations: ``auto`` takes the cores that are free, no more than OMP_NUM_THREADS where that is set, and one for small
    problems; one of them computes derivatives, where these are requested, while the run continues. Results are the same bit for
    bit with any number (PARDISO's may not be). ``time_rule`` of J2 plasticity: ``backward_euler``, of first order in the
    increment, ``bdf2``, the backward difference of second order, whose automatic increments are twice as long where bodies flow,
    or ``auto``: ``bdf2`` in automatic increments in which flow is steady. ``time_tolerance``, not of the first: automatic
    increments are as short as it takes for first and second order to differ by no more than this share of the plastic flow;
    without it they go by plastic strain and travel alone. ``energy_tolerance``: automatic increments of a step that ends by the
    work of a tool are so short that the energy balance of each misses no more than this share of that work.
    """

    tolerance: Annotated[Number, Field(gt=0, le=1e-4)] = 1e-9
    max_iterations: Annotated[Whole, Field(ge=2)] = 25
    max_cutbacks: Annotated[Whole, Field(ge=0)] = 7
    line_search: bool = True
    predictor: bool = True
    reuse_factors: bool = True
    iteration: Literal["newton", "paper"] = "newton"
    condense: Literal["auto", True, False] = "auto"
    solver: Literal["auto", "pardiso", "rslab", "superlu", "ldlt", "multigrid"] = "auto"
    threads: Literal["auto"] | Annotated[Whole, Field(ge=1)] = "auto"
    time_rule: Literal["auto", "backward_euler", "bdf2"] = "auto"
    time_tolerance: Annotated[Number, Field(gt=0, lt=1)] | None = None
    energy_tolerance: Annotated[Number, Field(gt=0, lt=1)] = 1e-4

    @model_validator(mode="after")
    def _check(self) -> Numerics:
        if self.time_tolerance is not None and self.time_rule == "backward_euler":
            raise ValueError(
                "'time_tolerance' needs 'time_rule: auto' or bdf2, which measure that: leave one of the two out"
            )
        return self


def _relative(value: Any) -> Any:
    """'relative' is Archard's law without numbers."""
    if isinstance(value, str) and value != "relative":
        words = "write 'relative', or a law with its values, {type: archard, k: …, hardness: …}"
        raise ValueError(f"{value!r} is no wear: {words}")
    return {} if value == "relative" else value


if TYPE_CHECKING:  # members are known when the program runs
    WearValue: TypeAlias = Any
else:
    WearValue = Annotated[union("wear"), BeforeValidator(_relative)]


@described
class Output:
    """What a run writes: fields every ``fields`` increments (0: only the last of each step), pictures, report.

    ``mirror``: planes of symmetry, where a part of the whole was modelled: ends of the bodies (``left``, ``right``, ``bottom``,
    ``top``, in space ``back`` and ``front``) or flat sides (``ring.cap``), held along their normal in all steps. Pictures show
    the whole, and its forces are stated; in axisymmetry the axis mirrors by itself. ``wear``: by
    tool, a wear law (`Archard` where none is named) or ``relative``: loads along its outline and its wear, in the report.
    ``points``: fields have stresses, plastic strains and damage at the integration points too, as they were computed.
    """

    fields: Annotated[Whole, Field(ge=0)] = 1
    pictures: bool = True
    report: bool = True
    mirror: Annotated[tuple[Annotated[str, AfterValidator(mirrored_side)], ...], BeforeValidator(as_names)] = ()
    wear: Mapping[str, WearValue] = field(default_factory=dict)
    points: bool = False

    @model_validator(mode="after")
    def _check(self) -> Output:
        for pair in OPPOSITE_SIDES.values():
            if sum(side in pair for side in self.mirror) > 1:
                raise ValueError(f"'mirror' names one side of {pair[0]!r} and {pair[1]!r} at most, once")
        return self


@described
class Case:
    """A file: the problem and, apart, its numerics and output."""

    problem: Problem
    numerics: Numerics = field(default_factory=Numerics)
    output: Output = field(default_factory=Output)

    @model_validator(mode="after")
    def _check(self) -> Case:
        from prensa.model.checks import FindingsError

        if findings := tuple(self._findings()):
            raise FindingsError(findings)
        if self.problem.mirrored != self.output.mirror:
            object.__setattr__(self, "problem", self.problem.with_mirrored(self.output.mirror))
        return self

    def _findings(self) -> Iterator[Finding]:
        """What numerics and output ask of a problem that has it not."""
        p, mirror = self.problem, set(self.output.mirror)
        if p.space == "axisymmetric" and {"left", "right"} & mirror:
            words = "'output.mirror' cannot name 'left' or 'right' in axisymmetry, whose axis mirrors: leave it out"
            yield Finding(("output", "mirror"), words)
        if words := why_not(self.numerics.solver, p):
            yield Finding(("numerics", "solver"), words)
        if p.space != "solid" and {"back", "front"} & mirror:
            words = "'output.mirror' cannot name 'back' or 'front' in the plane: they are sides in 'space: solid'"
            yield Finding(("output", "mirror"), words)
        yield from unknown_bodies(p, self.output.mirror, ("output", "mirror"))
        if p.space == "solid" and self.output.wear:
            yield Finding(("output", "wear"), words_of("wear"), at_key=True)
        for tool, law in self.output.wear.items():
            if words := law.fault():
                words = f"wear law {law.type!r}: {words}; try it with prensa.testing.check_wear"
                yield Finding(("output", "wear", tool), words)
            if tool not in p.tools:
                known = ", ".join(map(repr, p.tools)) or "none"
                words = f"'output.wear' names the tool {tool!r}, which there is not; tools: {known}"
                yield Finding(("output", "wear", tool), words, at_key=True)
        for name, tool in p.tools.items():
            press = tool.press
            if press is not None and press.mirror is None and self.output.mirror:
                sides = ", ".join(self.output.mirror)
                yield Finding(
                    ("output", "mirror"),
                    f"'output.mirror' says that a part of the whole is modelled: give the press of {name!r} "
                    f"'mirror: [{sides}]' too, so that the forces of the whole are compared with it, or 'mirror: []' if it forms "
                    "no more than is modelled",
                )


__all__ = [
    "Annulus", "ArcSide", "Body", "Box", "Bricks", "Case", "Contact", "Crank", "Cylinder", "Disc", "Extrusion", "Feed",
    "File", "Fixed", "Grade", "Interference", "Load", "Motion", "NoContact", "Nose", "Numerics", "Outline", "Output", "Patch",
    "Points", "Press", "Problem", "Push", "Rectangle", "Remesh", "Revolution", "Sizes", "SplineSide", "Springs", "Start", "Step",
    "Strip", "Tetrahedra", "Tie", "ToolForce", "ToolTravel", "Units", "Until", "When", "Wire",
]  # fmt: skip
