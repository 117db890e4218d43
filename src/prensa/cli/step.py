"""``prensa import part.step``: the mesh of a body that was drawn elsewhere, and a case that presses it."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from prensa.cli.voice import Voice
from prensa.precision import DRAWN
from prensa.types import Index

if TYPE_CHECKING:
    from prensa.mesh.bricks import BrickMesh

STEP_CASE = """\
# From {part}, meshed by gmsh; change what is pressed, and by how much. 'prensa check' lists the names of sides.
name: {name}
units: {{length: mm, force: N}}
space: solid
bodies:
{bodies}{ties}
tools: {{plate: {{type: plane, touching: {pressed}}}}}
contacts: [{{surface: {pressed}, against: plate, friction: {{mu: 0.1}}}}]
fixed: {{{held}}}
steps: [{{name: press, by: {{plate: {{{axis}: {way:.6g}}}}}, increments: 4}}]
"""
BODY = "  {body}: {{mesh: {{type: file, path: {mesh}{part}, unit: mm}}, material: {{type: elastic, E: 210 GPa, nu: 0.3}}}}"


def mesh_step(
    part: Path, out: Path | None, size: float | None, around: float | None, hexahedra: bool, voice: Voice
) -> None:  # fmt: skip
    """Write the mesh of the body of a STEP file, with what there is to say of it, and a case beside it if ``out`` is one.

    If ``out`` is an STL file, it is a tool: the triangles of its faces alone.

    Raises
    ------
    PrensaError
        If something is missing, a file exists, or the body cannot be meshed.

    """
    from prensa.errors import PrensaError
    from prensa.importers.deck import FileError
    from prensa.importers.step import meshed
    from prensa.mesh.bricks import BrickMesh
    from prensa.mesh.faces import enclosed_volume
    from prensa.mesh.generate import mesh_of
    from prensa.mesh.quality import quality
    from prensa.model.meshes import File

    if out is not None and out.suffix.lower() == ".stl":
        _write_tool(part, out, size, around, voice)
        return
    if size is None or out is None or out.suffix.lower() not in (".msh", ".yaml", ".yml"):
        raise PrensaError(
            f"{part}: give the size of its elements and the file to write, the mesh as in --size 2 --out {part.stem}.msh, or a "
            f"case with it as in --size 2 --out {part.stem}.yaml; of a tool its triangles, --out {part.stem}.stl"
        )
    target = out.with_suffix(".msh")
    for file in {out, target}:
        if file.exists():
            raise PrensaError(f"{file} exists; name another file")
    try:
        text, drawn = meshed(part, size, (24 if hexahedra else 12) if around is None else around, hexahedra)
        target.write_text(text, encoding="utf-8")
        parts = [(f"volume-{k}",) for k in drawn] if len(drawn) > 1 else [()]
        made = [mesh_of(File(str(target), part), dimension=3) for part in parts]
    except FileError as error:
        raise PrensaError(f"{part}: {error}") from None
    except PrensaError as error:
        target.unlink()
        raise PrensaError(f"{part}: gmsh's mesh cannot be computed with ({error}); another --size may do better") from None
    meshes = [mesh for mesh in made if isinstance(mesh, BrickMesh)]  # of solids there are no others
    for name, mesh, volume in zip(parts, meshes, drawn.values()):
        share = f"{100 * enclosed_volume(mesh.points, mesh.boundary) / volume:.4g} % of the drawn volume"
        said = f"{len(mesh.cells)} elements, {len(mesh.points)} nodes, {share}; {quality(mesh).line()}"
        for note in (said, *mesh.notes):
            voice.confirm(f"{target}: {''.join(f'{n}: ' for n in name)}{note}")
    a_part = ", part: volume-…" if len(drawn) > 1 else ""
    voice.confirm(f"{target} written, in mm: mesh: {{type: file, path: {target}{a_part}, unit: mm}} in 'space: solid'")
    if out != target:
        out.write_text(_case(part, target, [f"volume-{k}" for k in drawn], meshes), encoding="utf-8")
        voice.confirm(f"{out} written; read it, then: prensa run {out}")
    voice.give({
        "mesh": target, "elements": sum(len(m.cells) for m in meshes), "nodes": sum(len(m.points) for m in meshes),
        "sides": [side for m in meshes for side in m.edges], **({"case": out} if out != target else {}),
    })  # fmt: skip


def _write_tool(part: Path, out: Path, size: float | None, around: float | None, voice: Voice) -> None:
    """Write the faces of a STEP file as the triangles of a tool."""
    from prensa.errors import PrensaError
    from prensa.importers.deck import FileError
    from prensa.importers.step import tessellated

    if out.exists():
        raise PrensaError(f"{out} exists; name another file")
    try:
        text = tessellated(part, size, 36 if around is None else around)
    except FileError as error:
        raise PrensaError(f"{part}: {error}") from None
    out.write_text(text, encoding="utf-8")
    voice.confirm(f"{out} written, in mm: {text.count('endfacet')} triangles; tool: {{type: stl, file: {out}, unit: mm}}")
    voice.give({"tool": out, "triangles": text.count("endfacet")})


def _case(part: Path, mesh_file: Path, volumes: list[str], meshes: list[BrickMesh]) -> str:
    """A case of ``volumes`` that holds the lowest sides of bodies and presses the highest one by a thousandth of their extent.

    Of several bodies, the sides on which they lie on each other are ties in a comment: which of them are joined no drawing says.

    Raises
    ------
    PrensaError
        If no two opposite sides are found by place.

    """
    from prensa.errors import PrensaError

    names = [f"part{k}" for k in range(1, len(meshes) + 1)] if len(meshes) > 1 else ["part"]
    ranges = np.array([(m.points.min(axis=0), m.points.max(axis=0)) for m in meshes])
    for axis, low, high in (("y", "bottom", "top"), ("x", "left", "right"), ("z", "back", "front")):
        k = "xyz".index(axis)
        first, last = int(np.argmin(ranges[:, 0, k])), int(np.argmax(ranges[:, 1, k]))
        if low in meshes[first].edges and high in meshes[last].edges:
            height = float(ranges[last, 1, k] - ranges[first, 0, k])
            break
    else:
        sides = [f"{name}.{side}" for name, m in zip(names, meshes) for side in m.edges]
        raise PrensaError(
            f"{mesh_file} is written, but no case: no two opposite sides were found by place that could be held and pressed; "
            f"name sides of it ({', '.join(sides[:8])}) in a case of your own"
        )
    stands = ranges[:, 0, k] - ranges[first, 0, k] < DRAWN * height
    held = ", ".join(f"{name}.{low}: xyz" for name, mesh, on in zip(names, meshes, stands) if on and low in mesh.edges)
    bodies = "\n".join(
        BODY.format(body=name, mesh=mesh_file.name, part=f", part: {volume}" * (len(meshes) > 1))
        for name, volume in zip(names, volumes)
    )
    return STEP_CASE.format(
        part=part.name, name=part.stem, bodies=bodies, ties=_ties(names, meshes), held=held, pressed=f"{names[last]}.{high}",
        axis=axis, way=-1e-3 * height,
    )  # fmt: skip


def _ties(names: list[str], meshes: list[BrickMesh]) -> str:
    """Lines of comment with the ties of sides that lie on another body; nothing of one body."""
    if len(meshes) == 1:
        return ""
    found = []
    for (a, one), (b, other) in combinations(zip(names, meshes), 2):
        joined = [
            f"{{slave: {slave}.{own}, master: {master}.{its}}}"
            for slave, x, master, y in ((a, one, b, other), (b, other, a, one))
            for own, its in [_lying_on(x, y)] if own
        ]  # fmt: skip
        found += joined[:1]
    if not found:
        return "\n# No side of a body lies on another one all over: join those that belong together with 'ties'."
    return f"\n# Bodies that lie on each other are not joined yet: keep the ties that are meant.\n# ties: [{', '.join(found)}]"


def _lying_on(one: BrickMesh, other: BrickMesh) -> tuple[str, str]:
    """The largest side of a body that lies on another one all over, and the side there that is nearest; empty without any."""
    from prensa.checks.thresholds import TOUCHING_DEPTH
    from prensa.mesh.faces import nearest_on_faces

    def off(nodes: Index, faces: Index) -> float:
        return float(nearest_on_faces(one.points[nodes], other.points, faces).max())

    corners = one.points[one.boundary[:, :3]]
    near = TOUCHING_DEPTH * float(np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1).min())
    on = [(len(one.edges[side]), side) for side in one.edges if off(np.unique(one.edges[side]), other.boundary) <= near]
    if not on:
        return "", ""
    own = max(reversed(on), key=lambda found: found[0])[1]  # names by place are behind the numbers
    nodes = np.unique(one.edges[own])
    return own, min(reversed(list(other.edges)), key=lambda side: off(nodes, other.edges[side]))
