"""From the description to arrays: meshes, placed tools, contact candidates, degrees of freedom, sparsity pattern."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from prensa.contact.cut import may_cut, with_neighbours
from prensa.contact.faces import face_points
from prensa.contact.integration import Points, depth_of, points_of
from prensa.contact.rules.nodal import Nodal
from prensa.contact.surface import Opposite, Surface
from prensa.contact.weighted import FacingSides
from prensa.elements.element import Mode, element_of
from prensa.errors import PrensaError, take
from prensa.layout import DofMap
from prensa.materials.material import material_of
from prensa.materials.protocol import Material as Law
from prensa.mesh.bricks import BrickMesh
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import Mesh, MeshError, ordered_nodes
from prensa.mesh.thin import thin_way_up
from prensa.model import problem as model
from prensa.model.crank import AXIS
from prensa.registry import DOORS
from prensa.system.assembly import Block, Pattern, Slots, make_pattern, slots_of
from prensa.system.bodies import Bodies, Meshed
from prensa.system.contact_surfaces import contact_edges, named_edges
from prensa.system.control import couplings, factor_field
from prensa.system.element_choice import with_chosen_elements
from prensa.system.interaction import Interaction
from prensa.system.interference import TIE_SHARES, shares_field
from prensa.system.interference import couplings as share_couplings
from prensa.system.mesh_state import Remeshed
from prensa.system.start import earlier_run
from prensa.system.state import State
from prensa.system.system import System
from prensa.system.ties import held_components, make_ties
from prensa.tools.place import PlacedTool, ToolError, place
from prensa.tools.tool import ToolShape
from prensa.types import Array, Index

ROUNDING = 0.25  # fillet over element depth of corners that are not given one: a sharp one has no normal to slide on


@dataclass(frozen=True)
class Extension:
    """More than the description says: a ``field`` at the nodes (name and components), and interactions, made of its mesh.

    ``interactions``: from the map of degrees of freedom, the nodes' positions X (n, d) and the bodies' cells.
    """

    field: str
    components: tuple[str, ...]
    interactions: Callable[[DofMap, Array, dict[str, Index]], Sequence[Interaction]]


def discretise(problem: model.Problem, extensions: Sequence[Extension] = (), beside: System | None = None) -> System:
    """Arrays of a problem: meshes, placed tools, contact candidates, sparsity pattern.

    ``extensions``: further fields at the nodes, with what acts on them. ``beside``: a system of the same problem with other
    numbers next to these; where elements and contact points join the same nodes in it, its pattern is taken over, and meshes
    are not checked once more.

    Raises
    ------
    PrensaError
        For a boundary that does not exist, a mesh that cannot be computed on, a tool that cannot be placed.

    """
    take("discretise", "problem", problem, model.Problem, "give a Problem (case.problem of a case)")
    take("discretise", "extensions", extensions, Sequence, "give a list of Extension")
    for extension in extensions:
        take("discretise", "an extension", extension, Extension, "give a list of Extension")
    meshes = meshes_of(problem, {} if beside is None else beside.meshes)
    problem = problem.with_elements(_of_files(problem, meshes))
    offsets, total = _numbered(meshes)
    X = np.concatenate([m.points for m in meshes.values()])
    ties, X = make_ties(problem, meshes, offsets, X, held_components(problem, meshes, offsets, X))
    bodies = Meshed(problem, meshes, offsets, X, DofMap(X.shape[1], total), ties)
    candidates = [_candidates(bodies, contact) for contact in problem.all_contacts]
    dofs = _dofs(problem, candidates, total, extensions)
    if ties is not None and ties.jump is not None:
        ties = replace(ties, shares=dofs.fields[TIE_SHARES].slice)
    surfaces = _surfaces(problem, candidates, meshes, offsets, X, dofs)
    earlier = earlier_run(problem, problem.start, meshes, of_state) if problem.start is not None else None
    shapes = meshes if earlier is None else earlier.shapes(meshes)
    tools = [
        (earlier.tool(name, d) if earlier is not None else None)
        or place(name, d, shapes, _rounding(problem, name, surfaces), first_way(problem, name))
        for name, d in problem.tools.items()
    ]
    named = {tool.name: tool for tool in tools}
    surfaces = [s if s.opposite is not None else _sharpened(s, named[s.against], dofs) for s in surfaces]
    if problem.contact_geometry == "current":
        for surface in (s for s in surfaces if s.opposite is None):
            _refuse_edges_on_points(named[surface.against], surface.points, surface.X, surface.normal)
    cells = {name: m.cells + offsets[name] if offsets[name] else m.cells for name, m in meshes.items()}
    more: list[Interaction] = [i for e in extensions for i in e.interactions(dofs, X, cells)]
    if beside is not None and not more and _joined_alike(beside, cells, surfaces):
        pattern, slots = beside.pattern, [b.slots for b in beside.blocks]
    else:
        pattern = _pattern(cells, surfaces, dofs, more, _sets(problem, meshes, offsets, dofs, surfaces))
        slots = [slots_of(cells[name], pattern, dofs.dimension) for name in problem.bodies]
    blocks = [_block(problem, name, cells[name], X, slot) for name, slot in zip(problem.bodies, slots)]
    system = System(problem, meshes, offsets, X, blocks, tools, surfaces, pattern, dofs, ties, more=more)
    for name in [*problem.fixed, *(k for s in problem.steps for k in (*s.fixed, *problem.driven(s)))]:
        system.boundary_nodes(name)
    for name in [*problem.loads, *(k for s in problem.steps for k in s.loads)]:
        system.boundary_edges(name)
    like = earlier.system if earlier is not None else beside
    system = with_chosen_elements(system, None if like is None else like.problem)
    if earlier is not None:
        if earlier.system.first is not None:
            system = on_meshes(system, earlier.remeshed(system))
        system.beginning = earlier.begin(system)
    return system


def _numbered(meshes: Mapping[str, Mesh]) -> tuple[dict[str, int], int]:
    """The number of the first node of each body, and of all nodes."""
    offsets, total = {}, 0
    for name, mesh in meshes.items():
        offsets[name], total = total, total + len(mesh.points)
    return offsets, total


def with_laws(system: System, problem: model.Problem) -> System:
    """The same meshes, tools and contact candidates with the materials, contacts and steps of another description.

    It must differ from the system's own in numbers of these alone.
    """
    laws = {name: material_of(b.material, problem.kinematics, problem.space) for name, b in problem.bodies.items()}
    blocks = [replace(b, law=laws[b.body]) for b in system.blocks]
    problem = problem.with_elements({name: b.element for name, b in system.problem.bodies.items() if b.element is not None})
    surfaces = [_with_laws(s, contact, laws) for s, contact in zip(system.surfaces, problem.all_contacts, strict=True)]
    return replace(system, problem=problem, blocks=blocks, surfaces=surfaces)


def _with_laws(s: Surface, contact: model.Contact | model.BodyContact, laws: Mapping[str, Law]) -> Surface:
    """A contact of another description, between bodies of other laws."""
    opposite = s.opposite
    if opposite is not None:
        opposite = opposite._replace(modulus=_modulus(laws[opposite.body], contact))
    return replace(s, description=contact, modulus=_modulus(laws[s.body], contact), opposite=opposite)


def first_way(problem: model.Problem, tool: str) -> Array | None:
    """Unit vector (d,) of the first travel or push of a tool that a step gives; None if none does."""
    axes = model.SPATIAL_AXES if problem.space == "solid" else model.SPATIAL_AXES[:2]
    for step in problem.steps:
        if (crank := step.crank.get(tool)) is not None:
            along, sign = AXIS[crank.toward]
            return np.array([sign * (axis == along) for axis in axes])
        for kind in (step.move, step.by, step.velocity, step.push):
            way = np.array([_first_value(getattr(kind.get(tool), axis, None)) for axis in axes])
            if way.any():
                return np.asarray(way / np.linalg.norm(way))
    return None


def _first_value(given: float | Sequence[tuple[float, float]] | None) -> float:
    """A number, or the first of a table that is not 0."""
    if given is None or isinstance(given, int | float):
        return float(given or 0.0)
    return next((float(value) for _, value in given if value), 0.0)


def with_tool(system: System, name: str, tool: ToolShape) -> System:
    """The same system with a tool of another shape or place; its description stays.

    Raises
    ------
    ToolError
        If the tool cannot be placed.

    """
    t = list(system.problem.tools).index(name)
    rounding, way = _rounding(system.problem, name, system.surfaces), first_way(system.problem, name)
    placed = place(name, tool, system.meshes, rounding, way)
    return replace(system, tools=[*system.tools[:t], placed, *system.tools[t + 1 :]])


def of_state(problem: model.Problem, state: State) -> System:
    """The system that a state of a problem belongs to: on the meshes of the description, or on those made since."""
    system = discretise(problem)
    return system if state.remeshed is None else on_meshes(system, state.remeshed)


def on_meshes(system: System, remeshed: Remeshed) -> System:
    """The system of the same problem and tools on other meshes; positions count from where the material was at the beginning.

    What the description's mesh decides elsewhere (sizes of elements at contacts, penalties) follows from the new ones.
    """
    problem, meshes = system.problem, dict(remeshed.meshes)
    offsets, total = _numbered(meshes)
    x = np.concatenate([m.points for m in meshes.values()])
    bodies = Meshed(problem, meshes, offsets, x, DofMap(x.shape[1], total))
    candidates = [_candidates(bodies, contact) for contact in problem.all_contacts]
    dofs = _dofs(problem, candidates, total, ())
    surfaces = _surfaces(problem, candidates, meshes, offsets, x, dofs)
    surfaces = [
        s if s.opposite is not None else _sharpened(s, system.tool_masters[s.against].tool, dofs) for s in surfaces
    ]
    cells = {name: m.cells + offsets[name] if offsets[name] else m.cells for name, m in meshes.items()}
    pattern = _pattern(cells, surfaces, dofs, (), _sets(problem, meshes, offsets, dofs, surfaces))
    blocks = [_block(problem, name, cells[name], x, slots_of(cells[name], pattern, 2)) for name in problem.bodies]
    made = System(
        problem, meshes, offsets, x, blocks, system.tools, surfaces, pattern, dofs,
        first=system.first or system, mirrors=system.mirrors,
    )  # fmt: skip
    return with_origins(made, remeshed)


def with_origins(system: System, remeshed: Remeshed) -> System:
    """A system on other meshes with its nodes where they are, and the beginnings of the material there of ``remeshed``."""
    X = np.concatenate(list(remeshed.origin.values()))
    blocks = [replace(b, X=X[b.cells], volume=remeshed.volume.get(b.body, b.volume)) for b in system.blocks]
    surfaces = [replace(s, X=s.points.at(X)) for s in system.surfaces]
    return replace(system, X=X, blocks=blocks, surfaces=surfaces, _volumes={})


def meshes_of(problem: model.Problem, beside: Mapping[str, Mesh]) -> dict[str, Mesh]:
    """Meshes of the bodies by name; ``beside``: those of a problem with numbers next to these.

    Raises
    ------
    MeshError
        If a description gives no mesh.

    """
    meshes: dict[str, Mesh] = {}
    for name, body in problem.bodies.items():
        try:
            element = element_of(problem.element_name(name))
            mesh = mesh_of(body.mesh, element.nodes, problem.units.length, beside.get(name), element.layout.dimension)
            if body.element is not None and isinstance(mesh, BrickMesh) and mesh.cells.shape[1] != element.nodes:
                words = "has bricks; use 'h8_fbar'" if element.nodes == 10 else "has tetrahedra; use 't10'"
                raise MeshError(f"{body.element!r} does not fit the mesh, which {words}, or leave the element out")
            meshes[name] = thin_way_up(mesh) if element.for_sheets else mesh
        except PrensaError as error:
            raise MeshError(f"bodies.{name}.mesh: {error}") from None
        x = meshes[name].points[:, 0]
        if problem.space == "axisymmetric" and x.min() < -1e-12 * np.ptp(x):
            raise MeshError(f"bodies.{name}.mesh: an axisymmetric mesh lies at x ≥ 0; this one reaches x = {x.min():g}")
    return meshes


def _of_files(problem: model.Problem, meshes: Mapping[str, Mesh]) -> dict[str, str]:
    """Elements of the bodies that name none and whose file has tetrahedra."""
    return {
        name: "t10"
        for name, mesh in meshes.items()
        if isinstance(mesh, BrickMesh) and mesh.cells.shape[1] == 10 and problem.bodies[name].element is None
    }


def _candidates(bodies: Bodies, contact: model.Contact | model.BodyContact) -> Points:
    """Candidate points of a contact on its surface."""
    owner = contact.surface[0].partition(".")[0]
    problem, mesh, offsets, X = bodies.problem, bodies.meshes[owner], bodies.offsets, bodies.X
    if isinstance(contact, model.BodyContact):
        return _on_side(problem, contact.slave, mesh, offsets[owner], X)
    edges = contact_edges(bodies, contact)
    if isinstance(mesh, BrickMesh):
        cells = mesh.cells + offsets[owner]
        volume, _ = element_of(problem.element_name(owner)).volumes(X[cells], _mode(problem))
        # it answers as points on edges do, but for what there is in the plane alone
        return cast(Points, face_points(X, cells, edges + offsets[owner], volume.sum(axis=1)))
    depth = depth_of(edges, mesh.cells, mesh.points)
    nodes, edges = ordered_nodes(edges) + offsets[owner], edges + offsets[owner]
    axisymmetric = problem.space == "axisymmetric"
    rule = DOORS["integration rule"].find(contact.integration)()
    return points_of(rule, X, nodes, edges, depth, axisymmetric, problem.thickness)


def _on_side(problem: model.Problem, side: str, mesh: Mesh, offset: int, X: Array) -> Points:
    """The nodes of a side of a body, as contact points."""
    edges = named_edges(mesh, (side,))
    nodes, depth = ordered_nodes(edges), depth_of(edges, mesh.cells, mesh.points)
    return points_of(Nodal(), X, nodes + offset, edges + offset, depth, False, problem.thickness)


def _opposite(
    problem: model.Problem, contact: model.BodyContact, points: Points, meshes: dict[str, Mesh], offsets: dict[str, int],
    X: Array,
) -> Opposite:  # fmt: skip
    """The master's side of a contact of two bodies, whose points are those of the slave's."""
    owner = contact.master.partition(".")[0]
    side = _on_side(problem, contact.master, meshes[owner], offsets[owner], X)
    closed = _closed(points, contact.slave), _closed(side, contact.master)
    law = material_of(problem.bodies[owner].material, problem.kinematics, problem.space)
    sides = FacingSides.of(points.nodes, side.nodes, closed)
    return Opposite(owner, sides, _modulus(law, contact), float(side.pressed_length.max()))


def _closed(side: Points, name: str) -> bool:
    """Whether a side of a body ends where it begins.

    Raises
    ------
    MeshError
        If it is in pieces, between which nothing is in contact.

    """
    if len(side.edges) < len(side.nodes) - 1:
        raise MeshError(f"body_contacts: {name!r} is in pieces; give each a boundary and a contact of its own")
    return len(side.edges) == len(side.nodes)


def _dofs(problem: model.Problem, candidates: list[Points], nodes: int, extensions: Sequence[Extension]) -> DofMap:
    """Displacements of the nodes, motions of the tools, multipliers of contacts that have them, fields of extensions."""
    dimension = 3 if problem.space == "solid" else 2
    components = ("n", "t") if dimension == 2 else ("n", "t1", "t2")
    more: list[tuple[str, str, int, tuple[str, ...]]] = [
        (contact.name, "contact point", len(points), components)
        for contact, points in zip(problem.all_contacts, candidates)
        if contact.enforcement.has_multipliers
    ]
    more += [(e.field, "node", nodes, e.components) for e in extensions]
    more += shares_field(problem)
    more += factor_field(any(step.control for step in problem.steps))
    return DofMap(dimension, nodes, len(problem.tools), more)


def _surfaces(
    problem: model.Problem, candidates: list[Points], meshes: dict[str, Mesh], offsets: dict[str, int], X: Array,
    dofs: DofMap,
) -> list[Surface]:  # fmt: skip
    out: list[Surface] = []
    for contact, points in zip(problem.all_contacts, candidates):
        if not len(points):
            why = f"has an area with a thickness of {problem.thickness:g}; give it in the case's unit of length"
            if problem.space == "axisymmetric":
                why = "lies off the axis, where a body of revolution ends; leave that side out"
            raise PrensaError(f"contact {contact.name!r}: no point of its surface {why}")
        owner = contact.surface[0].partition(".")[0]
        opposite = None
        if isinstance(contact, model.BodyContact):
            opposite = _opposite(problem, contact, points, meshes, offsets, X)
            stencils = dofs.displacement.dofs(opposite.sides.nodes).reshape(len(points), -1)
        else:
            stencils = dofs.stencils(points.support, dofs.tool.dofs(list(problem.tools).index(contact.against)))
        law = material_of(problem.bodies[owner].material, problem.kinematics, problem.space)
        out.append(
            Surface(
                contact.name, contact, owner, points, sum(len(s.points) for s in out), points.at(X),
                stencils, points.normals(X), points.node_normals(X), _modulus(law, contact),
                points.elements_behind(meshes[owner].cells + offsets[owner]),
                dofs.fields[contact.name] if contact.enforcement.has_multipliers else None, opposite=opposite,
            )
        )  # fmt: skip
    return out


def _modulus(law: Law, contact: model.Contact | model.BodyContact) -> float:
    """What the stiffnesses of a contact are measured by.

    Springs are in series with the body, and the stiffest that one can meet is material that cannot spread; multipliers only
    decide with theirs, best with that of a point alone.
    """
    return law.modulus() if contact.enforcement.has_multipliers else law.confined_modulus()


def _sharpened(s: Surface, tool: PlacedTool, dofs: DofMap) -> Surface:
    """The contact with points that reach to the neighbours of their nodes where its tool has sharp corners."""
    if not may_cut(s.points, tool.shape):
        return s
    points = with_neighbours(s.points)
    return replace(s, points=points, dofs=dofs.stencils(points.support, s.dofs[0, s.of_master]))


def _sets(
    problem: model.Problem, meshes: dict[str, Mesh], offsets: dict[str, int], dofs: DofMap, surfaces: Sequence[Surface]
) -> list[Index]:
    """Sets of degrees of freedom (k, m) that loads couple, and the areas that friction is bounded by."""
    # Without multipliers edges couple nothing that elements and tools do not; faces of six nodes reach beyond the points.
    wide = [s for s in surfaces if (s.exact or dofs.dimension == 3) and _bounded_by_area(problem, s.description)]
    stretched = [s.stretched_dofs(dofs) for s in wide]
    return [*couplings(dofs, _loaded(problem, meshes, offsets, dofs)), *share_couplings(dofs), *stretched]


def _bounded_by_area(problem: model.Problem, contact: model.Contact | model.BodyContact) -> bool:
    """Whether the friction of a contact may depend on the areas of its points: not where it is always the same share of p."""
    laws = [problem.friction if contact.friction is None else contact.friction]
    laws += [s.friction[contact.name] for s in problem.steps if contact.name in s.friction]
    fades = any(law != laws[0] for law in laws)
    return problem.kinematics == "finite" and (fades or any(law is not None and not law.proportional for law in laws))


def _loaded(problem: model.Problem, meshes: dict[str, Mesh], offsets: dict[str, int], dofs: DofMap) -> list[Index]:
    """Degrees of freedom of the boundaries and bodies that some load acts on."""
    out: list[Index] = []
    for name in {*problem.loads, *(name for step in problem.steps for name in step.loads)}:
        body, _, edge = name.partition(".")
        out.append(meshes[body].nodes(edge, name) + offsets[body])
    for body in {*problem.body_force, *(body for step in problem.steps for body in step.body_force)}:
        out.append(np.arange(len(meshes[body].points)) + offsets[body])
    return [dofs.displacement.dofs(nodes) for nodes in out]


def _pattern(
    cells: dict[str, Index], surfaces: list[Surface], dofs: DofMap, more: Sequence[Interaction], sets: list[Index]
) -> Pattern:
    """Couplings of the elements, of tools with their candidate nodes, of multipliers, and further ``sets`` of dofs (k, m)."""
    none = np.zeros(0, dtype=np.int64)
    near = [
        np.unique(np.concatenate([none, *(s.points.nodes for s in surfaces if own in s.dofs[0])]))
        for own in dofs.tool.dofs(np.arange(dofs.tool.count))[:, 0]
    ]
    whole = [s for s in surfaces if s.exact or s.sharp or s.opposite is not None]
    coupled = [*(s.coupled for s in whole), *(group for i in more for group in i.couplings())]
    coupled += sets
    return make_pattern(list(cells.values()), dofs, near, coupled)


def _joined_alike(system: System, cells: Mapping[str, Index], surfaces: Sequence[Surface]) -> bool:
    """Whether cells and contact points join the nodes that they join in a system: the rest of its pattern is of words."""
    own = [*(b.cells for b in system.blocks), *(a for s in system.surfaces for a in (s.coupled, s.points.nodes))]
    others = [*cells.values(), *(a for s in surfaces for a in (s.coupled, s.points.nodes))]
    alike = not system.more and [s.sharp for s in system.surfaces] == [s.sharp for s in surfaces]
    return alike and all(np.array_equal(a, b) for a, b in zip(own, others, strict=True))


def _block(problem: model.Problem, name: str, cells: Index, X: Array, slot: Slots) -> Block:
    """The elements of a body."""
    body, mode = problem.bodies[name], _mode(problem)
    element = element_of(problem.element_name(name))
    volume, folded = element.volumes(X[cells], mode)
    if folded.any():
        e = int(np.argmax(folded))
        x = X[cells[e]]
        raise MeshError(
            f"bodies.{name}.mesh: element {e} near ({x[:, 0].mean():g}, {x[:, 1].mean():g}) is folded "
            "(negative Jacobian at an integration point)"
        )
    law = material_of(body.material, problem.kinematics, problem.space)
    return Block(name, cells, X[cells], law, element, mode, slot, volume)


def _mode(problem: model.Problem) -> Mode:
    axisymmetric = problem.space == "axisymmetric"
    return Mode(axisymmetric, problem.kinematics == "finite", 2 * np.pi if axisymmetric else problem.thickness)


def _refuse_edges_on_points(tool: PlacedTool, points: Points, X: Array, normal: Array) -> None:
    """A sharp edge over a contact point has no equilibrium on the moved surface: the point drops off, and comes back.

    Raises
    ------
    ToolError
        Naming the tool, the node and the fillet to give.

    """
    for *edge, ex, ey in tool.shape.edges:
        along, ahead = (X - tool.at - edge) @ np.array([ex, ey]), (X - tool.at - edge) @ np.array([ey, -ex])
        slack = 1e-9 * float(np.ptp(along))
        inside = along.min() + slack < 0.0 < along.max() - slack
        facing = ey * normal[:, 0] - ex * normal[:, 1] < 0.0
        # what lies farther behind an edge than an overlap may be has the tool between: the edge is one of its back
        over = np.flatnonzero(facing & (np.abs(along) < 0.02 * points.depth) & (ahead > -points.depth))
        if inside and len(over):
            k = over[np.argmin(np.hypot(*(X[over] - tool.at - edge).T))]
            what = points.rule.point
            raise ToolError(
                f"tools.{tool.name}: its sharp edge lies over the {what} at ({X[k, 0]:g}, {X[k, 1]:g}), where contact would "
                f"open and close for ever; give 'fillet: {0.5 * points.depth[k]:.3g}', or use 'contact_geometry: reference'"
            )


def _rounding(problem: model.Problem, name: str, surfaces: list[Surface]) -> float:
    """Radius of the corners of a tool without fillets of its own: none where the surface stays where it is."""
    if problem.contact_geometry == "reference":
        return 0.0
    return ROUNDING * min((float(s.points.depth.min()) for s in surfaces if s.against == name), default=0.0)
