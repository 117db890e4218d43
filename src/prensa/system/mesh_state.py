"""States on meshes made during the run: the mesh, and what refers to the initial shape."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from prensa.mesh.mesh import Mesh, displaced
from prensa.types import Array, Index, Stored

NAMES = "remeshed.names"


@dataclass(frozen=True)
class Remeshed:
    """Meshes made during a run, by body, and what cannot be computed from them any more.

    ``meshes``: with the nodes where they were then; ``origin`` (n, 2): where the material at each node was at the beginning,
    from which displacements count; ``volume`` (m, q): initial volumes of the points; ``count``: meshes made so far;
    ``number``: increments before the last one; ``tools`` (tools, m): motions of the tools then; ``shape``: least shape measure
    that it began with; ``least``: smallest size that tools asked for.
    """

    meshes: Mapping[str, Mesh]
    origin: Mapping[str, Array]
    volume: Mapping[str, Array]
    count: int
    number: int
    tools: Array
    shape: float
    least: float = 0.0

    def arrays(self) -> dict[str, Stored]:
        """Flat mapping of names to arrays, for checkpoints; names of bodies and boundaries stand in one of them."""
        names = {b: [list(m.edges), m.corners] for b, m in self.meshes.items()}
        out: dict[str, Stored] = {NAMES: np.frombuffer(json.dumps(names).encode(), dtype=np.uint8)}
        for k, (body, mesh) in enumerate(self.meshes.items()):
            own = {"points": mesh.points, "cells": mesh.cells, "origin": self.origin[body], "volume": self.volume[body]}
            own |= {f"edges_{i}": edges for i, edges in enumerate(mesh.edges.values())}
            out |= {f"remeshed.{k}.{name}": array for name, array in own.items()}
        return out | {
            "remeshed.count": np.array([self.count, self.number]),
            "remeshed.tools": self.tools,
            "remeshed.shape": np.array([self.shape, self.least]),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Stored]) -> Remeshed | None:
        """Inverse of `arrays`, bit for bit; None where there are none."""
        if NAMES not in arrays:
            return None
        names = json.loads(arrays[NAMES].tobytes().decode())
        meshes, origin, volume = {}, {}, {}
        for k, (body, (edges, corners)) in enumerate(names.items()):
            of = f"remeshed.{k}."
            points, origin[body], volume[body] = (
                np.array(arrays[of + key], dtype=np.float64) for key in ("points", "origin", "volume")
            )
            named = {name: np.array(arrays[f"{of}edges_{i}"], dtype=np.int64) for i, name in enumerate(edges)}
            meshes[body] = stored(points, np.array(arrays[of + "cells"], dtype=np.int64), named, corners)
        count, number = arrays["remeshed.count"].tolist()
        tools, (shape, least) = np.array(arrays["remeshed.tools"], dtype=np.float64), arrays["remeshed.shape"].tolist()
        return cls(meshes, origin, volume, count, number, tools, shape, least)

    def moved(self, points: Mapping[str, Array], origin: Mapping[str, Array], shape: float) -> Remeshed:
        """The same with nodes elsewhere, which were at first at ``origin``; ``shape``: least shape measure there."""
        return replace(self, meshes={b: displaced(m, points[b]) for b, m in self.meshes.items()}, origin=origin, shape=shape)


def stored(points: Array, cells: Index, edges: Mapping[str, Index], corners: Mapping[str, int]) -> Mesh:
    """A mesh as it was, which is not checked again: deformed bodies are kept too."""
    mesh = object.__new__(Mesh)
    for name, value in (("points", points), ("cells", cells), ("edges", edges), ("corners", corners)):
        object.__setattr__(mesh, name, value)
    return mesh
