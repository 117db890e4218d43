"""``prensa import part.step``: the mesh of a body that was drawn elsewhere, and a case that presses it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from prensa.cli.voice import Voice

if TYPE_CHECKING:
    from prensa.mesh.mesh import Mesh

STEP_CASE = """\
# From {part}, meshed by gmsh; change what is pressed, and by how much. 'prensa check' lists the names of sides.
name: {name}
units: {{length: mm, force: N}}
space: solid
bodies:
  part: {{mesh: {{type: file, path: {mesh}, unit: mm}}, material: {{type: elastic, E: 210 GPa, nu: 0.3}}}}
tools: {{plate: {{type: plane, touching: part.{pressed}}}}}
contacts: [{{surface: part.{pressed}, against: plate, friction: {{mu: 0.1}}}}]
fixed: {{part.{held}: xyz}}
steps: [{{name: press, by: {{plate: {{{axis}: {way:.6g}}}}}, increments: 4}}]
"""


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
        meshes = [mesh_of(File(str(target), part), dimension=3) for part in parts]
    except FileError as error:
        raise PrensaError(f"{part}: {error}") from None
    except PrensaError as error:
        target.unlink()
        raise PrensaError(f"{part}: gmsh's mesh cannot be computed with ({error}); another --size may do better") from None
    for name, mesh, volume in zip(parts, meshes, drawn.values()):
        assert isinstance(mesh, BrickMesh)
        share = f"{100 * enclosed_volume(mesh.points, mesh.boundary) / volume:.4g} % of the drawn volume"
        said = f"{len(mesh.cells)} elements, {len(mesh.points)} nodes, {share}; {quality(mesh).line()}"
        for note in (said, *mesh.notes):
            voice.confirm(f"{target}: {''.join(f'{n}: ' for n in name)}{note}")
    a_part = ", part: volume-…" if len(drawn) > 1 else ""
    voice.confirm(f"{target} written, in mm: mesh: {{type: file, path: {target}{a_part}, unit: mm}} in 'space: solid'")
    if out != target:
        out.write_text(_case(part, target, meshes), encoding="utf-8")
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


def _case(part: Path, mesh_file: Path, meshes: list[Mesh]) -> str:
    """A case that holds one side of a body and presses the opposite one by a thousandth of the body's extent.

    Raises
    ------
    PrensaError
        If there are several bodies, or no two opposite sides are found by place.

    """
    from prensa.errors import PrensaError

    mesh, *others = meshes
    if others:
        raise PrensaError(
            f"{mesh_file} is written, but no case: {part} has {len(meshes)} solids; write a body of each into your own case, "
            "and tie them"
        )
    for axis, (held, pressed) in (("y", ("bottom", "top")), ("x", ("left", "right")), ("z", ("back", "front"))):
        if held in mesh.edges and pressed in mesh.edges:
            way = -1e-3 * mesh.extent["xyz".index(axis)]
            break
    else:
        raise PrensaError(
            f"{mesh_file} is written, but no case: no two opposite sides were found by place that could be held and pressed; "
            f"name sides of it ({', '.join(list(mesh.edges)[:8])}) in a case of your own"
        )
    return STEP_CASE.format(
        part=part.name, name=part.stem, mesh=mesh_file.name, held=held, pressed=pressed, axis=axis, way=way
    )
