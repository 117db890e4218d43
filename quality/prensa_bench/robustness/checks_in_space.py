"""Checks of the files of a run in space by plain geometry and statics: nothing here is shared with the solver.

As `prensa_bench.robustness.checks` in the plane: every check answers '' or, in words, what is wrong. Forces at nodes are the
pressures of the contact tables times tributary areas of the deformed faces along normals of the tools' own formulas, with the
tangential part of the forces of the tables, which must lie in the cone.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import prensa as pr
from prensa.types import Array, Index
from prensa_bench.robustness.checks import (
    DEEP,
    DEEP_BY_PRESSURE,
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
OPEN_WORK = 0.15  # of the work: what an increment's path leaves open between work and stored and dissipated energies
BRICK_SIDES = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))  # of a brick
TETRAHEDRA = ((0, 1, 3, 4), (1, 2, 3, 6), (4, 6, 5, 1), (4, 7, 6, 3), (1, 3, 4, 6))  # of a brick
BRICK_SIGNS = np.array([(a, b, c) for c in (-1.0, 1.0) for a, b in ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))])
GAUSS_PLACE = 0.5 / np.sqrt(3.0)  # of a side, from its middle


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
        for check in (outlines, cone, balance, moments, driven, energy, elements, volume):
            if found := check(d, record):
                return found
    return next((found for claim in d.claims if (found := claim(records[-1]))), "")


# ---------------------------------------------------------------------------------------------------------------- geometry


def seen_by(tool: Placed, name: str, record: Record, row: int, x: Array) -> tuple[Array, Array]:
    """Signed distance (k,) of points to a tool where the history says that it is, and outward normals (k, 3)."""
    h = record.history
    R = turn(np.array([h[f"{name}.r{a}"][row] for a in XYZ]))
    gap, n = tool.outline((x - np.asarray(tool.at) - [h[f"{name}.u{a}"][row] for a in XYZ]) @ R)
    return gap, n @ R.T


def turn(v: Array) -> Array:
    """The rotation (3, 3) about a vector (3,) by its length (Rodrigues)."""
    angle = float(np.linalg.norm(v))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = v / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K)


def outer_faces(cells: Index) -> Index:
    """Faces (b, 4) that belong to one brick only."""
    faces = np.concatenate([cells[:, side] for side in BRICK_SIDES])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


def tributary(faces: Index, x: Array) -> Array:
    """∫ N dΓ (n,) of the nodes of bilinear faces of a shape x (n, 3), by four Gauss points a face."""
    area = np.zeros(len(x))
    a, b, c, d = (x[faces[:, k]] for k in range(4))
    for s in (0.5 - GAUSS_PLACE, 0.5 + GAUSS_PLACE):
        for t in (0.5 - GAUSS_PLACE, 0.5 + GAUSS_PLACE):
            along, across = (1 - t) * (b - a) + t * (c - d), (1 - s) * (d - a) + s * (c - b)
            piece = 0.25 * np.linalg.norm(np.cross(along, across), axis=1)
            for node, share in zip(faces.T, ((1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t)):
                np.add.at(area, node, share * piece)
    return area


def _beside(faces: Index, x: Array) -> Array:
    """Length (n,) of the longest edge of a face at a node."""
    out = np.zeros(len(x))
    longest = np.linalg.norm(np.roll(x[faces], -1, axis=1) - x[faces], axis=2).max(axis=1)
    for node in faces.T:
        np.maximum.at(out, node, longest)
    return out


def touchings(d: Drawn, record: Record) -> Iterator[tuple[int, pr.Contact, Touching]]:
    """Row of the history, description and own view of every contact table, in the order of time."""
    shape = next(iter(record.bodies.values()))
    faces = {name: outer_faces(s.cells) for name, s in shape.items()}
    for row, number in enumerate(record.history["increment"].astype(int)):
        for c in record.problem.contacts:
            t = record.contacts[c.name][number]
            body = c.surface[0].partition(".")[0]
            nodes, x = t["node"].astype(np.int64), np.zeros_like(shape[body].X)
            x[nodes] = np.stack([t[a] for a in XYZ], axis=1)
            own = faces[body][np.isin(faces[body], nodes).all(axis=1)]
            gap, n = seen_by(d.tools[c.against], c.against, record, row, x[nodes])
            force = np.stack([t[f"force_{a}"] for a in XYZ], axis=1)
            yield row, c, Touching(nodes, x[nodes], gap, n, tributary(own, x)[nodes], force, _beside(own, x)[nodes])


def outlines(d: Drawn, record: Record) -> str:
    """Gaps are what they are said to be, no node lies inside a tool, no pressure across a gap."""
    size, E = size_of(record), d.E or min(body.material.modulus for body in d.problem.bodies.values())
    for row, c, t in touchings(d, record):
        table = record.contacts[c.name][int(record.history["increment"][row])]
        at, p = f"time {record.history['time'][row]:.4g}: {c.name}", table["pressure"]
        near = np.isfinite(table["gap"]) & (np.abs(t.gap) < 0.5 * t.size)
        if near.any() and (off := float(np.abs(table["gap"] - t.gap)[near].max())) > SAME_GAP * size:
            return f"{at}: a gap is {off:.2g} off the distance of its node to the tool"
        if (p < 0).any():
            return f"{at}: negative pressure"
        allowed = DEEP * t.size + DEEP_BY_PRESSURE * np.maximum(p, 0.0) / E * t.size
        if (t.gap < -allowed).any():
            k = int(np.argmin(t.gap + allowed))
            return f"{at}: node {t.nodes[k]} lies {-t.gap[k]:.3g} inside the tool"
        if (t.gap[p > 0] > SAME_GAP * size).any():
            return f"{at}: pressure across an open gap of {t.gap[p > 0].max():.3g}"
    return bodies_outside(d.tools, record, outer_faces, _beside, seen_by)


# ------------------------------------------------------------------------------------------------------------------ statics


def cone(d: Drawn, record: Record) -> str:
    """Normal parts of forces are pressures times areas, the rest lies in the cone of the coefficient of friction."""
    for row, c, t in touchings(d, record):
        table, at = record.contacts[c.name][int(record.history["increment"][row])], f"time {record.history['time'][row]:.4g}"
        normal = (t.force * t.normal).sum(axis=1)
        whole = float(np.abs(normal).max(initial=0.0))
        if (off := np.abs(normal - t.area * table["pressure"])).max(initial=0.0) > FORCE_AND_AREA * whole:
            return f"{at}: {c.name}: the force of a node is {off.max() / whole:.1e} off its pressure times its area"
        sideways = np.linalg.norm(t.force - normal[:, None] * t.normal, axis=1)
        if (over := sideways - d.mu[c.name] * normal).max(initial=0.0) > BEYOND_CONE * whole:
            return f"{at}: {c.name}: friction is {over.max() / whole:.1e} of the largest force above its bound"
        if (off := np.abs(sideways - t.area * np.abs(table["shear"]))).max(initial=0.0) > FORCE_AND_AREA * whole:
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
    allowed = FORCES * largest + FORCES_WHOLE * largest.max()
    sums = {f"forces at the nodes miss that on {name} by": nodal[name] + f for name, f in tool.items()}
    sums["tools and supports are out of balance by"] = sum(tool.values()) - held
    for words, rest in sums.items():
        off = np.abs(rest).max(axis=1)
        if (off > allowed).any():
            k = int(np.argmax(off / np.maximum(allowed, 1e-300)))
            return f"time {h['time'][k]:.4g}: {words} {off[k] / largest[k]:.1e}"
    return ""


def moments(d: Drawn, record: Record) -> str:
    """Three moments about the origin: nodal contact forces against each tool, and all tools against the reactions at nodes."""
    h, size = record.history, size_of(record)
    on_tool = {t: np.zeros((len(h["time"]), 3)) for t in record.problem.tools}
    for row, c, t in touchings(d, record):
        on_tool[c.against][row] += np.cross(t.x, t.force).sum(axis=0)
    told, force = {}, np.zeros(len(h["time"]))
    for name in on_tool:
        u, f, m = (np.stack([h[f"{name}.{key}{a}"] for a in XYZ], axis=1) for key in "ufm")
        told[name] = m + np.cross(np.asarray(d.tools[name].at) + u, f)
        force = np.maximum(force, np.linalg.norm(f, axis=1))
    reach = max([size, *(float(np.linalg.norm(d.tools[t].at)) for t in on_tool)])
    largest = np.maximum.accumulate(force)
    allowed = (MOMENTS * largest + FORCES_WHOLE * largest.max()) * reach
    for name in on_tool:
        off = np.abs(on_tool[name] + told[name]).max(axis=1)
        if (off > allowed).any():
            k = int(np.argmax(off / np.maximum(allowed, 1e-300)))
            return f"time {h['time'][k]:.4g}: moments at the nodes miss that on {name} by {off[k] / (largest[k] * reach):.1e}"
    rows = {int(v): k for k, v in enumerate(h["increment"])}
    for number, shapes in record.bodies.items():
        k = rows[number]
        held = sum(np.cross(s.x, s.reaction).sum(axis=0) for s in shapes.values())
        if (off := np.abs(sum(m[k] for m in told.values()) - held).max()) > allowed[k]:
            return f"time {h['time'][k]:.4g}: moments of tools and supports differ by {off / (largest[k] * reach):.1e}"
    return ""


def driven(d: Drawn, record: Record) -> str:
    """At the end of each step a tool is where it was to go."""
    h = record.history
    last = {name: k for k, name in enumerate(record.steps)}
    if [s.name for s in record.problem.steps] != list(dict.fromkeys(record.steps)):
        return f"steps {list(dict.fromkeys(record.steps))} were made of {[s.name for s in record.problem.steps]}"
    for step in record.problem.steps:
        for name, asked in step.move.items():
            for key, column in (*((a, f"u{a}") for a in XYZ), *((f"r{a}", f"r{a}") for a in XYZ)):
                value, found = getattr(asked, key), h[f"{name}.{column}"]
                if value is not None and abs(found[last[step.name]] - value) > REACHED * max(np.abs(found).max(), abs(value)):
                    return f"step {step.name!r}: {name}.{column} is {found[last[step.name]]:.6g} where {value:.6g} was asked"
    return ""


def energy(d: Drawn, record: Record) -> str:
    """Dissipation never falls, work is that of forces and paths, and what is stored and dissipated is about that work."""
    h = record.history
    parts = ("external", "elastic", "plastic", "friction", "contact")
    whole = max(float(np.abs(h[f"energy.{e}"]).max()) for e in parts)
    for e in ("plastic", "friction"):
        if (fall := -np.diff(h[f"energy.{e}"], prepend=0.0).min()) > WORK * whole:
            return f"{e} work falls by {fall:.2e} of {whole:.2e}"
    work = np.zeros(len(h["time"]))
    for name in record.problem.tools:
        for key in ("u", "r"):
            for a in XYZ:
                force, way = (np.append(0.0, h[f"{name}.{c}{a}"]) for c in ("f" if key == "u" else "m", key))
                work -= np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(way))
    if (off := np.abs(work - h["energy.external"]).max()) > WORK * whole:
        return f"external work is {off:.2e} off forces times paths, {whole:.2e}"
    rest = abs(h["energy.external"][-1] - sum(h[f"energy.{e}"][-1] for e in parts[1:]))
    return f"stored and dissipated energies are {rest / whole:.0%} off the work" if rest > OPEN_WORK * whole else ""


# ------------------------------------------------------------------------------------------------------------------- volume


def volumes(cells: Index, x: Array) -> Array:
    """Volumes (m,) of bricks: the mean of two ways to cut them into five tetrahedra, which is that of the trilinear brick."""
    out = np.zeros(len(cells))
    for turned in (cells, cells[:, [1, 2, 3, 0, 5, 6, 7, 4]]):
        for corners in TETRAHEDRA:
            a, b, c, e = (x[turned[:, k]] for k in corners)
            out += np.einsum("mi,mi->m", np.cross(b - a, c - a), e - a) / 12.0
    return out


def elements(d: Drawn, record: Record) -> str:
    """Every brick has a volume."""
    for number, shapes in record.bodies.items():
        for body, s in shapes.items():
            if (volumes(s.cells, s.x) <= 0).any():
                return f"increment {number}: a brick of {body} has no volume"
    return ""


def deformation(s: Shape) -> Array:
    """Deformation gradients (m, 3, 3) in the middle of bricks."""
    X, x = (np.einsum("mai,aj->mij", v[s.cells], BRICK_SIGNS) for v in (s.X, s.x))
    return np.asarray(x @ np.linalg.inv(X))


def uneven(s: Shape) -> float:
    """Volume of the body from the middles of its bricks less what it is, relative: its integration points know no better."""
    V0 = volumes(s.cells, s.X)
    return float(abs((np.linalg.det(deformation(s)) * V0).sum() - volumes(s.cells, s.x).sum()) / V0.sum())


def volume(d: Drawn, record: Record) -> str:
    """The volume of a body has changed by what the forces on it say: ∫ tr σ dV = Σ f·x (virial theorem)."""
    if d.E == 0.0:
        return ""
    rows = {int(v): k for k, v in enumerate(record.history["increment"])}
    pressed: dict[int, float] = {}
    for row, _, t in touchings(d, record):
        pressed[row] = pressed.get(row, 0.0) + float((t.force * t.x).sum())
    for n, shapes in record.bodies.items():
        if len(shapes) > 1:
            return ""
        for body, s in shapes.items():
            virial = pressed[rows[n]] + float((s.reaction * s.x).sum())
            V0, V = (float(volumes(s.cells, x).sum()) for x in (s.X, s.x))
            per = (1 - 2 * d.nu) / d.E / V
            strain = np.abs(np.log(np.maximum(np.linalg.svd(deformation(s), compute_uv=False), 1e-12))).max(axis=1)
            second = 3.0 * float((strain**2).mean()) * (1 - 2 * d.nu if d.strength == 0 else 0.0)
            second += 3.0 * (per * V * d.strength) ** 2 + 2.0 * uneven(s)
            off, allowed = V / V0 - 1 - per * virial, 0.1 * per * abs(virial) + second + 1e-9
            if abs(off) > allowed:
                return (
                    f"increment {n}: the volume of {body} has changed by {V / V0 - 1:.2e}, its forces say {per * virial:.2e} "
                    f"± {allowed:.1e}"
                )
    return ""
