"""Reader of VTK files, ``.vtk`` and ``.vtu``, by meshio: nodes, elements, and the numbers of the drawing that gmsh writes."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Any

from prensa.importers.deck import Deck, FileError
from prensa.importers.solids import OF_VTK

_FLAT_NODES = {"triangle": 3, "quad": 4, "triangle6": 6, "quad8": 8, "quad9": 8}  # nodes kept (the middle of a Q9 is not)
_LINE_NODES = {"line": 2, "line3": 3}
ENTITY_ARRAYS = ("CellEntityIds", "gmsh:geometrical")
"""Arrays of the cells with the number of the entity of the drawing, as gmsh and meshio call them."""


def read(path: Path, solid: bool = False) -> Deck:
    """Contents of a file; ``solid``: of bodies in space. Labels are VTK's numbers of points and cells, from 0.

    Raises
    ------
    FileError
        If it cannot be read, or has three-dimensional elements and is to be plane.

    """
    mesh = _mesh(path)
    deck = Deck(source="sides")
    for n, place in enumerate(mesh.points.tolist()):
        x, y, z = (*place, 0.0, 0.0)[:3]
        deck.nodes[n] = x, y, z
    numbers = next((mesh.cell_data[name] for name in ENTITY_ARRAYS if name in mesh.cell_data), [None] * len(mesh.cells))
    label = 0
    for block, entities in zip(mesh.cells, numbers):
        for k, nodes in enumerate(block.data.tolist()):
            entity = None if entities is None else int(entities[k].item())
            _add(deck, block.type, label, nodes, entity)
            label += 1
    if deck.solids and not solid:
        first, (kind, _) = next(iter(deck.solids.items()))
        raise FileError(f"cell {first} is one of {kind.name}: no section of the plane; compute it in 'space: solid'")
    return deck


def _mesh(path: Path) -> Any:
    """The file as meshio reads it, which prints what it finds wrong and ends the process."""
    import meshio

    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return meshio.read(path)
    except OSError:
        raise
    except SystemExit:
        # its code is a number alone; the reason, where there is one, is printed before the sentence that names the file
        words = " ".join(said.getvalue().partition("Error: Couldn't read file")[0].split()).removesuffix(".")
        words = words or "it is cut off, or of another kind"
    except Exception as error:
        words = str(error) or type(error).__name__
    raise FileError(f"it cannot be read ({words}); save it again as VTK, as an unstructured grid")


def _add(deck: Deck, kind: str, label: int, nodes: list[int], entity: int | None) -> None:
    """One cell into the deck, and into those of its number."""
    if kind in OF_VTK:
        deck.solids[label] = OF_VTK[kind], tuple(nodes)
        if entity is not None:
            deck.volume_numbers.setdefault(f"volume-{entity}", []).append(label)
    elif kind in _FLAT_NODES:
        deck.cells[label] = tuple(nodes[: _FLAT_NODES[kind]])
        if entity is not None:
            deck.surfaces.setdefault(f"surface-{entity}", []).append(label)
    elif kind in _LINE_NODES:
        if entity is not None:
            deck.curves.setdefault(f"curve-{entity}", []).append(tuple(nodes))
    elif kind != "vertex":
        raise FileError(f"cell {label} is a {kind!r}; triangles, quadrilaterals, hexahedra, wedges and tetrahedra are read")
