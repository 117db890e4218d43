"""Supports and motions in space: those of the plane with z beside x and y. From Python alone so far."""

from __future__ import annotations

from typing import ClassVar

from prensa.model.fields import DisplacementValue, described
from prensa.model.problem import Fixed, Motion, SupportValue

SPATIAL_AXES = ("x", "y", "z")


@described
class SpatialFixed(Fixed):
    """`Fixed` in space, along ``z`` too."""

    z: SupportValue | None = None

    offered: ClassVar[bool] = False


@described
class SpatialMotion(Motion):
    """`Motion` in space: displacement (or velocity) ``z`` of a tool's reference point too."""

    z: DisplacementValue | None = None

    offered: ClassVar[bool] = False
