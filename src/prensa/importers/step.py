"""Bodies of STEP files meshed by gmsh, which is no part of prensa: it is installed apart, under its own licence.

gmsh fills a body with tetrahedra, whose sides follow its faces in second order ("Mesh.ElementOrder") or which are cut into four
hexahedra each ("Mesh.SubdivisionAlgorithm"; C. Geuzaine & J.-F. Remacle, Gmsh reference manual).
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from prensa.importers import stl
from prensa.importers.deck import FileError
from prensa.model.meshes import MOST_ELEMENTS

STEP_ENDINGS = (".step", ".stp")
TETRAHEDRON, TRIANGLE = 1.0 / (6.0 * math.sqrt(2.0)), math.sqrt(3.0) / 4.0
"""Volume and area of the regular ones with sides of length 1."""
MOST_TRIANGLES = 1_000_000
"""Of a tool: half a minute of meshing, and more than a contact can use."""


def meshed(path: Path, size: float, around: float, hexahedra: bool = False) -> tuple[str, dict[int, float]]:
    """Text of a ``.msh`` file (4.1) of the solids of a STEP file, in tetrahedra of ten nodes or in ``hexahedra``; their volumes.

    Lengths are millimetres, the volumes those of the drawing, by the numbers of the solids.
    ``size``: the largest of their sides; ``around``: how many of them a full turn of a curved face has at least.

    Raises
    ------
    FileError
        If gmsh is not installed, the file cannot be read, or its bodies cannot be meshed.

    """
    if not (math.isfinite(size) and size > 0.0):
        raise FileError(f"the size of its elements is {size:g}; give a length above 0, in mm")
    with _model(path) as gmsh:
        if not (solids := gmsh.model.getEntities(3)):
            raise FileError("there is no solid body in it; export solids, not surfaces (of a tool surfaces do: --out tool.stl)")
        _refuse_too_many(gmsh, 3, size, 1.0 if hexahedra else 1.0 / TETRAHEDRON, "elements", MOST_ELEMENTS)
        # a quarter of a regular tetrahedron has the volume of a cube of the size
        length = (24.0 * math.sqrt(2.0)) ** (1.0 / 3.0) * size if hexahedra else size
        gmsh.option.setNumber("Mesh.MeshSizeMax", length)
        gmsh.model.mesh.setSize(gmsh.model.getEntities(0), length)  # at points, or gmsh takes a tenth of the body
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 0.5 * around if hexahedra else around)
        gmsh.option.setNumber("Mesh.OptimizeNetgen", 1)  # without it some hexahedra are turned over
        if hexahedra:
            gmsh.option.setNumber("Mesh.SubdivisionAlgorithm", 2)
        else:
            gmsh.option.setNumber("Mesh.ElementOrder", 2)
            gmsh.option.setNumber("Mesh.HighOrderOptimize", 2)  # without it some are bent over by their curved faces
        gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
        gmsh.model.mesh.generate(3)
        with tempfile.TemporaryDirectory() as folder:
            made = Path(folder) / "body.msh"
            gmsh.write(str(made))
            return made.read_text(encoding="utf-8"), {t: gmsh.model.occ.getMass(3, t) for _, t in solids}


def tessellated(path: Path, size: float | None, around: float) -> str:
    """Text of an STL file of the faces of a STEP file, in millimetres; of a closed body the normals look outwards.

    ``size``: the largest side of its triangles, if there is one; ``around``: how many a full turn of a curved face has at least.

    Raises
    ------
    FileError
        If gmsh is not installed, the file cannot be read, or its faces bound no tool.

    """
    if size is not None and not (math.isfinite(size) and size > 0.0):
        raise FileError(f"the size of its triangles is {size:g}; give a length above 0, in mm")
    with _model(path) as gmsh:
        if not gmsh.model.getEntities(2):
            raise FileError("there is no face in it; export the body or the side that is the tool")
        if size is not None:
            _refuse_too_many(gmsh, 2, size, 1.0 / TRIANGLE, "triangles", MOST_TRIANGLES)
            gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", around)
        gmsh.model.mesh.generate(2)
        labels, places, _ = gmsh.model.mesh.getNodes()
        number = {int(n): k for k, n in enumerate(labels)}
        nodes = gmsh.model.mesh.getElementsByType(2)[1]
    triangles = np.array([number[int(n)] for n in nodes], dtype=np.int64).reshape(-1, 3)
    used, triangles = np.unique(triangles, return_inverse=True)
    try:
        surface = stl.joined(path.name, places.reshape(-1, 3)[used], triangles.reshape(-1, 3))
    except ValueError as error:
        raise FileError(str(error)) from None
    return stl.text(surface.reversed() if surface.closed and surface.volume < 0.0 else surface, path.stem)


def _refuse_too_many(gmsh: Any, dimension: int, size: float, share: float, what: str, most: int) -> None:
    """Refuse to mesh what takes hours: entities of a ``dimension`` with a ``share`` of an element in each cell of a ``size``.

    Raises
    ------
    FileError
        If there are more than ``most``.

    """
    content = sum(gmsh.model.occ.getMass(dimension, t) for _, t in gmsh.model.getEntities(dimension))
    number = share * content / size**dimension
    if number > most:
        low, high = np.reshape(gmsh.model.getBoundingBox(-1, -1), (2, 3))
        extent = " x ".join(f"{v:.6g}" for v in high - low)
        raise FileError(
            f"it measures {extent} mm, and with elements of {size:g} mm it takes {number:.1g} {what}, more than {most:g}; give a "
            "larger --size, or export it again if its unit is another one"
        )


@contextmanager
def _model(path: Path) -> Iterator[Any]:
    """The module gmsh with the shapes of a file, for as long as they are needed."""
    if not path.is_file():
        raise FileError("there is no such file")
    gmsh = _gmsh()
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.model.occ.importShapes(str(path))
        gmsh.model.occ.synchronize()
        yield gmsh
    except FileError:
        raise
    except Exception as error:  # gmsh raises no other kind
        raise FileError(f"gmsh cannot mesh it: {error}") from None
    finally:
        gmsh.finalize()


def _gmsh() -> Any:
    """The module gmsh."""
    try:
        import gmsh
    except (ImportError, OSError) as error:  # OSError: a graphics library that it links is missing
        why = "" if isinstance(error, ModuleNotFoundError) else f" ({error})"
        raise FileError(
            f"STEP files are meshed by gmsh{why}, a program under the GPL that is installed separately: "
            "pip install 'prensa[step]'"
        ) from None
    return gmsh
