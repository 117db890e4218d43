"""The suite of tool shapes."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from prensa.geometry.plane import turned
from prensa.precision import DRAWN, NEGLIGIBLE, ROUND_OFF
from prensa.testing.common import KINK, TRIALS, raise_if_wrong
from prensa.tools.analytic import Closest, Tool
from prensa.tools.implicit import SHARP
from prensa.tools.tool import ToolShape
from prensa.types import Array, Flags

DISTANCE = 1e-4  # accepted error of the slopes of g and s; over the size, length within which normals jump at a sharp edge
OFF_SURFACE = 0.01  # distance over the size at which a point is clearly beside what it is near


def check_tool(tool: ToolShape, *, size: float | None = None, rounding: float = 0.0, seed: int = 0) -> None:
    """Check a tool's geometry in its own frame, at random points about its surface.

    Parameters
    ----------
    tool
        The tool, a `ToolShape`; a face looks down.
    size
        Length that sets how far from the surface, and how far along it, the tool is tried (default: from its outline).
    rounding
        Radius (length) of corners that the description leaves to the program.
    seed
        Of the random numbers.

    Raises
    ------
    LawError
        Saying what is wrong: arrays of the wrong shape or not finite; an answer that changes from call to call or with the
        company of other points; g that is no distance (|∇g| ≠ 1) or positive inside the outline; n ≠ ∇g; ∂n/∂x ≠ c e⊗e;
        ∂s/∂x ≠ (1 − g c) e; a foot that is not on the surface; a ray that does not end on it or passes it; a period that does
        not lead back to the start; sharp edges that are not in ``edges``, or edges that are not sharp.

    """
    rng = np.random.default_rng(seed)
    shape = tool.shape(np.array([0.0, -1.0]), rounding)
    if size is None:
        size = max((float(np.abs(p).max()) for p in tool.outline(NEGLIGIBLE)), default=0.0)
        size = size if size > DRAWN else 1.0
    x = _about(shape, size, rng)
    found = [*_closest_wrong(shape, x, size)]
    if not found:
        close = shape.closest(x)
        found += [*_derivatives_wrong(shape, x, close, size), *_sides_wrong(tool, shape, x, close, size)]
    if not found:
        found += [
            *_rays_wrong(shape, x, close, size, rng),
            *_walk_wrong(shape, x, size),
            *_edges_wrong(tool, shape, size),
        ]
    raise_if_wrong(f"tool {tool!r}", found)


def _about(shape: Tool, size: float, rng: np.random.Generator) -> Array:
    """Points (k, 2) around the tool, most of them near its surface."""
    x = rng.uniform(-1.5 * size, 1.5 * size, (2 * TRIALS, 2))
    try:
        close = shape.closest(x)
        near = x - (close.g + 0.25 * size * rng.normal(size=len(x)) ** 3)[:, None] * close.n
    except (ValueError, IndexError, TypeError):
        return x
    return np.vstack([x, near]) if near.shape == x.shape and np.isfinite(near).all() else x


def _closest_wrong(shape: Tool, x: Array, size: float) -> Iterator[str]:
    first = [np.array(v) for v in shape.closest(x.copy())]
    for name, values, wanted in zip(("g", "n", "c", "s"), first, (x[:, 0], x, x[:, 0], x[:, 0])):
        if values.shape != wanted.shape:
            yield f"{name} has the shape {values.shape} for {len(x)} points; it must be {wanted.shape}"
            return
        if values.dtype != np.float64 or not np.isfinite(values).all():
            yield f"{name} is not a finite real number everywhere"
            return
    if not all(np.array_equal(a, b) for a, b in zip(first, shape.closest(x.copy()))):
        yield "the answer is another one when asked again: a tool must not remember anything"
    half = len(x) // 2
    alone = shape.closest(x[half:].copy())
    if not all(np.allclose(a[half:], b, rtol=ROUND_OFF, atol=ROUND_OFF * size) for a, b in zip(first, alone)):
        yield "the answer for a point depends on the other points"
    if np.abs(np.hypot(first[1][:, 0], first[1][:, 1]) - 1.0).max() > NEGLIGIBLE:
        yield "the normal n has not the length 1"


def _derivatives_wrong(shape: Tool, x: Array, close: Closest, size: float) -> Iterator[str]:
    """Differences of g, n and s, where they are smooth on both sides of a point and the curvature is not extreme."""
    h = DISTANCE * size
    clear = np.abs(close.g) < 0.25 * size
    e = turned(close.n)
    slopes, bends, lengths, kink = [], [], [], np.zeros(len(x), dtype=bool)
    for j in range(2):
        step = h * np.eye(2)[j]
        plus, minus = shape.closest(x + step), shape.closest(x - step)
        ds = np.array([_wrapped(plus.s - close.s, shape.period), _wrapped(close.s - minus.s, shape.period)]) / h
        dg = np.array([plus.g - close.g, close.g - minus.g]) / h
        dn = np.array([plus.n - close.n, close.n - minus.n]) / h
        kink |= np.abs(dg[0] - dg[1]) > KINK
        kink |= np.abs(dn[0] - dn[1]).max(axis=1) > KINK * (np.abs(close.c) + 1.0 / size)
        kink |= np.abs(plus.c - minus.c) > KINK * (np.abs(close.c) + 1.0 / size)
        slopes.append(dg.mean(axis=0))
        bends.append(dn.mean(axis=0))
        lengths.append(ds.mean(axis=0))
    smooth = clear & ~kink
    if smooth.sum() < 0.25 * max(int(clear.sum()), 1):
        yield "the distance has kinks almost everywhere near the surface"
        return
    slope, bend, length = np.stack(slopes, 1)[smooth], np.stack(bends, 2)[smooth], np.stack(lengths, 1)[smooth]
    n, e, c, g = close.n[smooth], e[smooth], close.c[smooth], close.g[smooth]
    off = np.abs(np.hypot(slope[:, 0], slope[:, 1]) - 1.0)
    if off.max() > DISTANCE:
        yield f"g is not a distance: |∇g| differs from 1 by {off.max():.1e}"
        return
    if (error := np.abs(slope - n).max()) > DISTANCE:
        yield f"n differs from ∇g by {error:.1e}"
    wanted = c[:, None, None] * e[:, :, None] * e[:, None, :]
    error = float((np.abs(bend - wanted).max(axis=(1, 2)) / (np.abs(c) + 1.0 / size)).max())
    if error > KINK:
        yield f"∂n/∂x differs from c e⊗e by {error:.1e} of it"
    error = float(np.abs(length - (1.0 - g * c)[:, None] * e).max())
    if error > DISTANCE:
        yield f"∂s/∂x differs from (1 − g c) e by {error:.1e}"


def _wrapped(ds: Array, period: float) -> Array:
    """Difference of surface coordinates on a closed surface."""
    return ds - period * np.round(ds / period) if np.isfinite(period) else ds


def _sides_wrong(tool: ToolShape, shape: Tool, x: Array, close: Closest, size: float) -> Iterator[str]:
    near = np.abs(close.g) < 0.25 * size
    foot = x - close.g[:, None] * close.n
    # seen from just before it: a sharp edge may belong to one of its sides
    before, ahead = near & (close.g > 0), DRAWN * size
    off = np.abs(shape.closest((foot + ahead * close.n)[before]).g - ahead).max(initial=0.0)
    if off > DRAWN * size:
        yield f"the foot x − g n of a point is not on the surface, but {off / size:.1e} of the size from it"
    polygons = tool.outline(4.0 * size)
    inside = np.logical_or.reduce([_within(p, x) for p in polygons])
    clear = near & (np.abs(close.g) > OFF_SURFACE * size)
    wrong = clear & (inside != (close.g < 0))
    if wrong.any():
        k = int(np.flatnonzero(wrong)[0])
        side = "inside" if inside[k] else "outside"
        yield f"g = {close.g[k]:.4g} at ({x[k, 0]:.4g}, {x[k, 1]:.4g}), which is {side} the outline: g is negative in the tool"


def _within(polygon: Array, x: Array) -> Flags:
    """Whether points (k, 2) are inside a polygon (m, 2), by crossings of a ray."""
    out = np.zeros(len(x), dtype=bool)
    for (ax, ay), (bx, by) in zip(polygon, np.roll(polygon, -1, axis=0)):
        between = (ay > x[:, 1]) != (by > x[:, 1])
        if between.any():
            out ^= between & (x[:, 0] < ax + (bx - ax) * (x[:, 1] - ay) / (by - ay if by != ay else 1.0))
    return out


def _rays_wrong(shape: Tool, x: Array, close: Closest, size: float, rng: np.random.Generator) -> Iterator[str]:
    limit = 4.0 * size
    before = close.g > 0.0
    for angle in rng.uniform(0.0, 2 * np.pi, 4):
        way = np.array([np.cos(angle), np.sin(angle)])
        h = np.asarray(shape.along(x[before], way, limit))
        if h.shape != (int(before.sum()),) or np.isnan(h).any():
            yield "'along' does not give a number for each point"
            return
        hits = np.isfinite(h)
        ends = x[before][hits] + h[hits, None] * way
        off = np.abs(shape.closest(ends).g).max(initial=0.0) if hits.any() else 0.0
        if off > 10 * NEGLIGIBLE * size:
            yield f"'along' ends {off / size:.1e} of the size from the surface"
            return
        if (h[hits] < -NEGLIGIBLE * size).any():
            yield "'along' is negative for a point outside the tool"
            return
        for share in rng.uniform(0.0, 1.0, 4):
            passed = shape.closest(x[before][hits] + share * h[hits, None] * way).g if hits.any() else np.zeros(0)
            if (passed < -10 * NEGLIGIBLE * size).any():
                yield "'along' passes through the tool"
                return
        foot = x - close.g[:, None] * close.n
        seen = np.flatnonzero(before & (close.g < size) & (np.abs(shape.closest(foot).g) < NEGLIGIBLE * size))
        if len(seen):
            k = seen[int(np.argmax(-close.n[seen] @ way))]
            straight = float(np.asarray(shape.along(x[[k]], -close.n[k], limit))[0])
            if not abs(straight - close.g[k]) <= DRAWN * size:
                yield f"'along' towards the foot of a point gives {straight:.6g}, its distance is {close.g[k]:.6g}"
                return


def _walk_wrong(shape: Tool, x: Array, size: float) -> Iterator[str]:
    """Once around a closed surface by its own coordinate leads back to the start."""
    period = shape.period
    if not np.isfinite(period):
        return
    off = OFF_SURFACE * size  # beside the surface, where edges have a normal
    close = shape.closest(x[:1])
    at = x[:1] + (off - close.g)[:, None] * close.n
    jumps = False
    start, h, walked, steps, close = at.copy(), period / 2000, 0.0, 0, shape.closest(at)
    while walked < period and steps < 8000:
        to = at + h * turned(close.n)
        after = shape.closest(to)
        to = to + (off - after.g)[:, None] * after.n
        after = shape.closest(to)
        ds = float(_wrapped(after.s - close.s, period)[0])
        jumps |= abs(ds) > 20 * h and float((after.n * close.n).sum()) > np.cos(SHARP)
        walked += ds
        at, close, steps = to, after, steps + 1
    if jumps or walked < period or np.hypot(*(at - start)[0]) > 5 * h + 3 * off:
        yield f"walking along the surface by its 'period' {period:.6g} does not lead back to the start"


def _edges_wrong(tool: ToolShape, shape: Tool, size: float) -> Iterator[str]:
    edges = np.asarray(shape.edges)
    if edges.ndim != 2 or edges.shape[1] != 4:
        yield f"'edges' has the shape {edges.shape}; it must be (k, 4)"
        return
    tiny = DISTANCE * size
    for px, py, ex, ey in edges:
        ends = np.array([[px - tiny * ex, py - tiny * ey], [px + tiny * ex, py + tiny * ey]])
        n = shape.closest(ends + 2 * tiny * np.array([ey, -ex])).n
        off = abs(float(shape.closest(np.array([[px, py]])).g[0]))
        if off > DRAWN * size or np.abs(n[1] - n[0]).max() < 0.5 * SHARP:
            yield f"the edge at ({px:.4g}, {py:.4g}) is not a sharp one of the surface"
    for polygon in tool.outline(2.0 * size):
        for place in _corners(shape, polygon, size):
            if not (np.hypot(*(edges[:, :2] - place).T) < 2 * DISTANCE * size).any():
                yield f"the surface has a sharp convex edge near ({place[0]:.4g}, {place[1]:.4g}) that is not in 'edges'"
                return


def _corners(shape: Tool, polygon: Array, size: float) -> Iterator[Array]:
    """Places where the normals of the surface jump to the outside, found by halving between vertices of the outline."""
    on = np.abs(shape.closest(polygon).g) < OFF_SURFACE * size
    x = polygon - (close := shape.closest(polygon)).g[:, None] * close.n
    for i, j in pairwise([*range(len(x)), 0]):
        if not (on[i] and on[j]) or np.hypot(*(x[j] - x[i])) > 3.0 * size:
            continue
        a, b = x[i] + OFF_SURFACE * (x[j] - x[i]), x[j]
        while np.hypot(*(b - a)) > DISTANCE * size:
            to = np.array([0.5 * (a + b)])
            middle = (to - (m := shape.closest(to)).g[:, None] * m.n)[0]
            n = shape.closest(np.array([a, middle, b])).n
            nearer = min(np.hypot(*(a - middle)), np.hypot(*(b - middle)))
            if nearer < OFF_SURFACE * np.hypot(*(b - a)) or n[0] @ n[2] > np.cos(SHARP):
                break  # the surface leads away from the chord, or does not turn
            a, b = (a, middle) if n[0] @ n[1] < n[1] @ n[2] else (middle, b)
        way = b - a
        if not 0.0 < np.hypot(*way) <= DISTANCE * size:
            continue
        middle, way = 0.5 * (a + b), DISTANCE * size * way / np.hypot(*way)
        n = shape.closest(np.array([middle - way, middle + way])).n
        outside = shape.closest(np.array([middle + DISTANCE * size * (n[0] + n[1])]))
        if n[0] @ n[1] < np.cos(SHARP) and outside.c[0] * KINK * size > 1.0:
            yield middle  # the normals fan out: convex
