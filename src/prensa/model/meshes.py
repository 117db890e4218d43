"""Meshes of bodies as they are described: generated shapes, outlines, points and files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator

from prensa.model.fields import Fillets, as_names, described
from prensa.model.units import Angle, Length, LengthUnit, Number, Whole
from prensa.precision import NEGLIGIBLE

MOST_ELEMENTS = 5_000_000  # of a body: some thirty gigabytes, refused before the memory is asked for


def _bounded(count: float) -> None:
    if count > MOST_ELEMENTS:
        raise ValueError(
            f"{float(min(count, 1e300)):.3g} elements; a body has {MOST_ELEMENTS:,} at most".replace(",", " ") + "; take fewer"
        )


def _affordable(n: tuple[int, int]) -> tuple[int, int]:
    _bounded(n[0] * n[1])
    return n


Counts: TypeAlias = Annotated[
    tuple[Annotated[Whole, Field(ge=1)], Annotated[Whole, Field(ge=1)]], AfterValidator(_affordable)
]


@described
class Grade:
    """Where the elements of a rectangle are small.

    ``x`` and ``y`` list the coordinates towards which elements shrink (each becomes a mesh line);
    ``x_between`` and ``y_between`` are stretches along which all elements have the smallest size (both ends become mesh lines):
    what will slide past a tool, which is the contact and the travel. ``ratio`` is the size of the largest element over that of
    the smallest, per direction.
    """

    x: tuple[Length, ...] = ()
    y: tuple[Length, ...] = ()
    x_between: tuple[Length, Length] | None = None
    y_between: tuple[Length, Length] | None = None
    ratio: Annotated[Number, Field(ge=1)] = 8.0

    @model_validator(mode="after")
    def _check(self) -> Grade:
        for key in ("x_between", "y_between"):
            stretch = getattr(self, key)
            if stretch is not None and not stretch[0] < stretch[1]:
                raise ValueError(f"'{key}' must rise, got {stretch[0]:g} … {stretch[1]:g}: write it from its lower end")
        return self


GradeName = Literal["left", "right", "top", "bottom", "top-left", "top-right", "bottom-left", "bottom-right"]


def _grade_kind(value: Any) -> str:
    return "name" if isinstance(value, str) else "grade"


GradeValue = Annotated[
    Annotated[GradeName, Tag("name")] | Annotated[Grade, Tag("grade")],
    Discriminator(_grade_kind),
]


@described
class Rectangle:
    """Structured rectangle of 4-node quadrilaterals.

    ``size`` (width, height) and ``origin`` (lower left corner) are lengths, ``n`` the number of elements along x and y.
    ``grade`` names an edge or a corner to refine towards, or is a `Grade`.
    Boundaries: ``bottom``, ``right``, ``top``, ``left``; points: ``bottom-left`` and the other three corners.
    """

    size: tuple[Annotated[Length, Field(gt=0)], Annotated[Length, Field(gt=0)]]
    n: Counts
    origin: tuple[Length, Length] = (0.0, 0.0)
    grade: GradeValue | None = None
    type: Literal["rectangle"] = "rectangle"


@described
class Nose:
    """Tapered end of a strip or wire: its ``length``, and the ``thickness`` (diameter of a wire) of its front face."""

    length: Annotated[Length, Field(gt=0)]
    thickness: Annotated[Length, Field(gt=0)]


def _tapers(length: float, thickness: float, nose: Nose | None) -> None:
    if nose is not None and not nose.length < length:
        raise ValueError(f"the nose is {nose.length:g} long, but the whole mesh is {length:g}; make the nose shorter")
    if nose is not None and not nose.thickness < thickness:
        raise ValueError(f"the front face, {nose.thickness:g}, is not thinner than the rest, {thickness:g}; leave the nose out")


@described
class Strip:
    """A strip along x, to be fed to rolls or a die: ``length`` and ``thickness``, ``n`` elements along and across.

    Its front looks ``toward`` the ``right`` or ``left``, tapered where it has a ``nose``; ``front``: the middle of the front
    face. ``half``: only what lies above its middle line. Boundaries and points as in a `Rectangle`.
    """

    length: Annotated[Length, Field(gt=0)]
    thickness: Annotated[Length, Field(gt=0)]
    n: Counts
    nose: Nose | None = None
    front: tuple[Length, Length] = (0.0, 0.0)
    toward: Literal["right", "left"] = "right"
    half: bool = False
    type: Literal["strip"] = "strip"

    @model_validator(mode="after")
    def _check(self) -> Strip:
        _tapers(self.length, self.thickness, self.nose)
        if self.nose is not None and self.n[0] < 2:
            raise ValueError("a strip with a nose needs two elements along it at least")
        return self


@described
class Wire:
    """A wire (or bar) along the axis of an axisymmetric problem, to be drawn or extruded through a die.

    ``length`` and ``diameter``, ``n`` elements along and across the radius. Its front looks ``toward`` the ``top`` or
    ``bottom``, tapered where it has a ``nose``; ``front``: height of the front face. Boundaries and points as in a `Rectangle`:
    ``left`` is the axis, ``right`` the skin.
    """

    length: Annotated[Length, Field(gt=0)]
    diameter: Annotated[Length, Field(gt=0)]
    n: Counts
    nose: Nose | None = None
    front: Length = 0.0
    toward: Literal["top", "bottom"] = "top"
    type: Literal["wire"] = "wire"

    @model_validator(mode="after")
    def _check(self) -> Wire:
        _tapers(self.length, self.diameter, self.nose)
        if self.nose is not None and self.n[0] < 2:
            raise ValueError("a wire with a nose needs two elements along it at least")
        return self


@described
class Points:
    """Mesh given by its arrays: ``points`` (n, 2), ``cells`` (m, 3|4|6|8), ``boundaries`` name → node list.

    Cells list their corners counter-clockwise, then the mid-side nodes if they have any; all are of one kind. The body's
    ``element`` decides what is made of them: mid-side nodes are added or dropped, quadrilaterals split into triangles.
    A boundary is the set of element edges both ends of which are in the list.
    """

    points: tuple[tuple[Length, Length], ...]
    cells: tuple[tuple[int, ...], ...]
    boundaries: Mapping[str, tuple[int, ...]]
    type: Literal["points"] = "points"

    @model_validator(mode="after")
    def _check(self) -> Points:
        kinds = {len(c) for c in self.cells}
        if len(kinds) != 1 or not kinds <= {3, 4, 6, 8}:
            e = next((i for i, c in enumerate(self.cells) if len(c) not in (3, 4, 6, 8)), None)
            if e is not None:
                raise ValueError(f"cell {e} has {len(self.cells[e])} nodes; cells have 3, 4, 6 or 8")
            raise ValueError(
                "cells must all have the same number of nodes (3, 4, 6 or 8); make two bodies and tie them"
            )
        return self


@described
class Disc:
    """Disc of quadrilaterals, or a part of it: ``full``, a half (``right``, …) or a quarter (``top-right``, …).

    ``n``: elements along a quarter of the rim (even), and layers between the core (half the radius) and the rim, which
    shrink towards the rim in the ratio ``ratio`` (largest over smallest). In axisymmetry ``right`` and its quarters are
    sections of a sphere. Boundaries: ``rim``, and the sides of a part by the side on which they close it (a half ``right``
    has ``left``); points: ``centre``, ``rim-right``, ``rim-top``, ``rim-left``, ``rim-bottom``.
    """

    radius: Annotated[Length, Field(gt=0)]
    n: tuple[Annotated[Whole, Field(ge=2)], Annotated[Whole, Field(ge=1)]]
    centre: tuple[Length, Length] = (0.0, 0.0)
    part: Literal["full", "left", "right", "top", "bottom", "top-left", "top-right", "bottom-left", "bottom-right"] = (
        "full"
    )
    ratio: Annotated[Number, Field(ge=1)] = 1.0
    type: Literal["disc"] = "disc"

    @model_validator(mode="after")
    def _check(self) -> Disc:
        # The layers round the core meet its squares: half of the elements of a quarter belong to each of two sides of the core.
        if self.n[0] % 2:
            raise ValueError(f"the number of elements along a quarter of the rim must be even, not {self.n[0]}")
        _bounded(4 * self.n[0] * self.n[1] + self.n[0] ** 2)  # layers around a core of squares
        return self


@described
class Annulus:
    """Ring of quadrilaterals between two radii, or the sector of it from one angle to another.

    About ``centre``, between ``inner`` and ``outer`` and the two ``angles`` (default: all round). ``n``: elements round the
    sector and through the thickness, which shrink towards ``grade`` in the ratio ``ratio``. Boundaries: ``inner``, ``outer``,
    and of a sector ``start`` and ``end``; points: ``inner-start``, ``outer-start`` and, of a sector, ``inner-end``,
    ``outer-end``.
    """

    inner: Annotated[Length, Field(gt=0)]
    outer: Annotated[Length, Field(gt=0)]
    n: Counts
    centre: tuple[Length, Length] = (0.0, 0.0)
    angles: tuple[Angle, Angle] = (0.0, math.tau)
    grade: Literal["inner", "outer"] | None = None
    ratio: Annotated[Number, Field(ge=1)] = 8.0
    type: Literal["annulus"] = "annulus"

    @model_validator(mode="after")
    def _check(self) -> Annulus:
        if self.outer <= self.inner:
            raise ValueError(f"outer radius {self.outer:g} must exceed inner radius {self.inner:g}")
        sweep = self.angles[1] - self.angles[0]
        if not 0.0 < sweep <= math.tau * (1 + NEGLIGIBLE):
            raise ValueError(
                "'angles' must increase by at most a whole turn (numbers are radians; '90 deg' is converted)"
            )
        # Chords of half a turn pass through the centre or beyond it: the elements would be inverted.
        if sweep / self.n[0] >= math.pi:
            raise ValueError("too few elements round: an element must span less than half a turn")
        return self


@described
class ArcSide:
    """A side of a `Patch` that is an arc between its corners, through the point ``through`` or about ``centre``.

    About a centre it is the shorter arc.
    """

    through: tuple[Length, Length] | None = None
    centre: tuple[Length, Length] | None = None
    type: Literal["arc"] = "arc"

    @model_validator(mode="after")
    def _check(self) -> ArcSide:
        if (self.through is None) == (self.centre is None):
            raise ValueError("give either 'through' or 'centre'")
        return self


@described
class SplineSide:
    """A side of a `Patch` that is a cubic spline from corner to corner through ``points``, in the direction of the side.

    Bottom and top go from left to right, left and right from bottom to top.
    """

    points: Annotated[tuple[tuple[Length, Length], ...], Field(min_length=1)]
    type: Literal["spline"] = "spline"


Side = Annotated[ArcSide | SplineSide, Field(discriminator="type")]


@described
class Patch:
    """Region of quadrilaterals between four sides, straight or curved, by transfinite interpolation (Gordon & Hall 1973).

    ``corners``: bottom-left, bottom-right, top-right, top-left, counter-clockwise; ``n``: elements along bottom and left;
    ``sides``: the curved ones by name. ``grade`` names a side or a corner to refine towards in the ratio ``ratio``.
    Boundaries and points as those of a `Rectangle`.
    """

    corners: tuple[tuple[Length, Length], tuple[Length, Length], tuple[Length, Length], tuple[Length, Length]]
    n: Counts
    sides: Mapping[str, Side] = field(default_factory=dict)
    grade: GradeName | None = None
    ratio: Annotated[Number, Field(ge=1)] = 8.0
    type: Literal["patch"] = "patch"

    @model_validator(mode="after")
    def _check(self) -> Patch:
        for name in self.sides:
            if name not in ("bottom", "right", "top", "left"):
                raise ValueError(f"unknown side {name!r}; a patch has 'bottom', 'right', 'top' and 'left'")
        return self


Ring = Annotated[tuple[tuple[Length, Length], ...], Field(min_length=3)]


@described
class Outline:
    """Triangles within a closed outline, straight from point to point: a billet of any shape.

    ``size``: of the elements, smaller at fillets; ``fillet``: radius of all corners, or a list with one for each point;
    ``sides``: names of the boundaries, one for each side from its point to the next (they may repeat; a fillet belongs to the
    side after it; without: ``outline``); ``holes``: lists of points, whose boundaries are ``hole-1``, ``hole-2`` …
    Made by MMG (``pip install prensa[remesh]``).
    """

    points: Ring
    size: Annotated[Length, Field(gt=0)]
    fillet: Fillets = 0.0
    sides: tuple[str, ...] = ()
    holes: tuple[Ring, ...] = ()
    type: Literal["outline"] = "outline"

    @model_validator(mode="after")
    def _check(self) -> Outline:
        if self.sides and len(self.sides) != len(self.points):
            raise ValueError(f"{len(self.sides)} names in 'sides' for {len(self.points)} sides; give one for each point")
        (x, y), (u, v) = zip(*self.points), zip(*(*self.points[1:], self.points[0]))
        # Twice the area by the shoelace formula: an equilateral triangle of side h covers 0.43 h², so this is near the number
        # of triangles.
        _bounded(abs(sum(a * d - b * c for a, b, c, d in zip(x, y, u, v))) / self.size / self.size)  # its square may be 0
        return self


def _mesh_file(path: Any, info: Any) -> Any:
    from prensa.model.tables import found_file

    return found_file(path, info.context, "mesh file") if isinstance(path, str) else path


@described
class File:
    """Mesh of a file: gmsh's ``.msh`` (text, 2.2 or 4.1), an Abaqus deck ``.inp``, VTK's ``.vtk`` or ``.vtu``.

    ``path`` is relative to the case file. In space it is made of hexahedra and wedges, or of tetrahedra of ten nodes.

    Boundaries are the physical curves (in space surfaces), node sets, surfaces and sets of line elements (of shells) of the file,
    on the outline of the body; points are physical points and sets of one node. A file without physical curves has gmsh's by
    number (``curve-3``, ``point-1``, in space ``surface-3``); ``bottom``, ``right``, ``top``, ``left`` and in space ``back`` and
    ``front`` are found by place where the file has none of these names; where another part meets this one in the plane is
    ``interface-PART`` if it has no other name. ``part`` names the physical surfaces (or ``surface-1``, by number; in space
    volumes, ``volume-1``), element sets or parts that make the body (default: all). ``unit`` is the file's unit of length
    (default: that of the case). ``merge`` joins nodes at one place. ``digest`` is filled in by the program: a run is resumed
    only with the mesh that it began with.
    """

    path: Annotated[str, BeforeValidator(_mesh_file)]
    part: Annotated[tuple[str, ...], BeforeValidator(as_names)] = ()
    unit: LengthUnit | None = None
    merge: bool = False
    digest: str | None = None
    type: Literal["file"] = "file"

    @model_validator(mode="after")
    def _check(self) -> File:
        from prensa.model.tables import digest_of

        if not self.path.lower().endswith((".msh", ".inp", ".vtk", ".vtu")):
            file = Path(self.path)
            if file.suffix.lower() in (".step", ".stp"):
                fill = f"prensa import {self.path} --size 4 --out {file.stem}.msh"
                raise ValueError(f"{self.path!r} is a STEP file: fill its solid with elements, {fill}, and name those")
            if file.suffix.lower() == ".stl":
                words = "is an STL file, a surface: for tools (type: stl); a body needs elements of its volume, or a STEP file"
                raise ValueError(f"{self.path!r} {words}")
            if file.suffix.lower() == ".unv":  # meshio has no reader of it
                convert = f"gmsh {file.name} -save -format msh22 -o {file.stem}.msh"
                raise ValueError(f"{self.path!r}: UNV is not read; gmsh converts it: {convert}")
            raise ValueError(
                f"{self.path!r}: gmsh's .msh, Abaqus's .inp and VTK's .vtk and .vtu are read; export the mesh as one of them, or "
                f"convert it: meshio convert --ascii --output-format gmsh {file.name} {file.stem}.msh"
            )
        # A restart or a report reads the mesh again: a file that was changed in between would go unnoticed beside old results.
        digest = digest_of(self.path)
        if self.digest not in (None, digest):
            raise ValueError(f"mesh file {self.path!r} has changed since this case was written; run the case again")
        object.__setattr__(self, "digest", digest)
        return self


@described
class Box:
    """Structured box of bricks, in space: ``size``, ``origin`` (least corner) and ``n`` elements along x, y and z.

    ``toward``: a place in it towards which elements shrink, in the ratio ``ratio`` (largest over smallest size along an axis).
    Boundaries: ``left`` and ``right`` across x, ``bottom`` and ``top`` across y, ``back`` and ``front`` across z.
    """

    size: tuple[Annotated[Length, Field(gt=0)], Annotated[Length, Field(gt=0)], Annotated[Length, Field(gt=0)]]
    n: tuple[Annotated[Whole, Field(ge=1)], Annotated[Whole, Field(ge=1)], Annotated[Whole, Field(ge=1)]]
    origin: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)
    toward: tuple[Length, Length, Length] | None = None
    ratio: Annotated[Number, Field(ge=1)] = 8.0
    type: Literal["box"] = "box"

    @model_validator(mode="after")
    def _check(self) -> Box:
        _bounded(math.prod(self.n))
        return self


@described
class Bricks:
    """Mesh in space given by its arrays: ``points`` (n, 3), ``cells`` (m, 8), ``boundaries`` name → node list.

    Cells list their nodes counter-clockwise seen from above, the lower four first. A boundary is the set of element faces on
    the outside whose four nodes are in the list; a list of one node is a point.
    """

    points: tuple[tuple[Length, Length, Length], ...]
    cells: tuple[tuple[int, int, int, int, int, int, int, int], ...]
    boundaries: Mapping[str, tuple[int, ...]]
    type: Literal["bricks"] = "bricks"


@described
class Tetrahedra:
    """Mesh in space of quadratic tetrahedra by its arrays: ``points`` (n, 3), ``cells`` (m, 10), ``boundaries`` name → node list.

    Cells list their corners, the fourth above the triangle of the first three seen counter-clockwise, then the nodes in the
    middle of 1-2, 2-3, 3-1, 1-4, 2-4, 3-4. A boundary is the set of element faces on the outside whose corners are in the list.
    """

    points: tuple[tuple[Length, Length, Length], ...]
    cells: tuple[tuple[int, int, int, int, int, int, int, int, int, int], ...]
    boundaries: Mapping[str, tuple[int, ...]]
    type: Literal["tetrahedra"] = "tetrahedra"


Section = Annotated[
    Rectangle | Strip | Wire | Disc | Annulus | Patch | Outline | Points | File, Field(discriminator="type")
]
"""Meshes of the plane, of quadrilaterals where they are sections of bodies in space."""


def _elements_of(section: object) -> int:
    """Elements of a section that counts them along two directions, which a disc has four times and more; 1 of others."""
    n = getattr(section, "n", None)
    return math.prod(n) if isinstance(n, tuple) else 1


@described
class Extrusion:
    """Bricks over a ``section`` of the plane, ``n`` layers of them over a ``length`` along ``axis``, from ``start`` on.

    The section keeps its y where the axis is x or z, and its x where that is y: a disc along y has its x and z. Boundaries: those
    of the section, ``base`` where the axis begins and ``cap`` where it ends. Layers shrink towards ``grade`` in the ratio
    ``ratio`` (largest over smallest).
    """

    section: Section
    length: Annotated[Length, Field(gt=0)]
    n: Annotated[Whole, Field(ge=1)]
    axis: Literal["x", "y", "z"] = "z"
    start: Length = 0.0
    grade: Literal["base", "cap"] | None = None
    ratio: Annotated[Number, Field(ge=1)] = 8.0
    type: Literal["extruded"] = "extruded"

    @model_validator(mode="after")
    def _check(self) -> Extrusion:
        _bounded(self.n * _elements_of(self.section))
        return self


def _turns(angle: float, n: int) -> None:
    # Chords of half a turn pass through the axis or beyond it: the bricks would be inverted.
    if angle / n >= math.pi * (1 - NEGLIGIBLE):
        raise ValueError(f"too few elements around: {n} of them over {math.degrees(angle):g}° span half a turn or more each")


def pieces_around(angle: float) -> int:
    """Pieces of a square core around the axis, of about a quarter turn each; none below an eighth of a turn."""
    return round(angle / (0.5 * math.pi))


Turn = Annotated[Angle, Field(gt=0, le=math.tau * (1 + NEGLIGIBLE))]
Core = Literal["square", "wedges"]


@described
class Revolution:
    """Bricks over a ``section`` drawn as in axisymmetry, x the radius and y the axis, ``n`` of them around the ``angle``.

    From the direction x towards z, at most a whole turn. Where the section touches the axis, ``core`` says what its bricks are:
    ``wedges``, or ``square`` in place of its columns next to the axis, half as many as there are elements in a quarter turn
    (default: ``square`` where the angle is an eighth of a turn or more, ``n`` is even in each quarter and the section has one
    column more than that; else ``wedges``). Boundaries: those of the section, and of a sector ``base`` at z = 0 and ``cap`` where
    it ends; points: those of the section on the axis.
    """

    section: Section
    n: Annotated[Whole, Field(ge=1)]
    angle: Turn = math.tau
    core: Core | None = None
    type: Literal["revolved"] = "revolved"

    @model_validator(mode="after")
    def _check(self) -> Revolution:
        _turns(self.angle, self.n)
        _bounded(self.n * _elements_of(self.section))
        return self


@described
class Cylinder:
    """Cylinder about the y axis, or a ring where it has a ``bore``, the radius of its hole: a revolved rectangle.

    ``n``: elements along the radius, the height and around the ``angle`` (from the direction x towards z, at most a whole turn);
    ``start``: height of its lower face; ``core``: bricks at the axis, as of `Revolution`. Boundaries: ``bottom``, ``top``,
    ``outer``, with a bore ``inner``, and of a sector ``base`` at z = 0 and ``cap`` where it ends; points of a solid one:
    ``bottom-centre``, ``top-centre``.
    """

    radius: Annotated[Length, Field(gt=0)]
    height: Annotated[Length, Field(gt=0)]
    n: tuple[Annotated[Whole, Field(ge=1)], Annotated[Whole, Field(ge=1)], Annotated[Whole, Field(ge=1)]]
    bore: Annotated[Length, Field(ge=0)] = 0.0
    start: Length = 0.0
    angle: Turn = math.tau
    core: Core | None = None
    type: Literal["cylinder"] = "cylinder"

    @model_validator(mode="after")
    def _check(self) -> Cylinder:
        if self.bore >= self.radius:
            raise ValueError(f"the bore, {self.bore:g}, is no smaller than the radius, {self.radius:g}; both are radii")
        _turns(self.angle, self.n[2])
        _bounded(math.prod(self.n))
        return self


Mesh = Annotated[
    Rectangle | Strip | Wire | Disc | Annulus | Patch | Outline | Points | File
    | Box | Cylinder | Bricks | Tetrahedra | Extrusion | Revolution,
    Field(discriminator="type"),
]
