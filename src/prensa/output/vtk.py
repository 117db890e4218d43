"""Fields for ParaView: ``fields/NNNN.vtu`` (binary, compressed) and ``fields.pvd``, the list of them in time.

Points are at their **current** positions, so that a file opens as the deformed shape next to the tools; the array
``displacement`` leads back to the initial shape (filter *Warp By Vector*, scale factor −1). All bodies are in one file:
the cell array ``body`` counts them from 0 in the order of the description. Vectors have three components and stresses
six (xx, yy, zz, xy, yz, xz: the order of VTK), also in two dimensions. In axisymmetric problems x is the radius, y the
axis and zz the hoop stress.
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
from prensa.output.cells import VTK_IN_SPACE, to_corners, vtk_type
from prensa.output.files import numbered, replacing, write_text
from prensa.result.increment import SLIDING_FIELDS, BodyState, Increment
from prensa.types import Array, Index

FIELDS_FOLDER = "fields"
COLLECTION = "fields.pvd"
DAMAGE = "damage_"  # and the name of a law: a field
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

    The files are complete, and with the operating system; whoever refers to them brings them to the disk (`files.flush`).
    """

    def __init__(self, directory: Path, keep: int | None = None) -> None:
        self._directory = directory
        self._times = {} if keep is None else _times_until(directory, keep)
        self._write_collection()

    def append(self, increment: Increment) -> Path:
        """Write the fields of *increment*, then the collection that names them; returns the path of the former."""
        path = write_fields(self._directory / FIELDS_FOLDER / f"{increment.number:04d}.vtu", increment)
        name = f"{FIELDS_FOLDER}/{path.name}"
        self._times[name] = increment.time
        try:
            with open(
                self._directory / COLLECTION, "rb+"
            ) as file:  # in place: writing all of it again takes ever longer
                file.seek(-len(_TAIL), 2)
                file.write((_entry(name, increment.time) + _TAIL).encode())
        except FileNotFoundError:
            self._write_collection()
        return path

    def _write_collection(self) -> None:
        entries = [_entry(name, time) for name, time in self._times.items()]
        write_text(self._directory / COLLECTION, "".join([_HEAD, *entries, _TAIL]), durable=False)


def _entry(name: str, time: float) -> str:
    return f'    <DataSet timestep="{float(time)!r}" group="" part="0" file="{name}" />\n'


def as_mesh(increment: Increment) -> Any:
    """All bodies of an increment with their fields, as a `meshio.Mesh`."""
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
        cell_data={"body": [np.full(len(b.cells), k, dtype=np.int32) for k, b in enumerate(bodies)]},
    )


def write_fields(path: Path, increment: Increment) -> Path:
    """Write one increment as a ``.vtu`` file, atomically; returns *path*."""
    mesh = as_mesh(increment)
    with replacing(path, durable=False) as temporary:
        mesh.write(temporary, file_format="vtu", binary=True, compression="zlib")
    return path


def read_collection(path: str | Path) -> list[tuple[float, str]]:
    """Pairs (time, file relative to the collection) of a ``.pvd`` file; raises PrensaError if it is damaged."""
    path = take_path("read_collection", path)
    try:
        sets = list(ET.parse(path).getroot().iter("DataSet"))
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


# ------------------------------------------------------------------------------------------------------------- details
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
    collection = directory / COLLECTION
    text = collection.read_text(encoding="utf-8", errors="replace") if collection.is_file() else ""
    out: dict[str, float] = {}
    for time, name in _ENTRY.findall(text):  # whole ones only: a power cut may have left a later one in pieces
        with suppress(ValueError):  # or what is no number in its place
            if (directory / name).is_file():
                out[name] = float(time)
    return out
