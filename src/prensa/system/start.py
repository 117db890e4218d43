"""Cases that begin where an earlier run ended: springback, several stages.

The state is carried, not re-made: nodes keep their initial positions X and their displacements, points their histories, so
that volumes, stiffnesses and energies are those of the earlier run to the last digit. Forces that are no longer applied
(tools, loads and supports that the new case does not have) would be a jump at time 0; they are kept as dead forces and
released linearly during the first step, which cut-backs can then resolve.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from prensa.contact.surface import Surface
from prensa.errors import PrensaError
from prensa.mesh.mesh import Mesh, displaced
from prensa.model import problem as model
from prensa.system.checkpoint import CHECKPOINT, read_checkpoint
from prensa.system.inclined import held_along_normals
from prensa.system.interaction import Context
from prensa.system.mesh_state import Remeshed
from prensa.system.planning import plan_step
from prensa.system.schedule import StepPlan
from prensa.system.state import Energy, State
from prensa.system.system import NOTHING, Evaluation, System
from prensa.tools.place import PlacedTool
from prensa.tools.tool import ToolShape
from prensa.types import Array, Index


class StartError(PrensaError):
    """A case that does not go together with the run that it starts from; the message names what differs."""


@dataclass(frozen=True)
class Earlier:
    """An earlier run: its system, its last state, and the bodies (in both cases) that go on from there."""

    system: System
    state: State
    bodies: tuple[str, ...]

    def shapes(self, meshes: dict[str, Mesh]) -> dict[str, Mesh]:
        """Meshes as the run left them, for placing tools."""
        x, old = self.system.positions(self.state.u), self.system.meshes
        return {name: displaced(old[name], x[self.system.span(name)]) if name in self.bodies else m for name, m in meshes.items()}

    def remeshed(self, system: System) -> Remeshed:
        """The meshes of a system whose bodies go on with those that the run has made; the others keep theirs."""
        old = self.system
        volume = {b.body: b.volume for s in (system, old) for b in s.blocks if s is system or b.body in self.bodies}
        meshes = {name: old.meshes[name] if name in self.bodies else m for name, m in system.meshes.items()}
        origin = {name: old.X[old.span(name)] if name in self.bodies else m.points for name, m in meshes.items()}
        return Remeshed(meshes, origin, volume, 0, 0, np.zeros((0, 3)), 1.0)

    def tool(self, name: str, description: ToolShape) -> PlacedTool | None:
        """The tool of the run, if it has one of that name and description."""
        return next((t for t in self.system.tools if t.name == name and t.description == description), None)

    def surface(self, s: Surface, system: System) -> Surface | None:
        """The contact of the run that goes on in contact *s* of the new system."""
        if s.opposite is not None:  # folders know no contact between bodies yet
            return None
        tool = system.tool_masters[s.against].tool
        if s.body not in self.bodies or self.tool(tool.name, tool.description) is None:
            return None
        for old in self.system.surfaces:
            same = old.name == s.name and type(old.description.enforcement) is type(s.description.enforcement)
            if same and old.description.integration == s.description.integration:
                return old
        return None

    def begin(self, system: System) -> State:
        """State at time 0 of the new system, with the forces to be released."""
        new = system.undeformed()
        u, contact, lam = self._moved(self.state.u, system), new.contact, new.lam.copy()
        history, damage = list(new.history), list(new.damage)
        for number, block in enumerate(system.blocks):
            if block.body in self.bodies:
                earlier = [b.body for b in self.system.blocks].index(block.body)
                history[number] = self.state.history[earlier]
                if system.problem.bodies[block.body].damage:
                    damage[number] = self.state.damage[earlier]
        for s in system.surfaces:
            before = self.surface(s, system)
            if before is None:
                contact.coordinate[s.rows] = system.stencils(s, u).s
                continue
            here, there = _same_points(s, before)
            if len(here) < len(s.points):
                contact.coordinate[s.rows] = system.stencils(s, u).s
            rows, old = s.first + here, before.first + there
            contact = contact.replaced(rows, self.state.contact.of(old))
            lam[rows] = self.state.lam[old]
            if s.multipliers is not None and before.multipliers is not None:
                u[s.multipliers.dofs(here)] = self.state.u[before.multipliers.dofs(there)]
        state = replace(
            new, u=u, step_start=u.copy(), history=tuple(history), contact=contact, lam=lam, damage=tuple(damage),
            tool_wear=self._worn(system),
        )  # fmt: skip
        return self._balanced(system, state)

    def _worn(self, system: System) -> Array:
        """Wear (tools,) of the tools that go on; that of the others begins at 0."""
        before = {tool.name: wear for tool, wear in zip(self.system.tools, self.state.tool_wear)}
        goes_on = [self.tool(t.name, t.description) is not None for t in system.tools]
        return np.array([before.get(t.name, 0.0) if on else 0.0 for t, on in zip(system.tools, goes_on)])

    def _balanced(self, system: System, state: State) -> State:
        """The state with its forces and energies, and what has to be added so that nothing jumps at time 0.

        The weights of the contact points move on with the committed shape: a contact that goes on begins its next increment
        with that jump in any run, and it is no force that is released.
        """
        plan, e, c = _at_rest(system, state, 0, state.step_start, 0.0)
        number = min(self.state.clock.step, len(self.system.problem.steps) - 1)
        _, old, at_end = _at_rest(self.system, self.state, number, self.state.step_start, self.state.clock.time)
        inner, inner_old = (s.to_masters(v.r + v.f_ext) for s, v in ((system, e), (self.system, old)))
        release = system.to_masters(e.r - self._moved(self._jump(system, at_end, old), system))
        work = self._moved(self.state.work, system) + inner - self._moved(inner_old, system)
        release[plan.held] = 0.0
        for s in system.surfaces:
            if s.multipliers is not None:  # equations of multipliers are no forces
                release[s.unknowns] = work[s.unknowns] = 0.0
        elastic, plastic = system.elastic_energy(state.history), system.plastic_work(state.history)
        stored = system.contact_energy(e.contacts, c.scales)
        if len(system.surfaces) == len(self.system.surfaces) and all(self.surface(s, system) for s in system.surfaces):
            stored = self.state.energy.contact
        friction, imbalance = self.state.energy.friction, self.state.energy.imbalance
        spent = elastic + plastic + friction + stored
        energy = Energy(spent + imbalance, elastic, plastic, friction, stored, imbalance)
        carried = release if np.abs(release).sum() > NOTHING * e.scale else None
        return replace(state, work=work, energy=energy, release=carried)

    def _jump(self, system: System, c: Context, now: Evaluation) -> Array:
        """Forces (ndof,) of the contacts that go on, with the weights of the last increment less those of the next."""
        old = self.system
        out = np.zeros(old.ndof)
        kept = [before.name for s in system.surfaces if (before := self.surface(s, system)) is not None]
        if not kept or old.problem.kinematics == "small":
            return out
        x = old.positions(self.state.u - self.state.du)
        last = replace(c, weights=[old.weights(s, x, c.depth) for s in c.surfaces])
        lam = self.state.lam.copy()
        for s, f, scale in zip(old.surfaces, now.contacts, c.scales):
            if not s.exact:  # so that the pressure is the committed one, whatever the multipliers were on the way to it
                lam[s.rows, 0] += np.where(self.state.contact.closed[s.rows], scale.k_n * f.g, 0.0)
        then = old.evaluate(last, self.state.u, lam, stiffness=False)
        for s, a, b in zip(old.surfaces, then.contacts, now.contacts):
            if s.name in kept:
                np.add.at(out, s.dofs, a.F - b.F)
        return out

    def _moved(self, values: Array, system: System) -> Array:
        """Values (ndof,) of the earlier degrees of freedom at the places of the same bodies and tools in the new system."""
        out = np.zeros(system.ndof)
        for body in self.bodies:
            nodes = np.arange(len(system.meshes[body].points))
            here = system.dofs.displacement.dofs(system.offsets[body] + nodes)
            out[here] = values[self.system.dofs.displacement.dofs(self.system.offsets[body] + nodes)]
        for t, tool in enumerate(system.tools):
            if self.tool(tool.name, tool.description) is not None:
                number = list(self.system.problem.tools).index(tool.name)
                out[system.dofs.tool.dofs(t)] = self.system.place_of(number, values)
                out[system.dofs.orientation(t)] = values[self.system.dofs.orientation(number)]
        return out


def _same_points(s: Surface, before: Surface) -> tuple[Index, Index]:
    """Numbers (k,), (k,) of the points that two contacts share, by place and normal; a released support adds some to a side."""
    old: dict[bytes, list[int]] = {}
    for number, place in enumerate(np.hstack([before.X, before.normal])):
        old.setdefault(place.tobytes(), []).append(number)
    same = [
        (number, old[key].pop(0))
        for number, place in enumerate(np.hstack([s.X, s.normal]))
        if old.get(key := place.tobytes())
    ]
    here, there = np.array(same, dtype=np.int64).reshape(-1, 2).T
    return here, there


def _at_rest(
    system: System, state: State, number: int, step_start: Array, time: float
) -> tuple[StepPlan, Evaluation, Context]:
    """Plan of a step, and the forces of a committed state in it when nothing moves."""
    plan = plan_step(system, number, step_start, state.ends)
    c = replace(system.context(state, plan, time), dt=1.0)
    e = system.evaluate(c, state.u, system.initial_multipliers(state), stiffness=False)
    if e.failed:
        raise StartError(f"start: {e.failed} in the state that the earlier run left")
    return plan, e, c


def earlier_run(
    problem: model.Problem, start: model.Start, meshes: dict[str, Mesh],
    discretise: Callable[[model.Problem, State], System],
) -> Earlier:  # fmt: skip
    """The run that a problem starts from; ``discretise`` makes the system that its state belongs to.

    Raises
    ------
    StartError
        If the two cases do not go together.

    """
    case, state = read_checkpoint(Path(start.run) / CHECKPOINT)
    before = case.problem
    system = discretise(before, state)
    if state.u.shape != (system.ndof,):
        raise StartError(
            f"start: in the run in {start.run!r} free sides reached lines or planes of symmetry, whose contact forces "
            "another case cannot take over; make both one case of several steps"
        )
    for key in ("space", "kinematics", "contact_geometry", "thickness", "units"):
        if getattr(before, key) != getattr(problem, key):
            raise StartError(
                f"start: the earlier run has {key} {getattr(before, key)!r}, this case another; make them equal"
            )
    bodies = tuple(name for name in problem.bodies if name in before.bodies)
    if not bodies:
        raise StartError(
            f"start: no body of this case is in the earlier run, which has {', '.join(map(repr, before.bodies))}"
        )
    for name in bodies:
        new, old = problem.bodies[name], system.problem.bodies[name]
        # an element that is left open is that of the earlier run, whatever it was chosen for there
        if new.material != old.material or new.element not in (before.bodies[name].element, system.problem.element_name(name)):
            raise StartError(
                f"start: body {name!r} has another material or element in the earlier run; make them equal"
            )
        if [replace(law, limit=None) for law in new.damage] != [replace(law, limit=None) for law in old.damage]:
            raise StartError(
                f"start: body {name!r} has other damage laws in the earlier run; make them equal, except for their limits"
            )
        a, b = meshes[name], (system.first or system).meshes[name]
        if new.element is None and a.cells.shape[1] != b.cells.shape[1]:  # the default depends on whether it is remeshed
            element = system.problem.element_name(name)
            raise StartError(f"start: body {name!r} has element {element!r} in the earlier run; write 'element: {element}' here")
        if not (np.array_equal(a.points, b.points) and np.array_equal(a.cells, b.cells)):
            raise StartError(
                f"start: body {name!r} has another mesh in the earlier run; give the mesh that it began with"
            )
    if added := set(held_along_normals(problem)) - set(held_along_normals(before)):
        raise StartError(
            f"start: {sorted(added)[0]!r} is held along its normal in this case alone, and may have left its plane in the "
            "earlier run; hold it there too, or along x, y or z here"
        )
    if problem.ties != before.ties:
        raise StartError("start: the ties differ from those of the earlier run; bodies are tied from the beginning")
    return Earlier(system, state, bodies)
