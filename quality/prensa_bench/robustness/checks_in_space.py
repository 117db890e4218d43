"""Checks of the files of a run in space by plain geometry and statics: nothing here is shared with the solver.

As `prensa_bench.robustness.checks` in the plane: every check answers '' or, in words, what is wrong. Forces at nodes are the
pressures of the contact tables times tributary areas of the deformed faces along normals of the tools' own formulas, with the
tangential part of the forces of the tables, which must lie in the cone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

import prensa as pr
from prensa.types import Array, Flags, Index
from prensa_bench.robustness import loads_in_space
from prensa_bench.robustness.cells_in_space import (
    BRICK_SIGNS,
    beside,
    contact_points,
    deformation,
    known_volume,
    outer_faces,
    tributary,
    volumes,
)
from prensa_bench.robustness.checks import (
    DEEP,
    DEEP_BY_PRESSURE,
    ENHANCED,
    FORCES,
    FORCES_WHOLE,
    MOMENTS,
    REACHED,
    SAME_GAP,
    WORK,
    bodies_outside,
    size_of,
)
from prensa_bench.robustness.drawn import Drawn, Placed
from prensa_bench.robustness.files import Record, Shape

XYZ = "xyz"
FORCE_AND_AREA = 1e-4  # of the largest force at a node: what areas of warped faces leave between it and pressure times area
BEYOND_CONE = 1e-6  # of the bound by which friction may exceed it
YIELD = 1e-6  # of the flow stress: what a point may be stressed above it, and by which a plastic strain may fall
NOTABLE = 0.1  # of an edge: depth of a corner without contact that a run must warn of
JUMP = 0.1  # of what stored energy changes by in an increment: the most work that is done in a jump
OPEN_WORK = 0.15  # of the work: what an increment's path leaves open between work and stored and dissipated energies


class Touching(NamedTuple):
    """A contact at one increment: nodes (k,), places x (k, 3), own gaps and normals there; areas, forces on the body, sizes."""

    nodes: Index
    x: Array
    gap: Array
    normal: Array
    area: Array
    force: Array
    size: Array


def wrong_with(d: Drawn, records: list[Record]) -> str:
    """What is wrong with the runs of the stages of a problem; '' if nothing is found."""
    for record in records:
        if not record.bodies:
            return "no fields were written"
        for check in (turned, outlines, corners_inside, cone, balance, moments, driven, energy, elements, yielding, volume):
            if found := check(d, record):
                return found
    return next((found for claim in d.claims if (found := claim(records[-1]))), "")


def until_it_stopped(d: Drawn, record: Record) -> str:
    """What is wrong with a run that did not come to its end: all but where its tools were to go."""
    checks = (turned, outlines, corners_inside, cone, balance, moments, energy, elements, yielding, volume)
    return next((found for check in checks if (found := check(d, record))), "")


# ---------------------------------------------------------------------------------------------------------------- geometry


def seen_by(tool: Placed, name: str, record: Record, row: int, x: Array) -> tuple[Array, Array]:
    """Signed distance (k,) of points to a tool where the history says that it is, and outward normals (k, 3)."""
    h = record.history
    R = stands(record, name, row)
    gap, n = tool.outline((x - np.asarray(tool.at) - [h[f"{name}.u{a}"][row] for a in XYZ]) @ R)
    return gap, n @ R.T


def stands(record: Record, name: str, row: int) -> Array:
    """How a tool stands (3, 3): the rotations of its columns rx, ry, rz in each step, one after the other."""
    r = np.stack([record.history[f"{name}.r{a}"][: row + 1] for a in XYZ], axis=1)
    R, before = np.eye(3), np.zeros(3)
    for k in range(row):
        if record.steps[k] != record.steps[k + 1]:
            R, before = turn(r[k] - before) @ R, r[k]
    return np.asarray(turn(r[row] - before) @ R)


def turned(d: Drawn, record: Record) -> str:
    """The orientation that the history says is that of the rotations which it says."""
    h = record.history
    for name in record.problem.tools:
        for row, time in enumerate(h["time"]):
            off = stands(record, name, row) - turn(np.array([h[f"{name}.o{a}"][row] for a in XYZ]))
            if np.abs(off).max() > REACHED:
                return f"time {time:.4g}: the orientation of {name} is {np.abs(off).max():.1e} off its rotations"
    return ""


def gone(record: Record) -> Flags:
    """Rows (k,) of the history in which tools are being removed, or have been."""
    names = [s.name for s in record.problem.steps]
    first = next((k for k, s in enumerate(record.problem.steps) if s.remove_tools), len(names))
    return np.array([names.index(step) >= first for step in record.steps], dtype=bool)


def turn(v: Array) -> Array:
    """The rotation (3, 3) about a vector (3,) by its length (Rodrigues)."""
    angle = float(np.linalg.norm(v))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = v / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K)


def touchings(d: Drawn, record: Record) -> Iterator[tuple[int, pr.Contact, Touching]]:
    """Row of the history, description and own view of every contact table, in the order of time."""
    shape = next(iter(record.bodies.values()))
    faces = {name: outer_faces(s.cells) for name, s in shape.items()}
    away = gone(record)
    for row, _number in enumerate(record.history["increment"].astype(int)):
        for c in record.problem.contacts if not away[row] else ():
            yield row, c, _touching(d, record, row, c, shape, faces)


def _touching(
    d: Drawn, record: Record, row: int, c: pr.Contact, shape: dict[str, Shape], faces: dict[str, Index]
) -> Touching:  # fmt: skip
    number = int(record.history["increment"][row])
    t = record.contacts[c.name][number]
    body = c.surface[0].partition(".")[0]
    nodes, known = t["node"].astype(np.int64), record.bodies.get(number)
    x = known[body].x.copy() if known else np.zeros_like(shape[body].X)  # corners of tetrahedra stand in no table
    x[nodes] = np.stack([t[a] for a in XYZ], axis=1)
    own = faces[body][np.isin(contact_points(faces[body]), nodes).all(axis=1)]
    gap, n = seen_by(d.tools[c.against], c.against, record, row, x[nodes])
    force = np.stack([t[f"force_{a}"] for a in XYZ], axis=1)
    return Touching(nodes, x[nodes], gap, n, tributary(own, x)[nodes], force, beside(own, x)[nodes])


def outlines(d: Drawn, record: Record) -> str:
    """Gaps are what they are said to be, no node lies inside a tool, no pressure across a gap."""
    size, E = size_of(record), d.E or min(body.material.modulus for body in d.problem.bodies.values())
    for row, c, t in touchings(d, record):
        table = record.contacts[c.name][int(record.history["increment"][row])]
        at, p = f"time {record.history['time'][row]:.4g}: {c.name}", table["pressure"]
        same = SAME_GAP * size + d.tools[c.against].off
        near = np.isfinite(table["gap"]) & (np.abs(t.gap) < 0.5 * t.size)
        if near.any() and (off := float(np.abs(table["gap"] - t.gap)[near].max())) > same:
            return f"{at}: a gap is {off:.2g} off the distance of its node to the tool"
        if (p < 0).any():
            return f"{at}: negative pressure"
        allowed = d.tools[c.against].off + DEEP * t.size + DEEP_BY_PRESSURE * np.maximum(p, 0.0) / E * t.size
        if (t.gap < -allowed).any():
            k = int(np.argmin(t.gap + allowed))
            return f"{at}: node {t.nodes[k]} lies {-t.gap[k]:.3g} inside the tool"
        slack = getattr(c.enforcement, "tolerance", 0.0) * t.size  # what the augmented form leaves
        if ((t.gap > same + slack) & (p > 0)).any():
            return f"{at}: pressure across an open gap of {t.gap[p > 0].max():.3g}"
    here = set(record.history["increment"][~gone(record)].astype(int))
    before = replace(record, bodies={number: shapes for number, shapes in record.bodies.items() if number in here})
    return bodies_outside(d.tools, before, outer_faces, beside, seen_by)


def corners_inside(d: Drawn, record: Record) -> str:
    """Corners of tetrahedra, at which there is no contact, lie in no tool by a notable part of an edge, or the run says so."""
    if any("corner" in words and "of a tetrahedron" in words for words in record.said):
        return ""
    rows, away = {int(n): k for k, n in enumerate(record.history["increment"])}, gone(record)
    for number, shapes in record.bodies.items():
        for body, s in shapes.items():
            faces = outer_faces(s.cells)
            if faces.shape[1] != 6 or away[rows[number]]:
                continue
            nodes, h = np.unique(faces[:, :3]), beside(faces, s.x)
            for name, tool in d.tools.items():
                gap, _ = seen_by(tool, name, record, rows[number], s.x[nodes])
                k = int(np.argmin(gap / h[nodes]))
                if gap[k] < -NOTABLE * h[nodes[k]] - tool.off:
                    return f"increment {number}: corner {nodes[k]} of {body} lies {-gap[k]:.3g} inside {name}, and no word of it"
    return ""


# ------------------------------------------------------------------------------------------------------------------ statics


def cone(d: Drawn, record: Record) -> str:
    """Normal parts of forces are pressures times areas, the rest lies in the cone of the coefficient of friction."""
    for row, c, t in touchings(d, record):
        table, at = record.contacts[c.name][int(record.history["increment"][row])], f"time {record.history['time'][row]:.4g}"
        normal = (t.force * t.normal).sum(axis=1)
        whole, tilt = float(np.abs(normal).max(initial=0.0)), d.tools[c.against].tilt
        if (off := np.abs(normal - t.area * table["pressure"])).max(initial=0.0) > (FORCE_AND_AREA + tilt) * whole:
            return f"{at}: {c.name}: the force of a node is {off.max() / whole:.1e} off its pressure times its area"
        sideways = np.linalg.norm(t.force - normal[:, None] * t.normal, axis=1)
        if (over := sideways - d.mu[c.name] * normal).max(initial=0.0) > (BEYOND_CONE + 2.0 * tilt) * whole:
            return f"{at}: {c.name}: friction is {over.max() / whole:.1e} of the largest force above its bound"
        if (off := np.abs(sideways - t.area * np.abs(table["shear"]))).max(initial=0.0) > (FORCE_AND_AREA + tilt) * whole:
            return f"{at}: {c.name}: the friction of a node is {off.max() / whole:.1e} off its shear times its area"
    return ""


def balance(d: Drawn, record: Record) -> str:
    """Nodal contact forces against the force on each tool, tools against supports."""
    h = record.history
    tool = {t: np.stack([h[f"{t}.f{a}"] for a in XYZ], axis=1) for t in record.problem.tools}
    held = np.zeros((len(h["time"]), 3))
    for k, a in enumerate(XYZ):
        held[:, k] += sum(v for key, v in h.items() if key.startswith("fixed.") and key.endswith(f".f{a}"))
    nodal = {t: np.zeros_like(held) for t in tool}
    for row, c, t in touchings(d, record):
        nodal[c.against][row] += t.force.sum(axis=0)
    largest = np.maximum.accumulate(np.max([np.abs(v).max(axis=1) for v in tool.values()], axis=0))
    if not largest.max() > 0.0:
        return "no tool bears a force at any time"
    allowed = FORCES * largest + FORCES_WHOLE * largest.max()
    sums = {f"forces at the nodes miss that on {name} by": nodal[name] + f for name, f in tool.items()}
    sums["tools and supports are out of balance by"] = sum(tool.values()) - held - _loads(record)
    for words, rest in sums.items():
        off = np.where(_released(record), 0.0, np.abs(rest).max(axis=1))
        if (off > allowed).any():
            k = int(np.argmax(off / np.maximum(allowed, 1e-300)))
            return f"time {h['time'][k]:.4g}: {words} {off[k]:.1e} where tools bear {largest[k]:.1e}"
    return ""


def _loads(record: Record) -> Array:
    """Sums (k, 3) of the loads, of which the fields of all increments are known where there are any."""
    if not loads_in_space.names_of(record.problem):
        return np.zeros((len(record.history["time"]), 3))
    numbers = record.history["increment"].astype(int)
    return np.stack([sum(f.sum(axis=0) for f in loads_in_space.applied(record, n).values()) for n in numbers])


def _released(record: Record) -> Flags:
    """Rows (k,) in which what tools bore is being released, and is said nowhere: at the end of that step nothing is left."""
    names = [s.name for s in record.problem.steps]
    ends = np.array([1.0 + names.index(step) for step in record.steps])
    return gone(record) & (record.history["time"] < ends - REACHED)


def moments(d: Drawn, record: Record) -> str:
    """Three moments about the origin: nodal contact forces against each tool, and all tools against the reactions at nodes."""
    h, size = record.history, size_of(record)
    on_tool = {t: np.zeros((len(h["time"]), 3)) for t in record.problem.tools}
    for row, c, t in touchings(d, record):
        on_tool[c.against][row] += np.cross(t.x, t.force).sum(axis=0)
    moments, force = {}, np.zeros(len(h["time"]))
    for name in on_tool:
        u, f, m = (np.stack([h[f"{name}.{key}{a}"] for a in XYZ], axis=1) for key in "ufm")
        moments[name] = m + np.cross(np.asarray(d.tools[name].at) + u, f)
        force = np.maximum(force, np.linalg.norm(f, axis=1))
    reach = max([size, *(float(np.linalg.norm(d.tools[t].at)) for t in on_tool)])
    largest = np.maximum.accumulate(force)
    allowed = (MOMENTS * largest + FORCES_WHOLE * largest.max()) * reach
    for name in on_tool:
        off = np.abs(on_tool[name] + moments[name]).max(axis=1)
        if (off > allowed).any():
            k = int(np.argmax(off / np.maximum(allowed, 1e-300)))
            return f"time {h['time'][k]:.4g}: moments at the nodes miss that on {name} by {off[k] / (largest[k] * reach):.1e}"
    rows, released = {int(v): k for k, v in enumerate(h["increment"])}, _released(record)
    for number, shapes in record.bodies.items():
        if released[k := rows[number]]:
            continue
        loads = loads_in_space.applied(record, number)
        held = sum(np.cross(s.x, s.reaction + loads[body]).sum(axis=0) for body, s in shapes.items())
        if (off := np.abs(sum(m[k] for m in moments.values()) - held).max()) > allowed[k]:
            return f"time {h['time'][k]:.4g}: moments of tools and supports differ by {off / (largest[k] * reach):.1e}"
    return ""


def driven(d: Drawn, record: Record) -> str:
    """At the end of each step a tool is where it was to go, or the mount of its springs is."""
    h = record.history
    last = {name: k for k, name in enumerate(record.steps)}
    if [s.name for s in record.problem.steps] != list(dict.fromkeys(record.steps)):
        return f"steps {list(dict.fromkeys(record.steps))} were made of {[s.name for s in record.problem.steps]}"
    for step in record.problem.steps:
        for name, asked in step.move.items():
            for key, column in (*((a, f"u{a}") for a in XYZ), *((f"r{a}", f"r{a}") for a in XYZ)):
                value, found = getattr(asked, key), h[f"{name}.{column}"] - _sprung(record, name, key)
                if value is not None and abs(found[last[step.name]] - value) > REACHED * max(np.abs(found).max(), abs(value)):
                    return f"step {step.name!r}: {name}.{column} is {found[last[step.name]]:.6g} where {value:.6g} was asked"
        for name, asked in step.push.items():
            largest = max(float(np.abs(h[f"{name}.f{a}"]).max()) for a in XYZ)
            for key, column, of in (*((a, f"f{a}", 1.0) for a in XYZ), *((f"m{a}", f"m{a}", size_of(record)) for a in XYZ)):
                value, found = getattr(asked, key), h[f"{name}.{column}"]
                if value is not None and abs(found[last[step.name]] + value) > REACHED * largest * of:
                    return f"step {step.name!r}: {name}.{column} is {found[last[step.name]]:.6g} where {-value:.6g} was asked"
    return ""


def _springs(record: Record, name: str) -> dict[str, float]:
    """Stiffness of the springs of a tool by axis, x … rz."""
    given = record.problem.tools[name].spring
    keys = (*XYZ, *(f"r{a}" for a in XYZ)) if given is not None else ()
    return {key: float(k) for key in keys if (k := getattr(given, key)) is not None}


def _sprung(record: Record, name: str, key: str) -> Array:
    """By how much (k,) a tool is farther along, or turned more about, an axis than the mount of its spring there."""
    column = f"{name}.f{key}" if key in XYZ else f"{name}.m{key[1]}"
    stiffness = _springs(record, name).get(key, np.inf)
    return np.asarray(record.history[column] / stiffness)


def energy(d: Drawn, record: Record) -> str:
    """Dissipation never falls, work is that of forces and paths, and what is stored and dissipated is about that work.

    Less what F-bar elements take up where their pressure works on another change of volume than that of their middle, and what
    a jump to another equilibrium has set free, or where a force turned round.
    """
    h = record.history
    parts = ("external", "elastic", "plastic", "friction", "contact")
    whole = max(float(np.abs(h[f"energy.{e}"]).max()) for e in parts)
    for e in ("plastic", "friction"):
        if (fall := -np.diff(h[f"energy.{e}"], prepend=0.0).min()) > WORK * whole:
            return f"{e} work falls by {fall:.2e} of {whole:.2e}"
    work, air = np.zeros(len(h["time"])), np.zeros(len(h["time"]))
    for name in record.problem.tools:
        own = _work(record, name)
        work, air = work - np.cumsum(own), air + np.cumsum(np.where(_lands(record, name), np.abs(own), 0.0))
        stored = [0.5 * k * _sprung(record, name, key) ** 2 for key, k in _springs(record, name).items()]
        work = work + np.sum([np.zeros(len(work)), *stored], axis=0)
    if loads_in_space.names_of(record.problem):
        work = work + np.cumsum(loads_in_space.done(record))
    more = np.where(gone(record), 0.0, work - h["energy.external"])
    if (off := np.maximum(-more, more - air).max()) > WORK * whole:
        return f"external work is {off:.2e} off forces times paths, {whole:.2e}"
    work, *kept = (np.diff(h[f"energy.{e}"], prepend=0.0) for e in parts)
    missed, between = work - np.sum(kept, axis=0), _turned_round(record)
    missed = missed - np.clip(missed, -between, between)
    rest = min(abs(missed.sum()), abs(missed.sum() - uneven_work(record))) - set_free(work, missed)
    return f"stored and dissipated energies are {rest / whole:.0%} off the work" if rest > OPEN_WORK * whole else ""


def _pairs(record: Record, name: str) -> Iterator[tuple[Array, Array, Array]]:
    """Forces and moments on a tool at the beginning and at the end of each increment (k,), and its ways, axis by axis."""
    h = record.history
    ways = [np.diff(h[f"{name}.u{a}"], prepend=0.0) for a in XYZ] + list(_turns(record, name).T)
    for column, way in zip(("fx", "fy", "fz", "mx", "my", "mz"), ways):
        force = np.append(0.0, h[f"{name}.{column}"])
        yield force[:-1], force[1:], way


def _work(record: Record, name: str) -> Array:
    """Forces and moments on a tool times its ways in each increment (k,), of both ends the mean."""
    return np.sum([0.5 * (before + after) * way for before, after, way in _pairs(record, name)], axis=0)


def _turned_round(record: Record) -> Array:
    """By how much work (k,) may be off means of both ends where forces have turned round in between, nobody knows when."""
    found = [
        np.where(before * after < 0.0, 0.5 * np.abs((after - before) * way), 0.0)
        for name in record.problem.tools
        for before, after, way in _pairs(record, name)
    ]
    return np.asarray(np.sum(found, axis=0))


def _turns(record: Record, name: str) -> Array:
    """Rotation vectors (k, 3) about axes in space by which a tool turned in each increment."""
    out, before = np.zeros((len(record.steps), 3)), np.eye(3)
    for row in range(len(out)):
        now = stands(record, name, row)
        dR = now @ before.T
        twice = np.array([dR[2, 1] - dR[1, 2], dR[0, 2] - dR[2, 0], dR[1, 0] - dR[0, 1]])  # 2 sin of the angle, along the axis
        size = float(np.linalg.norm(twice))
        out[row] = twice * (np.arctan2(size, np.trace(dR) - 1.0) / size if size > 0.0 else 0.5)
        before = now
    return out


def _lands(record: Record, name: str) -> Flags:
    """Increments (k,) in which a pushed tool first touches: the history has both ends of its way through air alone."""
    area = sum((record.history[f"{c.name}.area"] for c in record.problem.contacts if c.against == name), np.zeros(1))
    pushed = {step.name for step in record.problem.steps if name in step.push}
    return np.asarray((area > 0) & (np.append(0.0, area[:-1]) == 0) & [step in pushed for step in record.steps])


# ------------------------------------------------------------------------------------------------------------------- volume


def elements(d: Drawn, record: Record) -> str:
    """Every brick or tetrahedron has a volume."""
    for number, shapes in record.bodies.items():
        for body, s in shapes.items():
            if (volumes(s.cells, s.x) <= 0).any():
                return f"increment {number}: an element of {body} has no volume"
    return ""


def flow_stress(flow: Any, strain: Array) -> Array:
    """Of the drawn metals, by the formulas of Swift and Voce, or linear."""
    if flow.type == "swift":
        return np.asarray(flow.K * (flow.e0 + strain) ** flow.n)
    if flow.type == "voce":
        return np.asarray(flow.s0 + flow.Q * (1.0 - np.exp(-flow.b * strain)))
    return np.asarray(flow.s0 + flow.H * strain)


def yielding(d: Drawn, record: Record) -> str:
    """No point is stressed above the flow stress of its plastic strain, which never falls."""
    before: dict[str, Array] = {}
    for number, shapes in record.bodies.items():
        for name, s in shapes.items():
            material = record.problem.bodies[name].material
            if material.type != "j2":
                continue
            if s.stress is None or s.plastic is None:
                return "no stresses at the integration points were written"
            xx, yy, zz, *shear = np.moveaxis(s.stress, -1, 0)
            mises = np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * sum(v**2 for v in shear))
            over = mises / flow_stress(material.flow, s.plastic) - 1.0
            if over.max() > YIELD:
                return f"increment {number}: a point of {name} is stressed {over.max():.1e} above its flow stress"
            if (s.plastic < before.get(name, 0.0) - YIELD).any():
                return f"increment {number}: the plastic strain of {name} has fallen"
            before[name] = s.plastic
    return ""


def hourglass(s: Shape) -> Array:
    """Squares (m,) of the strains that vary within bricks: A⁻¹h of x = A ξ + h ξη + …, without the h that they began with."""
    X, x = (v[s.cells] - v[s.cells].mean(axis=1, keepdims=True) for v in (s.X, s.x))
    F = deformation(s.cells, s.X, s.x)
    A = F @ np.einsum("mai,aj->mij", X, BRICK_SIGNS) / 8
    xi, eta, zeta = BRICK_SIGNS.T
    modes = np.stack([xi * eta, eta * zeta, zeta * xi, xi * eta * zeta])
    h = np.einsum("mai,ka->mik", x - np.einsum("mij,maj->mai", F, X), modes) / 8
    return np.asarray((np.linalg.solve(A, h) ** 2).sum(axis=(1, 2)))


def uneven(s: Shape) -> float:
    """Volume of the body from its integration points, which know no better, less what it is, relative."""
    V0, V = (float(volumes(s.cells, x).sum()) for x in (s.X, s.x))
    return abs(known_volume(s.cells, s.X, s.x) - V) / V0


def set_free(work: Array, missed: Array) -> float:
    """Energy that was stored and is lost in increments on which next to no work was done: jumps, which can only lose some.

    ``work`` (k,) of the increments, and how much of it ``missed`` (k,) what was stored and dissipated.
    """
    return float(missed[(missed > 0.0) & (np.abs(work) < JUMP * np.abs(work - missed))].sum())


def uneven_work(record: Record) -> float:
    """Work of the mean pressure of bricks on what their volumes change by and the middle of them knows nothing of."""
    out: float = 0.0
    before: dict[str, tuple[Array, Array]] = {}
    for _, shapes in sorted(record.bodies.items()):
        for name, s in shapes.items():
            if s.stress is None or s.cells.shape[1] != len(BRICK_SIGNS):
                continue
            p = s.stress[..., :3].mean(axis=(1, 2))
            off = volumes(s.cells, s.x) - np.linalg.det(deformation(s.cells, s.X, s.x)) * volumes(s.cells, s.X)
            p_then, off_then = before.get(name, (np.zeros_like(p), np.zeros_like(off)))
            out += float((0.5 * (p + p_then) * (off - off_then)).sum())
            before[name] = p, off
    return out


def volume(d: Drawn, record: Record) -> str:
    """The volume of a body has changed by what the forces on it say: ∫ tr σ dV = Σ f·x (virial theorem)."""
    if d.E == 0.0:
        return ""
    rows, released = {int(v): k for k, v in enumerate(record.history["increment"])}, _released(record)
    pressed: dict[int, float] = {}
    for row, _, t in touchings(d, record):
        pressed[row] = pressed.get(row, 0.0) + float((t.force * t.x).sum())
    for n, shapes in record.bodies.items():
        if len(shapes) > 1:
            return ""
        for body, s in shapes.items() if not released[rows[n]] else ():
            virial = pressed.get(rows[n], 0.0) + float(((s.reaction + loads_in_space.applied(record, n)[body]) * s.x).sum())
            V0, V = (float(volumes(s.cells, x).sum()) for x in (s.X, s.x))
            per = (1 - 2 * d.nu) / d.E / V
            stretch = np.linalg.svd(deformation(s.cells, s.X, s.x), compute_uv=False)
            strain = np.abs(np.log(np.maximum(stretch, 1e-12))).max(axis=1)
            second = 3.0 * float((strain**2).mean()) * (1 - 2 * d.nu if d.strength == 0 else 0.0)
            second += 3.0 * (per * V * d.strength) ** 2 + 2.0 * uneven(s)
            if record.problem.bodies[body].element == "h8_enhanced":
                second += ENHANCED * float(np.average(hourglass(s), weights=volumes(s.cells, s.X)))
            off, allowed = V / V0 - 1 - per * virial, 0.1 * per * abs(virial) + second + 1e-9
            if abs(off) > allowed:
                return (
                    f"increment {n}: the volume of {body} has changed by {V / V0 - 1:.2e}, its forces say {per * virial:.2e} "
                    f"± {allowed:.1e}"
                )
    return ""
