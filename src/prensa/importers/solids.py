"""Elements of three dimensions in the files of other programs: what becomes of them, one row each."""

from __future__ import annotations

from typing import NamedTuple

_OF_BRICK = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))
_OF_WEDGE = ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0))
_OF_TETRAHEDRON = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
_SECOND_ORDER = "mesh it with tetrahedra of second order ('Mesh.ElementOrder = 2;' in gmsh, C3D10 in Abaqus), or with hexahedra"
_BETTER_KIND = "mesh the body with tetrahedra of 10 nodes, or with hexahedra of 8"
_LINEAR = "mesh it with elements of the first order ('Mesh.ElementOrder = 1;' in gmsh, C3D8 in Abaqus)"


class SolidKind(NamedTuple):
    """A kind of element: its ``name``, its type in gmsh and VTK (by meshio's name), what follows C3D in Abaqus, its nodes.

    ``order``: of the file's nodes among those of the element here, those of a collapsed brick twice; none where the element is
    refused with a ``remedy``. ``sides``: places of the corners of its sides S1, S2, … ``of_gmsh``: places in gmsh's files of the
    nodes in the order of the other two, where they differ.
    """

    name: str
    gmsh: int
    vtk: str
    abaqus: str
    nodes: int
    order: tuple[int, ...] = ()
    remedy: str = ""
    sides: tuple[tuple[int, ...], ...] = ()
    of_gmsh: tuple[int, ...] = ()


SOLID_KINDS = (
    SolidKind("hexahedra", 5, "hexahedron", "8", 8, (0, 1, 2, 3, 4, 5, 6, 7), sides=_OF_BRICK),
    SolidKind("wedges", 6, "wedge", "6", 6, (0, 1, 2, 2, 3, 4, 5, 5), sides=_OF_WEDGE),
    # gmsh has the middles of the sides 3-4 and 2-4 the other way round
    SolidKind("tetrahedra of 10 nodes", 11, "tetra10", "10", 10, tuple(range(10)), sides=_OF_TETRAHEDRON,
              of_gmsh=(0, 1, 2, 3, 4, 5, 6, 7, 9, 8)),
    SolidKind("tetrahedra of 4 nodes", 4, "tetra", "4", 4, remedy=_SECOND_ORDER),
    SolidKind("pyramids", 7, "pyramid", "5", 5, remedy=_BETTER_KIND),
    SolidKind("hexahedra of 20 nodes", 17, "hexahedron20", "20", 20, remedy=_LINEAR),
    SolidKind("hexahedra of 27 nodes", 12, "hexahedron27", "27", 27, remedy=_LINEAR),
    SolidKind("wedges of 15 nodes", 18, "wedge15", "15", 15, remedy=_LINEAR),
    SolidKind("wedges of 18 nodes", 13, "wedge18", "18", 18, remedy=_LINEAR),
    SolidKind("pyramids of 13 nodes", 19, "pyramid13", "13", 13, remedy=_BETTER_KIND),
    SolidKind("pyramids of 14 nodes", 14, "pyramid14", "14", 14, remedy=_BETTER_KIND),
)  # fmt: skip
MIDDLES = {frozenset(ends): 4 + k for k, ends in enumerate(((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)))}
"""Places of the nodes in the middle of the sides of a tetrahedron of ten nodes."""
OF_GMSH = {kind.gmsh: kind for kind in SOLID_KINDS}
OF_ABAQUS = {kind.abaqus: kind for kind in SOLID_KINDS}
OF_VTK = {kind.vtk: kind for kind in SOLID_KINDS}
