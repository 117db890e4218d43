"""Where a tool that is moved to a side in space meets its faces between their nodes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from prensa.mesh.faces import multilinear
from prensa.mesh.hollows import hollow, outward, sides
from prensa.types import Array

HALVINGS = 20
"""Of the steps by which a place is looked for: from an eighth of a face to 1e-7 of it, as meshes of files have their nodes."""
_EIGHTHS = np.stack(np.meshgrid(*2 * [np.arange(9) / 8], indexing="ij"), axis=-1).reshape(-1, 2)
_AROUND = np.stack(np.meshgrid(*2 * [np.arange(-1, 2)], indexing="ij"), axis=-1).reshape(-1, 2)


def met_ahead(gaps: Callable[[Array], Array], ends: Array, slack: float) -> float:
    """How much earlier than its nodes a tool meets faces (m, 4, 3) of a side between them.

    ``gaps``: how far it goes until it meets places (k, 3), infinite where it does not. ``slack``: a length that is none. Of a
    side that turns inwards the places are where the side itself is, behind its faces. They are looked for around the first of all
    eighths of each face, by steps that halve; faces go on that are met by half as early as the first one, at least.
    """
    nodal = gaps(ends.reshape(-1, 3)).reshape(len(ends), 4)
    first = float(nodal.min())
    sagitta, normal = 0.5 * sides(ends) * hollow(ends), outward(ends)
    normal = normal / np.linalg.norm(normal, axis=1)[:, None]
    # before a face whose nodes are farther off than it is long, a tool would have to be a needle, which nodes do not see either
    near = np.flatnonzero(nodal.min(axis=1) < first + sides(ends).max(axis=1))
    at, step, ahead = np.broadcast_to(_EIGHTHS, (len(near), *_EIGHTHS.shape)), 0.125, 0.0
    for _ in range(HALVINGS):
        N = multilinear(2.0 * at.reshape(-1, 2) - 1.0, 4)[0].reshape(*at.shape[:2], 4)
        behind = np.einsum("mkc,mc->mk", at * (1.0 - at), sagitta[near])
        x = N @ ends[near] - behind[..., None] * normal[near][:, None]
        met = gaps(x.reshape(-1, 3)).reshape(at.shape[:2])
        early = first - met.min(axis=1)
        ahead = max(ahead, float(early.max()))
        go_on = early >= max(0.5 * ahead, slack)
        if not go_on.any():
            break
        best = at[np.arange(len(at)), np.argmin(met, axis=1)][go_on]
        near, step = near[go_on], 0.5 * step
        at = np.clip(best[:, None] + step * _AROUND, 0.0, 1.0)
    return ahead if ahead > slack else 0.0
