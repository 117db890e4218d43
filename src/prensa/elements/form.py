"""What kernels of elements are generated for: nodes, points and internal modes, the space and the kinematics."""

from __future__ import annotations

from typing import NamedTuple


class Form(NamedTuple):
    """What differs between kernels: nodes, points, axes of space, axisymmetric or not, finite or small strain.

    ``bar``: the dilatation is that of the whole element (F-bar, B-bar; of elements with 2 points along each axis); ``mean``: in
    finite strain B-bar instead of F-bar; ``modes``: internal degrees of freedom of an element with enhanced strains.
    """

    nodes: int
    points: int
    dimension: int
    axisymmetric: bool
    finite: bool
    bar: bool = False
    mean: bool = False
    modes: int = 0

    @property
    def variational(self) -> bool:
        """Whether forces are derivatives of h̄."""
        return self.bar and (self.mean or not self.finite)

    @property
    def dofs(self) -> int:
        """Degrees of freedom of the nodes."""
        return self.dimension * self.nodes

    @property
    def components(self) -> int:
        """Of gradients and stresses."""
        return 9 if self.dimension == 3 else 5

    @property
    def row(self) -> int:
        """Numbers of a point in `Table.rows`."""
        return (1 + self.dimension) * self.nodes + 1
