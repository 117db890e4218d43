"""From the text of a measure to the measure: what it is of, which quantity, where."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from prensa.errors import PrensaError, take
from prensa.measures import bodies, contacts, cuts, damage, filling, folds
from prensa.measures.bodies import Outline, Place
from prensa.measures.columns import columns, directions, force_columns, place_columns
from prensa.measures.measure import Count, Gradient, Measure, MeasureError, Slope, Value
from prensa.measures.places_in_space import PlaceInSpace
from prensa.measures.units import (
    area_unit,
    energy_unit,
    force_unit,
    length_unit,
    moment_unit,
    pressure_unit,
    volume_unit,
)
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import Mesh
from prensa.model.not_in_space import words_of
from prensa.model.problem import Problem
from prensa.model.units import factor
from prensa.result.increment import SLIDING_FIELDS, Shape

if TYPE_CHECKING:
    from prensa.result.increment import Increment

GUIDE = "docs/guide/measures.md lists them all"
POSITIONS = ("x", "y", "ux", "uy")
"""Of a place: coordinates and displacements; in space `SPATIAL_POSITIONS`."""
SPATIAL_POSITIONS = ("x", "y", "z", "ux", "uy", "uz")
EXTENTS = {2: {"height": "y", "width": "x"}, 3: {"height": "y", "width": "x", "depth": "z"}}
"""Names of the extents of a body, and along which axis they are."""
OF_OUTLINES = ("angle", *folds.OF_FOLDS, *filling.FILL, *filling.POCKETS)
"""What is measured along an outline, a line: bodies in space have none, but where a plane cuts them (`prensa.measures.cuts`)."""
NODAL_FIELDS = (
    "mises", "plastic_strain", "displacement", "stress.xx", "stress.yy", "stress.zz", "stress.xy", "mean_stress", "triaxiality",
    "lode", "strain_rate", "surface_expansion",
)  # fmt: skip
CONTACT_EXTREMES = (
    "max.pressure", "max.shear", "max.slip", "max.friction_power", "mean.pressure", "mean.shear", "min.gap",
    *(f"{m}.{q}" for m in ("max", "mean") for q in SLIDING_FIELDS),
)  # fmt: skip
COUNTS = ("open", "stick", "slip")
TOOL_QUANTITIES = ("force", "force.x", "force.y", "moment", "travel", "travel.x", "travel.y", "rotation", "wear")
DEEPEST = 20  # brackets of a measure: functions in one another are read one inside the other
# A few functions and no expressions of Python: these would be a second language in case files, without units or derivatives.
FUNCTIONS = (
    "angle", "change", "curvature", "distance", "mean", "radius", "ripple", "thickening", "thickest", "thickness", "thinning",
)  # fmt: skip
OVER_RUN = re.compile(r"(max|min)\s*\((.*)\)")
NOT_NUMBERS = ("step", "increment")


def parse(text: str, problem: Problem) -> Measure:
    """The measure that *text* names in a problem, as in ``punch.force.y`` or ``billet.right.x at y=0``.

    A name under the problem's ``measures`` stands for what is written there.

    Raises
    ------
    MeasureError
        If there is no such measure; with the remedy.

    """
    take("parse", "text", text, str, "give the text of a measure, such as 'punch.force.y'")
    take("parse", "problem", problem, Problem, "give a Problem (case.problem of a case)")
    return _Reader(problem).read(text)


def parse_all(problem: Problem) -> dict[str, Measure]:
    """The measures that a problem names, in its order.

    Raises
    ------
    MeasureError
        With all that are wrong, one a line, each with its path: ``measures.bore: …``.

    """
    reader, found, wrong = _Reader(problem), {}, []
    for name, text in problem.measures.items():
        try:
            over = OVER_RUN.fullmatch(" ".join(text.split()))
            found[name] = replace(reader.read(over[2] if over else text), name=name, over_run=over[1] if over else "")
        except PrensaError as error:
            wrong.append(f"measures.{name}: {error}")
    if wrong:
        raise MeasureError("\n".join(wrong))
    return found


def line_of(text: str, problem: Problem) -> Outline | cuts.Cut:
    """The line that *text* names: a boundary of the plane, ``billet.right``, in space a cut through a side, ``blank.top at Z=0``.

    Raises
    ------
    MeasureError
        If there is no such line; with the remedy.

    """
    return _Reader(problem).line(" ".join(text.split()))


def field_names(problem: Problem) -> tuple[str, ...]:
    """Names of the fields of the bodies of a problem, but those of damage."""
    return tuple(name for name in _fields(problem) if not name.startswith("damage"))


def undeformed(mesh: Mesh) -> Shape:
    """The shape of a body before anything moves."""
    return Shape(mesh.points, mesh.points, mesh.points, mesh.cells, mesh.edges, mesh.corners)


def along_sides(problem: Problem, meshes: Mapping[str, Mesh]) -> Iterator[tuple[str, str]]:
    """Measures by name, of those that can be read, whose place is all of a side as long as nothing moves; and what to write.

    ``meshes`` of the bodies. Of several places the measure may choose one; such measures are not meant.
    """
    shapes = {name: undeformed(mesh) for name, mesh in meshes.items()}
    for name, text in problem.measures.items():
        reader = _Reader(problem, shapes)
        try:
            reader.read(text)
        except PrensaError:
            continue
        for place in reader.passing:
            if found := place.along(reader.shapes[place.outline.body]):
                yield name, found


def names(problem: Problem) -> Iterator[str]:
    """Names of measures of a problem, without those at places and of functions: what suggestions are made from."""
    yield from problem.measures
    yield from (name for name in columns(problem) if name not in NOT_NUMBERS)
    for tool in problem.tools:
        yield from (f"{tool}.{q}" for q in (*TOOL_QUANTITIES, *_contact_quantities()))
    for contact in problem.all_contacts:
        yield from (f"{contact.name}.{q}" for q in (*_contact_quantities(), "passages", "elements") if q != "area")
    yield from (name for body in problem.bodies for name in _names_of_body(problem, body))


def _names_of_body(problem: Problem, name: str) -> Iterator[str]:
    """The same of one body."""
    (corners, edges), d = _boundaries(problem, name), directions(problem)
    positions = SPATIAL_POSITIONS if d == 3 else POSITIONS
    yield from (f"{name}.{q}" for q in ("plastic_power", "max.plastic_power", "volume"))
    if d == 2:
        yield from (f"{name}.{q}" for q in folds.OF_FOLDS)
        yield from (f"{name}.{q}" for q in (*filling.FILL, *filling.POCKETS) if problem.tools)
    yield from (f"{name}.{p}.{q}" for p in corners for q in (*positions, *_fields(problem)))
    for outline in (name, *(f"{name}.{e}" for e in edges)):
        extremes = [f"{m}.{q}" for m in ("max", "min") for q in (*positions, *_fields(problem))]
        extremes += [f"{m}.{q}.place.{c}" for m in ("max", "min") for q in _fields(problem) for c in "xyz"[:d]]
        yield from (f"{outline}.{q}" for q in (*extremes, *EXTENTS[d]))
    yield from (f"{name}.{e}.surface_expansion" for e in edges)
    yield from (f"{name}.{e}.barrel" for e in edges if d == 2)


def _contact_quantities() -> Iterator[str]:
    yield from ("area", "length", "surface_expansion", "friction_power", "neutral.x", "neutral.y", *CONTACT_EXTREMES)
    yield from (f"count.{status}" for status in COUNTS)


def _fields(problem: Problem) -> tuple[str, ...]:
    more = {"plane stress": ("thickness",), "solid": ("stress.yz", "stress.xz")}.get(problem.space, ())
    return (*NODAL_FIELDS, *more, *damage.fields(problem))


def _boundaries(problem: Problem, body: str) -> tuple[list[str], list[str]]:
    """Points and boundaries of the mesh of a body."""
    mesh = _mesh(problem, body)
    return list(mesh.corners), list(mesh.edges)


def _mesh(problem: Problem, body: str) -> Mesh:
    description = problem.bodies[body]
    dimension = 3 if problem.space == "solid" else 2
    return mesh_of(description.mesh, problem.element_name(body), problem.units.length, dimension=dimension)


@dataclass(frozen=True)
class _Part:
    """What a measure is made of before it has its text: unit, value, slope, and its geometry if it has one.

    ``turn``: what may be added to a direction, that then is the same one; ``located``: see `Measure.located`.
    """

    unit: str
    value: Value
    slope: Slope | None = None
    body: str = ""
    geometry: Callable[[Any, Any], float] | None = None
    turn: float = math.inf
    located: Count | None = None


class _Reader:
    """Reads measures of one problem."""

    def __init__(self, problem: Problem, shapes: Mapping[str, Shape] | None = None) -> None:
        self.problem = problem
        self.columns = columns(problem)
        self.forces, self.places = force_columns(problem), place_columns(problem)
        self.solid = problem.space == "solid"
        self.positions = SPATIAL_POSITIONS if self.solid else POSITIONS
        self.shapes: dict[str, Shape] = dict(shapes or {})
        self.passing: list[Place] = []  # that material flows past and that are to be single ones, of all that was read

    def read(self, text: str) -> Measure:
        """The measure of a text."""
        written = text.strip()
        if written in self.problem.measures:
            return replace(self.read_plain(self.problem.measures[written]), name=written)
        return self.read_plain(text)

    def read_plain(self, text: str) -> Measure:
        """The measure of a text that is no name under ``measures``."""
        written = " ".join(text.split())
        if text.count("(") > DEEPEST:
            raise MeasureError(f"a measure with {text.count('(')} brackets; name one of an increment, such as 'punch.force.y'")
        part = self.part(written)
        return Measure(written, part.unit, part.value, part.slope, located=part.located)

    def part(self, text: str) -> _Part:
        """What a text is made of."""
        if text in self.columns and text not in NOT_NUMBERS:
            return self._column(text)
        if match := re.fullmatch(r"(\w+)\s*\((.*)\)", text):
            return self._function(match[1], _arguments(match[2]), text)
        for kind, names_ in (
            # Contacts first: their names begin with the name of a body.
            (self._contact, [c.name for c in self.problem.all_contacts]),
            (self._tool, list(self.problem.tools)),
            (self._body, list(self.problem.bodies)),
        ):
            owner = _longest(text, names_)
            if owner and (part := kind(owner, text[len(owner) :].removeprefix("."))):
                return part
        raise self.unknown(text)

    def unknown(self, text: str) -> MeasureError:
        """The error of a text that is no measure."""
        head, where = _at(text)
        if where:
            return self._unknown_at(head, text)
        known = list(names(self.problem))
        near = [k for k in known if k.casefold() == text.casefold()]
        near += difflib.get_close_matches(_old_order(text, self.problem) or text, known, n=1, cutoff=0.5)
        function, blank, rest = text.partition(" ")
        if blank and function in ("max", "min", *FUNCTIONS) and rest in known:
            near.insert(0, f"{function}({rest})")
        remedy = f"did you mean {near[0]!r}? {GUIDE}" if near else GUIDE
        return MeasureError(f"unknown measure {text!r}; {remedy}")

    def _unknown_at(self, head: str, text: str) -> MeasureError:
        """The error of a text with a place: what stands before the place is wrong."""
        known = []
        for body in self.problem.bodies:
            for outline in (body, *(f"{body}.{edge}" for edge in self._known(body)[1])):
                known += [f"{outline}.{q}" for q in (*self.positions, "angle", *_fields(self.problem))]
        near = difflib.get_close_matches(head, known, n=1, cutoff=0.5)
        remedy = f"did you mean '{near[0]}{text[len(head) :]}'?" if near else GUIDE
        return MeasureError(f"unknown measure {text!r}; {remedy}")

    # ------------------------------------------------------------------------------------------------- columns and tools
    def _column(self, name: str) -> _Part:
        column = self.columns[name]
        tool, _, c = name.rpartition(".")
        if tool in self.problem.tools and c in self.forces:
            return _Part(column.unit, column.value, _of_tool("forces", tool, self.forces.index(c), len(self.forces)))
        if tool in self.problem.tools and c in self.places:
            return _Part(column.unit, column.value, _of_tool("places", tool, self.places.index(c), len(self.places)))
        return _Part(column.unit, column.value)

    def _tool(self, tool: str, quantity: str) -> _Part | None:
        p = self.problem
        if p.space == "axisymmetric" and quantity in ("moment", "rotation", "force.x", "travel.x"):
            raise MeasureError(f"'{tool}.{quantity}' has no meaning about an axis; take '{tool}.force.y' or '{tool}.travel.y'")
        vectors = {"force": ("forces", "force", force_unit(p)), "travel": ("places", "place", length_unit(p))}
        if quantity == "press_utilisation":  # of a tool with a press it is a column
            raise MeasureError(f"tool {tool!r} has no press; give it one, such as 'press: 400 kN'")
        if quantity == "work":
            raise MeasureError(f"the work of {tool!r} is not counted; give it a press with an 'energy', or an 'until' with one")
        if quantity in ("die_stress", "mises"):
            raise MeasureError(
                f"tools are rigid in a run, so no stress of {tool!r} is known in it; afterwards 'prensa die DIR --tool {tool} "
                "--thickness T' computes it for any increment, in die.json and the report"
            )
        if quantity == "wear":
            return _Part(energy_unit(p), _worn(tool))
        kind, _, axis = quantity.partition(".")
        if quantity in ("moment", "rotation"):
            of, unit = (self.forces, moment_unit(p)) if quantity == "moment" else (self.places, "rad")
            return replace(self._column(f"{tool}.{of[-1]}"), unit=unit)
        if kind in ("moment", "rotation") and axis and axis in "xyz"[: len(self.places) - 3]:
            of, unit = (self.forces, moment_unit(p)) if kind == "moment" else (self.places, "rad")
            return replace(self._column(f"{tool}.{of[3 + 'xyz'.index(axis)]}"), unit=unit)
        if kind in vectors and axis and axis in "xyz"[: directions(p)]:
            return self._column(f"{tool}.{(self.forces if kind == 'force' else self.places)['xyz'.index(axis)]}")
        if kind in vectors and not axis:
            to, attribute, unit = vectors[kind]
            axes = (1,) if p.space == "axisymmetric" else tuple(range(directions(p)))
            return _Part(unit, _size(tool, attribute, axes), _size_slope(to, tool, attribute, axes, len(self.places)))
        return self._contacts([c.name for c in p.all_contacts if c.against == tool], quantity)

    # ---------------------------------------------------------------------------------------------------------- contacts
    def _contact(self, name: str, quantity: str) -> _Part | None:
        if quantity in ("passages", "elements"):
            return _Part("", contacts.passing(name, quantity))
        return self._contacts([name], quantity)

    def _contacts(self, of: list[str], quantity: str) -> _Part | None:
        """A quantity of one contact, or of all those with a tool."""
        p = self.problem
        if not of:
            return None
        head, _, tail = quantity.partition(".")
        power = f"{pressure_unit(p)} {length_unit(p)}/s"
        units = {"pressure": pressure_unit(p), "shear": pressure_unit(p), "slip": length_unit(p), "friction_power": power}
        units |= dict(zip(SLIDING_FIELDS, ("s", length_unit(p), f"{length_unit(p)}/s")))
        if quantity == "area":
            return _Part(area_unit(p), contacts.area(of))
        if self.solid and (quantity == "length" or head == "neutral"):
            raise MeasureError(words_of("lines of contact", measure=quantity))
        if quantity == "surface_expansion":
            return _Part("", contacts.expansion(of, p.space == "axisymmetric"))
        if quantity == "length":
            return _Part(length_unit(p), contacts.contact_length(of))
        if quantity == "friction_power":
            return _Part(f"{moment_unit(p)}/s", contacts.friction_power(of))
        if quantity == "min.gap":
            return _Part(length_unit(p), contacts.least_gap(of))
        if quantity in CONTACT_EXTREMES:
            average = contacts.mean_at_closed if tail in SLIDING_FIELDS else contacts.mean
            how = contacts.largest if head == "max" else average
            return _Part(units[tail], how(of, tail))
        if head == "count" and tail in COUNTS:
            return _Part("", contacts.count(of, COUNTS.index(tail)))
        if head == "neutral" and tail in ("x", "y") and len(of) == 1:
            return _Part(length_unit(p), contacts.neutral(of[0], "xy".index(tail)))
        return None

    # ------------------------------------------------------------------------------------------------------------ bodies
    def _shape(self, body: str) -> Shape:
        """The undeformed body, meshed once."""
        if body not in self.shapes:
            self.shapes[body] = undeformed(_mesh(self.problem, body))
        return self.shapes[body]

    def _known(self, body: str) -> tuple[list[str], list[str]]:
        """Points and boundaries of a body."""
        shape = self._shape(body)
        return list(shape.corners), list(shape.edges)

    def _body(self, body: str, rest: str) -> _Part | None:
        p = self.problem
        quantity, where = _at(rest)
        if quantity == "plastic_power" and not where:
            return _Part(f"{moment_unit(p)}/s", lambda i: float(np.vdot(*i.plastic_power[body])))
        if quantity == "max.plastic_power" and not where:
            return _Part(f"{pressure_unit(p)}/s", lambda i: float(i.plastic_power[body][0].max()))
        if quantity == "volume" and not where and p.space != "plane stress":
            size = bodies.volume(body, p)
            return _Part(volume_unit(p), bodies.plain(body, size), None, body, size)
        if self.solid and quantity.rpartition(".")[2] in OF_OUTLINES:
            raise MeasureError(words_of("outlines", measure=f"{body}.{rest}"))
        if self.solid and quantity.rpartition(".")[2] == "barrel":
            return self._barrel_of_cut(body, rest, quantity, where)
        if quantity in folds.OF_FOLDS and not where:
            unit, value, located = folds.measured(body, quantity)
            return _Part(unit, value, located=located)
        if quantity in (*filling.FILL, *filling.POCKETS) and not where:
            filling.refuse(p, f"{body}.{quantity}")
            unit = volume_unit(p) if quantity.endswith("volume") else ""
            return _Part(unit, filling.measured(p, body, quantity))
        owner, quantity = self._outline(body, quantity)
        if isinstance(owner, Place):
            if quantity.partition(".")[0] == "damage":
                damage.law_of(p, body, quantity)
            return self._at_place(owner, quantity, "") if not where else None
        choose, _, name = quantity.partition(".")
        if choose not in ("max", "min"):
            choose, name = "", quantity
        if name.partition(".")[0] == "damage":
            damage.law_of(p, body, name.partition(".place.")[0])
        if where:
            return self._at_place(self._place(owner, where, choose), name, choose)
        if choose:
            return self._extreme(owner, name, 1.0 if choose == "max" else -1.0)
        if (axis := EXTENTS[directions(p)].get(quantity)) is not None:
            return self._geometric(body, length_unit(p), bodies.extent(owner, axis))
        if quantity == "barrel" and owner.boundary:
            return self._geometric(body, length_unit(p), bodies.barrel(owner))
        if quantity == "surface_expansion" and owner.boundary:
            grown = bodies.expansion(owner, p.space == "axisymmetric")
            return _Part("", bodies.plain(body, grown), None, body, grown)
        if name in (*self.positions, *_fields(p), "angle"):
            at = "x=…, z=…" if self.solid else "y=…"
            other = f"'{owner}.{name} at {at}'" + (f" or '{owner}.max.{name}'" if name != "angle" else "")
            raise MeasureError(f"'{body}.{rest}' says of no place on {owner}: write {other}")
        return None

    def _barrel_of_cut(self, body: str, rest: str, quantity: str, where: Mapping[str, str]) -> _Part:
        """The barrel of a side in space, along the line in which a plane cuts it."""
        owner, name = self._outline(body, quantity)
        if name != "barrel" or isinstance(owner, Place) or not owner.boundary:
            raise MeasureError(f"'{body}.{rest}': a barrel is of a side along a cut, as in '{body}.<side>.barrel at Z=0'")
        if not where.get("axis") or "," in where["level"]:
            raise MeasureError(f"'{body}.{rest}' needs the plane of the cut: '{owner}.barrel at Z=0'")
        cut = cuts.Cut(owner, where["axis"], self._length(where["level"]), length_unit(self.problem))
        if cut.axis.isupper():
            shape = self._shape(body)
            cut.lines(shape, shape.X)
        value = cuts.barrel(cut)
        return _Part(length_unit(self.problem), bodies.plain(body, value), None, body, value)

    def _outline(self, body: str, text: str) -> tuple[Outline | Place, str]:
        """Boundary or point that a text begins with (the whole outline if none), and the rest of it."""
        corners, edges = self._known(body)
        name = _longest(text, [*corners, *edges])
        rest = text[len(name) :].removeprefix(".") if name else text
        if name in corners and name not in edges:
            return (PlaceInSpace if self.solid else Place)(Outline(body), point=name), rest
        return Outline(body, name), rest

    def _place(self, outline: Outline, where: Mapping[str, str], choose: str = "") -> Place:
        """The place of ``at x=…`` or ``near (x, y)`` on an outline; of several the one that ``choose`` says.

        A place of the undeformed body stays with the material, so it is looked for here, before anything is solved.
        """
        if self.solid:
            return self._place_in_space(outline, where, choose)
        if not where["axis"]:
            near = [self._length(text) for text in where["near"].split(",")]
            if len(near) != 2:
                raise MeasureError(f"'near ({where['near']})': a place in the plane has two coordinates")
            return Place(outline, near=tuple(near))
        if where["axis"].lower() == "z":
            raise MeasureError(f"'{outline} at {where['axis']}={where['level']}': z is an axis of 'space: solid'")
        if "," in where["level"]:
            raise MeasureError(f"'{outline} at {where['axis']}={where['level']}': one coordinate names a place on an outline")
        place = Place(outline, axis=where["axis"], level=self._length(where["level"]), unit=length_unit(self.problem))
        if where["axis"].isupper():
            shape = self._shape(outline.body)
            (place.spots if choose else place.spot)(shape, shape.X)
        elif not choose:
            self.passing.append(place)
        return place

    def _place_in_space(self, outline: Outline, where: Mapping[str, str], choose: str) -> Place:
        """The place of a body in space, by two coordinates on its sides or three in it; one is a cut, of which one is chosen."""
        unit = length_unit(self.problem)
        if not where["axis"]:
            near = tuple(self._length(text) for text in where["near"].split(","))
            if len(near) != 3:
                raise MeasureError(f"'near ({where['near']})': a place in space has three coordinates")
            return PlaceInSpace(outline, near=near, unit=unit)
        given = [part.partition("=") for part in f"{where['axis']}={where['level']}".split(",")]
        levels = tuple((axis.strip(), self._length(level)) for axis, _, level in given)
        axes = "".join(axis for axis, _ in levels)
        written = f"'{outline} at {axes[0]}={where['level']}'"
        if len({a.lower() for a in axes}) < len(axes) or not (axes.isupper() or axes.islower()):
            bodies_ = "all of the deformed (x, y, z) or of the undeformed body (X, Y, Z)"
            raise MeasureError(f"{written}: give different coordinates, {bodies_}")
        if len(levels) == 1 and not choose:
            raise MeasureError(f"{written} is a line in space: give two coordinates, or 'max.y' or 'min.y' of what lies there")
        if len(levels) == 3 and outline.boundary:
            raise MeasureError(f"{written}: three coordinates are a place in the body; leave out {outline.boundary!r}")
        place = PlaceInSpace(outline, axis=axes, unit=unit, levels=levels)
        if axes.isupper():
            shape = self._shape(outline.body)
            (place.spots if choose else place.spot)(shape, shape.X)
        return place

    def _length(self, text: str) -> float:
        units = self.problem.units
        try:
            length = factor(text.strip(), units.length, units.force, (0, 1))
            if not math.isfinite(length):
                raise ValueError("it is not finite")
            return length
        except ValueError as error:
            raise MeasureError(f"{text.strip()!r} is not a length ({error}); write a plain number or like '5 mm'") from None

    def _at_place(self, place: Place, name: str, choose: str) -> _Part | None:
        body = place.outline.body
        if name in self.positions and not (choose and not place.axis):
            geometry = bodies.coordinate(place, name[-1], displacement=name.startswith("u"), choose=choose)
            return self._geometric(body, length_unit(self.problem), geometry)
        if choose and self.solid and place.axis and name in _fields(self.problem):
            return _Part(self._field_unit(body, name), bodies.field_on_cut(place, name, 1.0 if choose == "max" else -1.0))
        if choose:
            return None
        if name == "angle" and place.axis and not self.solid:
            return self._geometric(body, "deg", bodies.inclination(place), turn=180.0)
        if name in _fields(self.problem):
            return _Part(self._field_unit(body, name), bodies.field_at(place, name))
        return None

    def _extreme(self, outline: Outline, name: str, sign: float) -> _Part | None:
        if name in self.positions:
            geometry = bodies.end(outline, name[-1], sign, displacement=name.startswith("u"))
            return self._geometric(outline.body, length_unit(self.problem), geometry)
        if name in _fields(self.problem):
            return _Part(self._field_unit(outline.body, name), bodies.field_extreme(outline, name, sign))
        field, _, axis = name.partition(".place.")
        if field in _fields(self.problem) and axis and axis in "xyz"[: directions(self.problem)]:
            return _Part(length_unit(self.problem), bodies.extreme_place(outline, field, sign, axis))
        return None

    def _field_unit(self, body: str, name: str) -> str:
        if name in ("plastic_strain", "triaxiality", "lode", "surface_expansion"):
            return ""
        if name == "strain_rate":
            return "1/s"
        if name.partition(".")[0] == "damage":
            return damage.unit_of(self.problem, damage.law_of(self.problem, body, name))
        return length_unit(self.problem) if name in ("displacement", "thickness") else pressure_unit(self.problem)

    def _geometric(self, body: str, unit: str, geometry: bodies.Geometry, turn: float = math.inf) -> _Part:
        value, slope = bodies.geometric(body, geometry)
        # in space how a place slides over its face when nodes move is not known: there are no derivatives there
        return _Part(unit, value, None if self.solid else slope, body, lambda shape, x: geometry(shape, x).value, turn)

    # --------------------------------------------------------------------------------------------------------- functions
    def _function(self, name: str, given: list[str], text: str) -> _Part:
        if OVER_RUN.fullmatch(text):
            raise MeasureError(
                f"{text!r} is over a run, of which an increment knows nothing: name it under 'measures', and the run's tables "
                f"have it, or take the {name}imum of {', '.join(given)!r} over the increments yourself"
            )
        if name not in FUNCTIONS:
            near = difflib.get_close_matches(name, [*FUNCTIONS, "max", "min"], n=1)
            known = f"known: {', '.join(FUNCTIONS)}, and over a run, under 'measures', max and min"
            remedy = f"did you mean {near[0]!r}?" if near else known
            raise MeasureError(f"unknown function {name!r} in {text!r}; {remedy}")
        wanted = 1 if name in ("change", "mean", "ripple") else 2
        if len(given) != wanted:
            raise MeasureError(f"{name} takes {wanted} argument{'s' * (wanted > 1)}, {text!r} has {len(given)}; {GUIDE}")
        if name == "change":
            return self._change(given[0])
        if name in ("mean", "ripple"):
            return self._passage_mean(name, given[0])
        unit = length_unit(self.problem)
        if (of_sheet := bodies.OF_SHEETS.get(name)) is not None:
            a, b = self._outline_or_place(given[0]), self._outline_or_place(given[1])
            if isinstance(b, Place) or a == b or _body_of(a) != b.body:
                raise MeasureError(f"{text!r}: {name} is from a boundary, or a place on one, to the boundary opposite")
            shape = of_sheet(a, b)
            return _Part(unit if name in ("thickness", "thickest") else "", bodies.plain(b.body, shape), None, b.body, shape)
        return self._of_two_places(name, given, text)

    def _of_two_places(self, name: str, given: list[str], text: str) -> _Part:
        unit = length_unit(self.problem)
        a, b = (self._outline_or_place(g) for g in given)
        if isinstance(a, Outline) or isinstance(b, Outline) or _body_of(a) != _body_of(b):
            raise MeasureError(f"{text!r}: {name} is of two places of a body, such as 'sheet.top at X=10' or 'sheet.top-left'")
        body = a.outline.body
        if self.solid and name != "distance":
            return self._of_two_places_on_a_cut(name, a, b, text)
        if name in ("distance", "angle"):
            if name == "angle":
                return self._geometric(body, "deg", bodies.angle(a, b), turn=360.0)
            return self._geometric(body, unit, bodies.distance(a, b))
        if a.outline != b.outline or not (a.axis and b.axis and a.outline.boundary):
            raise MeasureError(f"{text!r}: {name} is of a boundary between two places on it, such as 'sheet.top at X=10'")
        return self._bent(name, a.outline, bodies.curvature(a, b))

    def _of_two_places_on_a_cut(self, name: str, a: Place, b: Place, text: str) -> _Part:
        """Direction, curvature or radius between two places in space, in the plane of the coordinate that they share."""
        levels: list[set[tuple[str, float]]] = [set(getattr(p, "levels", ())) for p in (a, b)]
        shared = sorted(levels[0] & levels[1])
        if len(shared) != 1 or a.outline != b.outline or not a.outline.boundary or len(levels[0]) != 2:
            example = "'sheet.top at X=2, Z=0' and 'sheet.top at X=8, Z=0'"
            raise MeasureError(f"{text!r}: in space {name} is of two places on a side that share a coordinate, such as {example}")
        ((axis, level),) = shared
        cut = cuts.Cut(a.outline, axis, level, length_unit(self.problem))
        if name != "angle":
            return self._bent(name, a.outline, cuts.curvature(cut, a, b))
        turn = cuts.angle(cut, a, b)
        return _Part("deg", bodies.plain(a.outline.body, turn), None, a.outline.body, turn, 360.0)

    def _bent(self, name: str, outline: Outline, bend: bodies.Plain) -> _Part:
        """A curvature, or its radius."""
        unit, body = length_unit(self.problem), outline.body
        if name == "curvature":
            return _Part(f"1/{unit}", bodies.plain(body, bend), None, body, bend)

        def radius(shape: Any, x: Any) -> float:
            value = bend(shape, x)
            if value == 0.0:
                raise MeasureError(f"{outline} is straight there; measure the curvature")
            return 1.0 / abs(value)

        return _Part(unit, bodies.plain(body, radius), None, body, radius)

    def _change(self, text: str) -> _Part:
        part = self.part(text)
        if part.geometry is None:
            raise MeasureError(f"change is of geometry, places, angles and the like; {text!r} is none")
        return _Part(part.unit, bodies.change(part.body, part.geometry, part.turn), None)

    def _passage_mean(self, name: str, text: str) -> _Part:
        known = {c for c in self.columns if c not in NOT_NUMBERS} | {f"{c.name}.pressure" for c in self.problem.all_contacts}
        if text not in known:
            near = difflib.get_close_matches(text, known, n=1)
            remedy = f"did you mean {near[0]!r}?" if near else "write it like 'die.fx'"
            raise MeasureError(f"{name} is of a column of history.csv or of '<contact>.pressure', not {text!r}; {remedy}")
        unit = self.columns[text].unit if text in self.columns else pressure_unit(self.problem)

        def value(increment: Increment) -> float:
            if text not in increment.means:
                raise MeasureError("no element has passed yet in this step")
            return float(getattr(increment.means[text], name))

        return _Part(unit, value)

    def line(self, text: str) -> Outline | cuts.Cut:
        """The line of a text; see `line_of`."""
        head, where = _at(text)
        found = self._outline_or_place(head)
        if isinstance(found, Place) or (not self.solid and where):
            raise MeasureError(f"{text!r}: name a boundary of a body, such as 'billet.right'")
        if not self.solid:
            return found
        if not where.get("axis") or "," in where["level"]:
            raise MeasureError(f"{text!r}: in space a line is a side and the plane that cuts it, such as '{found} at Z=0'")
        return cuts.Cut(found, where["axis"], self._length(where["level"]), length_unit(self.problem))

    def _outline_or_place(self, text: str) -> Outline | Place:
        head, where = _at(text)
        body = _longest(head, list(self.problem.bodies))
        if not body:
            known = [*self.problem.bodies]
            raise MeasureError(f"{text!r} is not a place; begin with a body ({', '.join(known)}), as in '{known[0]}.top at x=5'")
        found, rest = self._outline(body, head[len(body) :].removeprefix("."))
        if rest:
            corners, edges = self._known(body)
            near = difflib.get_close_matches(rest, [*edges, *corners], n=1)
            remedy = f"did you mean {near[0]!r}?" if near else f"it has {', '.join(map(repr, [*edges, *corners]))}"
            raise MeasureError(f"body {body!r} has no boundary or point {rest!r}; {remedy}")
        if where and isinstance(found, Outline):
            return self._place(found, where)
        if where:
            raise MeasureError(f"{text!r}: a point is a place already; leave out what follows it")
        return found


# ------------------------------------------------------------------------------------------------------------- details
_WRITTEN = r"[^=,()]+?"
_AXIS = "[xyzXYZ]"
_AT_LEVEL = re.compile(rf"(?P<head>.*?)\s+at\s+(?P<axis>{_AXIS})\s*=\s*(?P<level>{_WRITTEN}(?:,\s*{_AXIS}\s*=\s*{_WRITTEN})*)")
_NEAR_POINT = re.compile(r"(?P<head>.*?)\s+near\s*\((?P<near>[^=()]+,[^=()]+)\)")


def _at(text: str) -> tuple[str, dict[str, str]]:
    """What stands before ``at x=…``, in space ``at x=…, z=…``, or ``near (x, y)``, and these."""
    if match := _AT_LEVEL.fullmatch(text):
        return match["head"], {"axis": match["axis"], "level": match["level"]}
    if match := _NEAR_POINT.fullmatch(text):
        return match["head"], {"axis": "", "near": match["near"]}
    return text, {}


def _arguments(text: str) -> list[str]:
    """Arguments between commas that stand in no bracket of their own, and not before a further coordinate of a place."""
    parts, depth = [""], 0
    for c in text:
        depth += (c == "(") - (c == ")")
        if c == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += c
    joined = parts[:1]
    for part in parts[1:]:
        if re.match(rf"\s*{_AXIS}\s*=", part):
            joined[-1] += f",{part}"
        else:
            joined.append(part)
    return [p.strip() for p in joined]


def _longest(text: str, known: list[str]) -> str:
    """The longest known name that is the text or that it begins with, before a dot; '' if none."""
    found = [k for k in known if text == k or text.startswith(f"{k}.")]
    return max(found, key=len, default="")


def _body_of(part: Outline | Place) -> str:
    return part.outline.body if isinstance(part, Place) else part.body


def _old_order(text: str, problem: Problem) -> str:
    """``force.punch.y`` as it would be written here, ``punch.force.y``; '' for other texts."""
    owners = [*(c.name for c in problem.all_contacts), *problem.tools, *problem.bodies]
    for owner in sorted(owners, key=len, reverse=True):
        for middle in (f".{owner}.", f".{owner}"):
            head, found, tail = text.partition(middle)
            if found and head and (tail or middle[-1] != "."):
                head = head.replace("place", "travel")
                return f"{owner}.{head}" + (f".{tail}" if tail else "")
    return ""


def _gradient(kind: str, tool: str, slopes: Any) -> Gradient:
    return Gradient(forces={tool: slopes}) if kind == "forces" else Gradient(places={tool: slopes})


def _of_tool(kind: str, tool: str, k: int, motions: int) -> Slope:
    return lambda increment: _gradient(kind, tool, np.eye(motions)[k])


def _worn(tool: str) -> Value:
    def value(increment: Increment) -> float:
        wear = increment.wear_of(tool)
        if math.isnan(wear):
            raise MeasureError(f"the wear of {tool!r} is not known of this increment; increments that solve yields know it")
        return wear

    return value


def _size(tool: str, attribute: str, axes: tuple[int, ...]) -> Value:
    return lambda increment: math.hypot(*(getattr(increment.tools[tool], attribute)[k] for k in axes))


def _size_slope(kind: str, tool: str, attribute: str, axes: tuple[int, ...], motions: int) -> Slope:
    def slope(increment: Increment) -> Gradient:
        vector = np.zeros(motions)
        vector[list(axes)] = [getattr(increment.tools[tool], attribute)[k] for k in axes]
        size = float(np.linalg.norm(vector))
        if size == 0.0:
            raise MeasureError("it is zero, where its size has no derivative; take a component")
        return _gradient(kind, tool, vector / size)

    return slope
