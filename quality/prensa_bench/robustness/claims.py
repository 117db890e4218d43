"""Claims that several families make: what must hold when a body is released."""

from __future__ import annotations

import numpy as np

from prensa.types import Array
from prensa_bench.robustness.files import Record

NOTHING_LEFT = 1e-7  # force after a release, of the largest
AS_IT_WAS = 1e-5  # displacement of an elastic body after its release, of its size, a rigid motion that nothing prevents apart


def let_go(record: Record) -> str:
    """Tools that have gone bear nothing."""
    h = record.history
    force = {t: np.hypot(h[f"{t}.fx"], h[f"{t}.fy"]) for t in record.problem.tools}
    largest = max(float(f.max()) for f in force.values())
    for name, f in force.items():
        if f[-1] > NOTHING_LEFT * largest:
            return f"{name} bears {f[-1]:.3g} after its release, {largest:.4g} before"
    return ""


def sprung_back(record: Record) -> str:
    """An elastic body that bears nothing has the shape that it had; it may lie elsewhere, and turned if its supports went too."""
    last = record.problem.steps[-1].fixed.values()
    for name, s in record.bodies[max(record.bodies)].items():
        x, X = s.x - s.x.mean(axis=0), s.X - s.X.mean(axis=0)
        u = x - X @ turned(X, x).T if any(way.free for way in last) else x - X
        left = float(np.abs(u).max() / np.ptp(s.X, axis=0).max())
        if left > AS_IT_WAS:
            return f"elastic body {name} is left with displacements of {left:.2e} of its size"
    return ""


def turned(X: Array, x: Array) -> Array:
    """The rotation (d, d) that brings points X (n, d) nearest to points x (n, d), both about their centre (Kabsch 1976)."""
    U, _, V = np.linalg.svd(x.T @ X)
    U[:, -1] *= np.sign(np.linalg.det(U @ V))  # no reflection
    return np.asarray(U @ V)


def released(record: Record) -> str:
    """Without tools no support bears anything: what supports held against them has gone with them, their own balance apart."""
    largest = max(float(np.abs(v).max()) for key, v in record.history.items() if key.endswith((".fx", ".fy", ".fz")))
    x = {name: s.reaction for name, s in record.bodies[max(record.bodies)].items()}
    for name, reaction in x.items():
        if float(np.abs(reaction.sum(axis=0)).max()) > NOTHING_LEFT * largest:
            return f"supports of {name} bear {np.abs(reaction.sum(axis=0)).max():.3g} in all after the tools have gone"
    return ""
