"""Batch kernel of rays that meet triangles."""

from __future__ import annotations

import numpy as np

from prensa.kernels.compiled import njit
from prensa.kernels.search import push_children
from prensa.precision import NEGLIGIBLE


@njit(cache=True, error_model="numpy")
def _enters(box, o, d):
    """How far from o (3,) along d (3,) a ray enters a box (6,), infinite if it does not."""
    near, end = 0.0, np.inf
    for i in range(3):
        if d[i] == 0.0:
            if o[i] < box[i] or o[i] > box[3 + i]:
                return np.inf
        else:
            a, b = (box[i] - o[i]) / d[i], (box[3 + i] - o[i]) / d[i]
            near, end = max(near, min(a, b)), min(end, max(a, b))
    return near if near <= end else np.inf


@njit(cache=True, error_model="numpy")
def _crossing(X, o, d):
    """How far from o (3,) along d (3,) a ray meets a triangle of corners X (3, 3), infinite if it does not."""
    a0, a1, a2 = X[1, 0] - X[0, 0], X[1, 1] - X[0, 1], X[1, 2] - X[0, 2]
    b0, b1, b2 = X[2, 0] - X[0, 0], X[2, 1] - X[0, 1], X[2, 2] - X[0, 2]
    f0, f1, f2 = o[0] - X[0, 0], o[1] - X[0, 1], o[2] - X[0, 2]
    p0, p1, p2 = d[1] * b2 - d[2] * b1, d[2] * b0 - d[0] * b2, d[0] * b1 - d[1] * b0
    q0, q1, q2 = f1 * a2 - f2 * a1, f2 * a0 - f0 * a2, f0 * a1 - f1 * a0
    det = a0 * p0 + a1 * p1 + a2 * p2
    if det == 0.0:
        return np.inf
    u, v = (f0 * p0 + f1 * p1 + f2 * p2) / det, (q0 * d[0] + q1 * d[1] + q2 * d[2]) / det
    if u < -NEGLIGIBLE or v < -NEGLIGIBLE or u + v > 1.0 + NEGLIGIBLE:
        return np.inf
    return (b0 * q0 + b1 * q1 + b2 * q2) / det


@njit(cache=True, error_model="numpy")
def first_met(boxes, order, X, least, start, way, met, far):
    """Rays from start (r, 3) along way (r, 3) → the first of triangles X (k, 3, 3) that each meets, and how far off, (r,).

    ``boxes``, ``order``: `prensa.geometry.box_tree` of the triangles; nearer than ``least`` they do not count. ``met`` and
    ``far`` stay as they are where a ray meets none.
    """
    first = boxes.shape[0] // 2
    stack = np.empty(64, dtype=np.int64)
    for k in range(start.shape[0]):
        o, d, best = start[k], way[k], np.inf
        stack[0], top = 1, 1
        while top > 0:
            top -= 1
            i = stack[top]
            enters = _enters(boxes[i], o, d)
            if enters == np.inf or enters > best:
                continue
            if i < first:
                top = push_children(stack, top, i, _enters(boxes[2 * i], o, d), _enters(boxes[2 * i + 1], o, d))
                continue
            t = order[i - first]
            if t < 0:
                continue
            h = _crossing(X[t], o, d)
            if h > least and (h < best or (h == best and t < met[k])) and h < np.inf:
                best, met[k], far[k] = h, t, h
