"""Fields for ParaView: ``fields/NNNN.vtu`` (binary, compressed) and ``fields.pvd``, the list of them in time.

Points are at their **current** positions, so that a file opens as the deformed shape next to the tools; the array
``displacement`` leads back to the initial shape (filter *Warp By Vector*, scale factor −1). All bodies are in one file:
the cell array ``body`` counts them from 0 in the order of the description. Vectors have three components and stresses
six (xx, yy, zz, xy, yz, xz: the order of VTK), also in two dimensions. In axisymmetric problems x is the radius, y the
axis and zz the hoop stress. In space the surfaces of the tools at their current places are in files of their own,
``fields/tools_NNNN.vtu``, second parts of the moments in the list; the cell array ``tool`` counts them.

With ``output: {points: true}`` cells have the values of their integration points too (``stress_at_points``,
``plastic_strain_at_points``, ``damage_NAME_at_points``): one point's components after another's, not a number beyond the last.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from contextlib import suppress
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from prensa.errors import PrensaError, take_path
from prensa.measures.tool_outlines import surface
from prensa.model.problem import Problem
from prensa.output.cells import VTK_IN_SPACE, to_corners, vtk_type
from prensa.output.files import numbered, replacing, write_text
from prensa.result.increment import SLIDING_FIELDS, BodyState, Increment, MaterialPoints
from prensa.types import Array, Index

FIELDS_FOLDER = "fields"
COLLECTION = "fields.pvd"
TOOLS = "tools_"
DAMAGE = "damage_"  # and the name of a law: a field
AT_POINTS = "_at_points"  # of cells: values at their integration points
RATIOS = ("mean_stress", "triaxiality", "lode")
IF_KNOWN = ("strain_rate", "surface_expansion")
ACCUMULATED = ("contact_time", "sliding_distance")
_HEAD = """\
<?xml version="1.0"?>
<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">
  <Collection>
"""
_TAIL = "  </Collection>\n</VTKFile>\n"
_ENTRY = re.compile(r'<DataSet timestep="([^"]+)" group="" part="0" file="([^"]+)" />')


class Fields:
    """Writer of ``fields/NNNN.vtu`` and ``fields.pvd`` in *directory*; *keep* continues, without later increments.

    ``problem``: in space the surfaces of its tools are written too.

    The files are complete, and with the operating system; whoever refers to them brings them to the disk (`files.flush`).
    """

    def __init__(
        self, directory: Path, keep: int | None = None, problem: Problem | None = None, points: bool = False
    ) -> None:  # fmt: skip
        self._directory, self._points = directory, points
        self._problem = problem if problem is not None and problem.space == "solid" else None
        self._times = {} if keep is None else _times_until(directory, keep)
        self._write_collection()

    def append(self, increment: Increment) -> Path:
        """Write the fields of *increment*, then the collection that names them; returns the path of the former."""
        path = write_fields(self._directory / FIELDS_FOLDER / f"{increment.number:04d}.vtu", increment, self._points)
        name = f"{FIELDS_FOLDER}/{path.name}"
        self._times[name] = increment.time
        if self._problem is not None:
            write_tools(path.with_name(f"{TOOLS}{path.name}"), increment, self._problem)
        try:
            with open(
                self._directory / COLLECTION, "rb+"
            ) as file:  # in place: writing all of it again takes ever longer
                file.seek(-len(_TAIL), 2)
                file.write((_entry(self._directory, name, increment.time) + _TAIL).encode())
        except FileNotFoundError:
            self._write_collection()
        return path

    def _write_collection(self) -> None:
        entries = [_entry(self._directory, name, time) for name, time in self._times.items()]
        write_text(self._directory / COLLECTION, "".join([_HEAD, *entries, _TAIL]), durable=False)


def _entry(directory: Path, name: str, time: float) -> str:
    """Of a file of bodies, and of that of the tools where there is one."""
    tools = f"{FIELDS_FOLDER}/{TOOLS}{Path(name).name}"
    files = [name, tools] if (directory / tools).is_file() else [name]
    return "".join(
        f'    <DataSet timestep="{float(time)!r}" group="" part="{k}" file="{file}" />\n' for k, file in enumerate(files)
    )


def write_tools(path: Path, increment: Increment, problem: Problem) -> Path:
    """Write the surfaces of the tools in space at their current places as a ``.vtu`` file; those without end near the bodies."""
    import meshio

    size = max(float(np.ptp(body.x, axis=0).max()) for body in increment.bodies.values())
    made = [surface(tool, increment.tools[name], 2.0 * size) for name, tool in problem.tools.items()]
    offset = np.cumsum([0, *(len(x) for x, _ in made)])
    mesh = meshio.Mesh(
        np.concatenate([np.zeros((0, 3)), *(x for x, _ in made)]),
        [("triangle", np.concatenate([np.zeros((0, 3), dtype=np.int64), *(t + k for (_, t), k in zip(made, offset))]))],
        cell_data={"tool": [np.repeat(np.arange(len(made), dtype=np.int32), [len(t) for _, t in made])]},
    )
    with replacing(path, durable=False) as temporary:
        mesh.write(temporary, file_format="vtu", binary=True, compression="zlib")
    return path


def as_mesh(increment: Increment, points: bool = False) -> Any:
    """All bodies of an increment with their fields, as a `meshio.Mesh`; ``points``: with those at integration points."""
    import meshio

    bodies = list(increment.bodies.values())
    offset = np.cumsum([0, *(len(b.X) for b in bodies)])
    cells = [(vtk_type(b.cells, b.X.shape[1]), b.cells + o) for b, o in zip(bodies, offset)]
    laws = [name for b in bodies for name in b.damage]
    known = [name for name in IF_KNOWN if all(getattr(b, name) is not None for b in bodies)]
    thin = [b.thickness for b in bodies if b.thickness is not None]
    return meshio.Mesh(
        points=_stack(bodies, lambda b: _vector(b.x)),
        cells=cells,
        point_data={
            "displacement": _stack(bodies, lambda b: _vector(b.displacement)),
            "reaction": _stack(bodies, lambda b: _vector(b.reaction)),
            "stress": _stack(bodies, lambda b: np.pad(b.stress, ((0, 0), (0, 6 - b.stress.shape[1])))),
            "mises": _stack(bodies, lambda b: b.mises),
            "plastic_strain": _stack(bodies, lambda b: b.plastic_strain),
            "contact_pressure": _on_surfaces(increment, "pressure"),
            "contact_pressure_from_stress": _on_surfaces(increment, "pressure_from_stress"),
            "contact_pressure_smoothed": _on_surfaces(increment, "pressure_smoothed"),
            "contact_error": _on_surfaces(increment, "error"),
            **{name: _stack(bodies, attrgetter(name)) for name in (*RATIOS, *known)},
            **{name: _on_surfaces(increment, name) for name in SLIDING_FIELDS},
            **({"thickness": np.concatenate(thin)} if thin else {}),
            **{f"{DAMAGE}{name}": _stack(bodies, partial(_damage, name=name)) for name in dict.fromkeys(laws)},
        },
        cell_data={
            "body": [np.full(len(b.cells), k, dtype=np.int32) for k, b in enumerate(bodies)],
            **(_at_points(increment) if points else {}),
        },
    )


def write_fields(path: Path, increment: Increment, points: bool = False) -> Path:
    """Write one increment as a ``.vtu`` file, atomically; returns *path*; ``points``: with values at integration points."""
    mesh = as_mesh(increment, points)
    with replacing(path, durable=False) as temporary:
        mesh.write(temporary, file_format="vtu", binary=True, compression="zlib")
    return path


def read_collection(path: str | Path) -> list[tuple[float, str]]:
    """Pairs (time, file relative to the collection) of the bodies in a ``.pvd`` file; raises PrensaError if it is damaged."""
    path = take_path("read_collection", path)
    try:
        sets = [d for d in ET.parse(path).getroot().iter("DataSet") if d.get("part", "0") == "0"]
        return [(float(d.get("timestep", "nan")), d.get("file", "")) for d in sets]
    except (ET.ParseError, ValueError, OSError) as error:
        raise PrensaError(f"{path}: the collection cannot be read ({error}); run the case again") from None


def read_fields(path: str | Path, names: list[str]) -> dict[str, BodyState]:
    """Bodies, by *names* in the order of the description, of a ``.vtu`` file that `write_fields` wrote.

    Raises
    ------
    PrensaError
        If the file is damaged or does not hold these bodies.

    """
    import meshio

    path = take_path("read_fields", path)
    try:
        mesh = meshio.read(path, file_format="vtu")
        parts = list(zip(mesh.cells, mesh.cell_data["body"]))
        out = {}
        for k, name in enumerate(names):
            cells = np.concatenate([block.data[body == k] for block, body in parts if (body == k).any()]).astype(np.int64)
            own = slice(int(cells.min()), int(cells.max()) + 1)
            out[name] = _body(mesh, cells - own.start, own)
    except (Exception, SystemExit) as error:  # what meshio finds damaged ends the process
        raise PrensaError(f"{path}: the fields cannot be read ({error}); run the case again") from None
    return out


def read_points(path: str | Path, names: list[str]) -> dict[str, MaterialPoints]:
    """Values at the integration points, by *names* of the bodies, of a ``.vtu`` file that `write_fields` wrote.

    Raises
    ------
    PrensaError
        If the file is damaged or has none.

    """
    import meshio

    path = take_path("read_points", path)
    try:
        mesh = meshio.read(path, file_format="vtu")
    except (Exception, SystemExit) as error:  # what meshio finds damaged ends the process
        raise PrensaError(f"{path}: the fields cannot be read ({error}); run the case again") from None
    if f"plastic_strain{AT_POINTS}" not in mesh.cell_data:
        raise PrensaError(f"{path}: no values at integration points were written; 'output: {{points: true}}' writes them")
    data = {n.removesuffix(AT_POINTS): np.concatenate(v) for n, v in mesh.cell_data.items() if n.endswith(AT_POINTS)}
    body = np.concatenate(mesh.cell_data["body"])
    out = {}
    for k, name in enumerate(names):
        strain = data["plastic_strain"][body == k].reshape((body == k).sum(), -1)
        own = ~np.isnan(strain[0])
        stress = data["stress"][body == k].reshape(*strain.shape, -1)[:, own]
        damage = {n.removeprefix(DAMAGE): v[body == k] for n, v in data.items() if n.startswith(DAMAGE)}
        damage = {n: v.reshape(strain.shape)[:, own] for n, v in damage.items()}
        out[name] = MaterialPoints(stress, strain[:, own], {n: v for n, v in damage.items() if not np.isnan(v).any()})
    return out


# ------------------------------------------------------------------------------------------------------------- details
def _at_points(increment: Increment) -> dict[str, list[Array]]:
    """Values at the integration points as fields of the cells, the bodies' cells one after the other."""
    found = list(increment.points.values())
    most, laws = max(p.plastic_strain.shape[1] for p in found), dict.fromkeys(name for p in found for name in p.damage)

    def padded(values: Array, components: int = 1) -> Array:
        flat = values.reshape(len(values), -1)
        return np.pad(flat, ((0, 0), (0, most * components - flat.shape[1])), constant_values=np.nan)

    out = {"stress": [padded(p.stress, p.stress.shape[2]) for p in found]}
    out["plastic_strain"] = [padded(p.plastic_strain) for p in found]
    for name in laws:
        missing = [np.full(p.plastic_strain.shape, np.nan) for p in found]
        out[f"{DAMAGE}{name}"] = [padded(p.damage.get(name, v)) for p, v in zip(found, missing)]
    return {f"{name}{AT_POINTS}": values for name, values in out.items()}


def _body(mesh: Any, cells: Index, own: slice) -> BodyState:
    d = 3 if mesh.cells[0].type in VTK_IN_SPACE.values() else 2
    x, data = np.array(mesh.points[own, :d]), mesh.point_data
    thickness = np.array(data["thickness"][own]) if "thickness" in data else None
    damage = {name: np.array(values[own]) for name, values in data.items() if name.startswith(DAMAGE)}
    return BodyState(
        x - data["displacement"][own, :d], x, cells, np.array(data["reaction"][own, :d]), np.array(data["stress"][own, : 2 * d]),
        np.array(data["mises"][own]), np.array(data["plastic_strain"][own]), thickness,
        {name.removeprefix(DAMAGE): values for name, values in damage.items() if not np.isnan(values).any()},
        *(np.array(data[name][own]) if name in data else None for name in IF_KNOWN),
    )  # fmt: skip


def _damage(body: BodyState, name: str) -> Array:
    """Damage (n,) by a law; not a number in bodies that have it not."""
    return body.damage.get(name, np.full(len(body.X), np.nan))


def _vector(v: Array) -> Array:
    return np.pad(v, ((0, 0), (0, 3 - v.shape[1])))


def _stack(bodies: list[BodyState], values: object) -> Array:
    return np.concatenate([values(b) for b in bodies])  # type: ignore[operator]


def _on_surfaces(increment: Increment, name: str) -> Array:
    """(n,) a nodal value of the contacts where they are closed, the larger where a node touches two tools, else 0.

    What is counted since the beginning stays where a contact has opened.
    """
    out = {body: np.zeros(len(state.X)) for body, state in increment.bodies.items()}
    for contact in increment.contacts.values():
        values = getattr(contact, name)
        if values is not None:
            reached = (contact.status > 0) | (name in ACCUMULATED)
            np.maximum.at(out[contact.body], contact.node, np.where(reached, values, 0.0))
            to_corners(out[contact.body], increment.bodies[contact.body].cells, contact.node)
    return np.concatenate(list(out.values()))


def _times_until(directory: Path, last: int) -> dict[str, float]:
    """Entries of the collection up to increment *last*; the field files of later ones are removed."""
    for number, path in numbered(directory / FIELDS_FOLDER, ".vtu"):
        if number > last:
            path.unlink()
            path.with_name(f"{TOOLS}{path.name}").unlink(missing_ok=True)
    collection = directory / COLLECTION
    text = collection.read_text(encoding="utf-8", errors="replace") if collection.is_file() else ""
    out: dict[str, float] = {}
    for time, name in _ENTRY.findall(text):  # whole ones only: a power cut may have left a later one in pieces
        with suppress(ValueError):  # or what is not a number in its place
            if (directory / name).is_file():
                out[name] = float(time)
    return out
