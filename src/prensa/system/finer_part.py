"""The surroundings of a contact as a problem of their own, of elements of any fineness, driven as the whole drove them.

What a contact of few nodes misses is known from a finer mesh alone, and that is needed no farther than the contact acts on the
material: a local problem with the displacements of the coarse one on its border (as of error estimates by local problems,
Ainsworth and Oden 2000, chapter 3). All of them, and the tools, go from where they began to where they are on straight ways.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from prensa.contact.surface import Surface
from prensa.mesh.halved import halved
from prensa.mesh.mesh import Mesh, boundary_edges
from prensa.model import problem as model
from prensa.system.interaction import Context
from prensa.system.state import State
from prensa.system.system import System
from prensa.tools.place import PlacedTool
from prensa.types import Array, Flags, Index


class Part(NamedTuple):
    """A ``problem`` of the surroundings of a contact, their ``nodes`` (n,), the ``work`` done in them and that in all bodies."""

    problem: model.Problem
    nodes: Index
    work: float
    total: float

    def without(self, tool: str) -> model.Problem:
        """The same with nothing of a tool, driven by its border and what else acts on it."""
        p = self.problem
        contacts = tuple(c for c in p.contacts if c.against != tool)
        steps = tuple(replace(s, move={t: m for t, m in s.move.items() if t != tool}) for s in p.steps)
        return replace(p, contacts=contacts, steps=steps, tools={t: d for t, d in p.tools.items() if t != tool})


class _Cells(NamedTuple):
    """Elements of a body, ``chosen`` of all (cells,): their ``nodes`` (n,) in the system, ``cells`` (m, 3|4) of these.

    ``held`` (n, 2): which of their motions are given, on the border all.
    """

    chosen: Flags
    nodes: Index
    cells: Index
    held: Flags


def may_part(system: System, s: Surface) -> bool:
    """Whether there is such a problem: a plane body of linear elements on which nothing but contacts and supports ever acts."""
    p = system.problem
    plain = system.dofs.dimension == 2 and not system.on_undeformed and p.start is None and p.heat is None and not system.gone
    names = [*p.loads, *p.body_force, *(name for step in p.steps for name in (*step.loads, *step.body_force))]
    loaded = any(name.partition(".")[0] == s.body for name in names)
    return plain and not loaded and (s.points.are_nodes or s.sharp) and system.meshes[s.body].cells.shape[1] in (3, 4)


def part_of(
    system: System, c: Context, end: State, s: Surface, nodes: Index, layers: int, halvings: int,
    increments: Sequence[int | None] = (),
) -> Part | None:  # fmt: skip
    """Surroundings of nodes of a contact in the state at the end of an increment: so many layers of elements, halved so often.

    ``increments`` of its steps, of metal and under sharp corners; those of its last step are the run's if nothing is said,
    those before it automatic.
    None where nothing of their border is held.
    """
    u = end.u
    part = _around(system, c, s, nodes, layers)
    if not part.held.any():
        return None
    contacts = [(i, o) for i, o in enumerate(system.tool_contacts) if o.body == s.body]
    # which contact surfaces a node lies on goes on to those between, as what is held does
    on = np.stack([np.isin(part.nodes, o.points.edges) for _, o in contacts], axis=1)
    stages = [v for v in (c.state.step_start, u) if v.any()]
    moved = [system.displacement(v)[part.nodes] for v in stages]
    values, cells, marked = np.hstack([system.X[part.nodes], *moved]), part.cells, np.hstack([part.held, on])
    for _ in range(halvings):
        values, cells, marked = halved(values, cells, marked)
    # The start of the step is a stage of its own: the plastic history depends on the way, and a straight one from the beginning
    # would miss a turn between steps.
    ways = [values[:, k : k + 2] for k in range(2, values.shape[1], 2)]
    steps = [_step(system, s.body, marked[:, :2], *way) for way in zip(ways, stages)]
    # Elastic bodies have no history but that of friction, and one increment a step, cut where it is too long, ends as many do;
    # but edges under sharp corners are cut once an increment, where nodes are at its start, which has to be near.
    if not any(o.sharp for _, o in contacts) and not any(b.law.plastic for b in system.blocks if b.body == s.body):
        increments = [1] * len(steps)
    increments = increments or [None] * (len(steps) - 1) + [c.plan.increments]
    steps = [replace(step, increments=count) for step, count in zip(steps, increments)]
    problem = _problem(system, c, s.body, contacts, steps, values[:, :2], cells, marked)
    return None if problem is None else Part(problem, part.nodes, *work_in(system, end, s.body, part.chosen))


def work_in(system: System, state: State, body: str, chosen: Flags | slice = slice(None)) -> tuple[float, float]:
    """Work done in ``chosen`` elements (m,) of a body, and in all bodies: stored and dissipated."""
    total = own = 0.0
    for b, h in zip(system.blocks, state.history):
        of_elements = b.work(h)
        total += float(of_elements.sum())
        own += float(of_elements[chosen].sum()) if b.body == body else 0.0
    return own, total


def _around(system: System, c: Context, s: Surface, pressed: Index, layers: int) -> _Cells:
    """The elements of a contact's body in so many layers around nodes, and what of them is held by supports or by the rest."""
    mesh, first = system.meshes[s.body], system.offsets[s.body]
    near, chosen = np.isin(np.arange(len(mesh.points)), pressed - first), np.zeros(len(mesh.cells), dtype=bool)
    for _ in range(layers):
        chosen = np.asarray(near[mesh.cells].any(axis=1))
        near[mesh.cells[chosen]] = True
    nodes, cells = np.unique(mesh.cells[chosen], return_inverse=True)
    cells = cells.reshape(-1, mesh.cells.shape[1])
    fixed = np.zeros(system.ndof, dtype=bool)
    fixed[system.prescribed(c.plan.fixed)] = True
    held = fixed[system.dofs.displacement.dofs(nodes + first)]
    held |= np.isin(nodes, _joined(system, s.body, mesh))[:, None]
    outer, inner = _sides(boundary_edges(mesh.cells)), boundary_edges(cells)
    border = inner[[side not in outer for side in map(frozenset, nodes[inner].tolist())]]
    held[np.unique(border)] = True
    return _Cells(chosen, nodes + first, cells, held)


def _sides(edges: Index) -> set[frozenset[int]]:
    return set(map(frozenset, edges[:, :2].tolist()))


def _joined(system: System, body: str, mesh: Mesh) -> Index:
    """Nodes of a body that a tie or another body acts on."""
    p = system.problem
    names = [name for tie in p.ties for name in (tie.slave, tie.master)]
    names += [name for contact in p.body_contacts for name in (contact.slave, contact.master)]
    own = [name.partition(".")[2] for name in names if name.partition(".")[0] == body]
    return np.concatenate([np.zeros(0, dtype=np.int64), *(mesh.nodes(name) for name in own)])


def _step(system: System, body: str, held: Flags, way: Array, u: Array) -> model.Step:
    """The step that brings what is held (n, 2) to displacements (n, 2), and the tools to where they are in u (ndof,)."""
    fixed = {}
    for k in np.flatnonzero(held.any(axis=1)).tolist():
        x, y = (float(v) if given else None for v, given in zip(way[k], held[k]))
        fixed[f"{body}.n{k}"] = model.Fixed(x=x, y=y)
    tools = {s.against: system.tool_masters[s.against] for s in system.tool_contacts if s.body == body}
    axes = ("y",) if system.axisymmetric else ("x", "y", "rz")
    ways = {t: dict(zip(("x", "y", "rz"), m.place(u).tolist())) for t, m in tools.items()}
    return model.Step("part", move={t: model.Motion(**{a: way[a] for a in axes}) for t, way in ways.items()}, fixed=fixed)


def _placed(tool: PlacedTool) -> model.Tool:
    """The description of a tool with the place that it has at the beginning, and nothing that moves it."""
    d, at = tool.description, tuple(tool.at.tolist())
    looks: dict[str, Any] = {d.direction_key: tuple(tool.direction.tolist())} if d.direction_key else {}
    return replace(d, at=at, touching=None, above=None, below=None, spring=None, press=None, **looks)


def _problem(
    system: System, c: Context, body: str, contacts: list[tuple[int, Surface]], steps: list[model.Step], x: Array, cells: Index,
    marked: Flags,
) -> model.Problem | None:  # fmt: skip
    """The problem of nodes x (n, 2), and what of them is held or in contact (n, 2 + contacts); None without contact."""
    p, outline = system.problem, np.unique(boundary_edges(cells))
    names = {f"n{k}": (k,) for k in np.flatnonzero(marked[:, :2].any(axis=1)).tolist()}
    laws, made = c.plan.friction_at(c.time), []
    for j, (i, _) in enumerate(contacts):
        nodes = outline[marked[outline, 2 + j]]
        if len(nodes) > 1:
            names[f"side{j}"] = tuple(nodes.tolist())
            made.append(replace(p.contacts[i], surface=(f"{body}.side{j}",), friction=laws[i], interference=None))
    if not made:
        return None
    tools = {contact.against: _placed(system.tool_masters[contact.against].tool) for contact in made}
    mesh = model.Points(tuple(map(tuple, x.tolist())), tuple(map(tuple, cells.tolist())), names)
    own = replace(p.bodies[body], mesh=mesh, element=p.element_name(body), damage=())
    steps = [replace(step, name=f"part {k}", move={n: step.move[n] for n in tools}) for k, step in enumerate(steps)]
    return replace(
        p, name="part", bodies={body: own}, steps=tuple(steps), tools=tools, contacts=tuple(made), no_contact=(), ties=(),
        fixed={}, loads={}, body_force={}, friction=None, remesh="off", measures={}, body_contacts=(),
    )  # fmt: skip
