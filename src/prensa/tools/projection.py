"""Batch kernels of chains of lines and arcs: closest points and rays, through a tree of boxes.

The chain is walked with the tool on the left: n is the tangent turned by −90°, and e = n turned by +90° is the way of
the walk, so s grows along it. Where the closest point is a corner its normals fan out: the corner is an arc of radius
zero, c = 1/g. A point whose closest points are two belongs to the nearer one, the first of the chain if they are equally near.
"""

from __future__ import annotations

import numpy as np

from prensa.kernels.compiled import njit
from prensa.kernels.search import push_children
from prensa.precision import ROUND_OFF
from prensa.tools.analytic import AT_CENTRE

# columns of the table of pieces
X, Y, DX, DY, LO, HI = 0, 1, 2, 3, 4, 5  # line: origin, direction; arc: centre, direction of its middle
R, SIDE, COS = 6, 7, 8  # arc: radius (0: line), +1 convex or −1 concave, cosine of half its angle
AX, AY, BX, BY = 9, 10, 11, 12  # ends
NAX, NAY, NBX, NBY = 13, 14, 15, 16  # mean normals of the corners at the ends
SA, SB = 17, 18  # whether the corners at the ends are smooth
S = 19  # surface coordinate of the piece's coordinate 0 (line), of its middle (arc)
HALF = 20  # half the length of an arc
COLUMNS = 21  # numbers of a piece


@njit(cache=True)
def _distance(piece, x, y):
    """Squared distance of (x, y) to a piece, and where: −1 and +1 at its ends, 0 between."""
    dx, dy = x - piece[X], y - piece[Y]
    if piece[R] == 0.0:
        t = dx * piece[DX] + dy * piece[DY]
        if t < piece[LO]:
            return (x - piece[AX]) ** 2 + (y - piece[AY]) ** 2, -1
        if t > piece[HI]:
            return (x - piece[BX]) ** 2 + (y - piece[BY]) ** 2, 1
        h = dy * piece[DX] - dx * piece[DY]
        return h * h, 0
    r = np.hypot(dx, dy)
    if dx * piece[DX] + dy * piece[DY] >= r * piece[COS]:
        return (r - piece[R]) ** 2, 0
    if (piece[DX] * dy - piece[DY] * dx) * piece[SIDE] < 0.0:
        return (x - piece[AX]) ** 2 + (y - piece[AY]) ** 2, -1
    return (x - piece[BX]) ** 2 + (y - piece[BY]) ** 2, 1


@njit(cache=True)
def _box_distance(box, x, y):
    dx = max(box[0] - x, 0.0, x - box[1])
    dy = max(box[2] - y, 0.0, y - box[3])
    return dx * dx + dy * dy


@njit(cache=True)
def _nearest(table, boxes, x, y):
    """Nearest piece and where on it; ``boxes`` is a binary heap, node i with children 2i and 2i + 1, leaves last."""
    first = boxes.shape[0] // 2
    best, found, where = np.inf, 0, 0
    stack = np.empty(64, dtype=np.int64)
    stack[0] = 1
    top = 1
    while top > 0:
        top -= 1
        i = stack[top]
        if _box_distance(boxes[i], x, y) > best:
            continue
        if i >= first:
            k = i - first
            if k >= table.shape[0]:
                continue
            d, at = _distance(table[k], x, y)
            # Ties go to the first piece, whatever the order in which the tree is searched: projections are reproducible.
            if d < best or (d == best and k < found):
                best, found, where = d, k, at
            continue
        top = push_children(stack, top, i, _box_distance(boxes[2 * i], x, y), _box_distance(boxes[2 * i + 1], x, y))
    return found, where


@njit(cache=True)
def closest(table, boxes, size, xi, g, n, c, s):
    """Points xi (k, 2) → signed distance g (k,), normal n (k, 2), curvature c (k,), surface coordinate s (k,)."""
    for k in range(xi.shape[0]):
        x, y = xi[k, 0], xi[k, 1]
        i, where = _nearest(table, boxes, x, y)
        p = table[i]
        if where != 0:
            vx, vy, mx, my, smooth = p[AX], p[AY], p[NAX], p[NAY], p[SA]
            if where > 0:
                vx, vy, mx, my, smooth = p[BX], p[BY], p[NBX], p[NBY], p[SB]
            if smooth == 0.0:
                d = np.hypot(x - vx, y - vy)
                sign = 1.0 if (x - vx) * mx + (y - vy) * my >= 0.0 else -1.0
                g[k] = sign * d
                n[k, 0], n[k, 1] = mx, my
                if d > ROUND_OFF * size:
                    n[k, 0], n[k, 1] = sign * (x - vx) / d, sign * (y - vy) / d
                # The normals of a corner fan out: as it were an arc of radius zero, 1/g, bounded at the corner itself.
                c[k] = sign / max(d, ROUND_OFF * size)
                if p[R] == 0.0:
                    s[k] = p[S] + (p[LO] if where < 0 else p[HI])
                else:
                    s[k] = p[S] + where * p[HALF]
                continue
        dx, dy = x - p[X], y - p[Y]
        if p[R] == 0.0:
            n[k, 0], n[k, 1] = p[DY], -p[DX]
            g[k] = dx * p[DY] - dy * p[DX]
            c[k] = 0.0
            s[k] = p[S] + min(max(dx * p[DX] + dy * p[DY], p[LO]), p[HI])
            continue
        r, side = np.hypot(dx, dy), p[SIDE]
        nx, ny = p[DX], p[DY]
        if r > 0.0:
            nx, ny = dx / r, dy / r
        n[k, 0], n[k, 1] = side * nx, side * ny
        # from the middle of the arc, whose radius may be many times the size of the tool: r − R would have the round-off of R
        vx, vy = x - (p[X] + p[R] * p[DX]), y - (p[Y] + p[R] * p[DY])
        along, across = p[DX] * vx + p[DY] * vy, p[DX] * vy - p[DY] * vx
        g[k] = side * (vx * vx + vy * vy + 2.0 * p[R] * along) / (r + p[R])
        c[k] = side / max(r, AT_CENTRE * p[R])
        s[k] = p[S] + side * p[R] * np.arctan2(across, p[R] + along)


@njit(cache=True)
def _hits(p, x, y, dx, dy):
    """Coordinates along the ray (x, y) + h (dx, dy), −∞ < h < ∞, of up to two crossings with a piece (inf: none)."""
    if p[R] == 0.0:
        cross = dx * p[DY] - dy * p[DX]
        if cross == 0.0:
            return np.inf, np.inf
        ox, oy = p[X] - x, p[Y] - y
        t = (ox * dy - oy * dx) / cross
        slack = ROUND_OFF * (abs(ox) + abs(oy))  # a ray through a corner meets at least one of its sides
        if t < p[LO] - slack or t > p[HI] + slack:
            return np.inf, np.inf
        return (ox * p[DY] - oy * p[DX]) / cross, np.inf
    ox, oy = x - p[X], y - p[Y]
    b, off = ox * dx + oy * dy, ox * dy - oy * dx
    rest = p[R] * p[R] - off * off
    if rest < 0.0:
        return np.inf, np.inf
    root = np.sqrt(rest)
    out = np.array([-b - root, -b + root])
    for m in range(2):
        hx, hy = ox + out[m] * dx, oy + out[m] * dy
        if hx * p[DX] + hy * p[DY] < p[R] * (p[COS] - ROUND_OFF):
            out[m] = np.inf
    return out[0], out[1]


@njit(cache=True)
def _reaches(box, x, y, dx, dy):
    """Whether the endless line through (x, y) along (dx, dy) meets a box."""
    lo, hi = -np.inf, np.inf
    for k in range(2):
        a, b, o, d = box[2 * k], box[2 * k + 1], x if k == 0 else y, dx if k == 0 else dy
        if d == 0.0:
            if o < a or o > b:
                return False
        else:
            ta, tb = (a - o) / d, (b - o) / d
            lo, hi = max(lo, min(ta, tb)), min(hi, max(ta, tb))
    return lo <= hi


@njit(cache=True)
def ray(table, boxes, slack, xi, inside, dx, dy, h):
    """Points xi (k, 2) → distance h (k,) along the unit vector (dx, dy) to the surface, inf where there is none.

    From outside forward to the first crossing; a point that is ``inside`` the tool looks back to where it came in.
    """
    first = boxes.shape[0] // 2
    # A search in depth leaves one node a level on the stack: 64 are enough for any chain.
    stack = np.empty(64, dtype=np.int64)
    for k in range(xi.shape[0]):
        x, y = xi[k, 0], xi[k, 1]
        sign = -1.0 if inside[k] else 1.0
        best = np.inf
        stack[0] = 1
        top = 1
        while top > 0:
            top -= 1
            i = stack[top]
            if not _reaches(boxes[i], x, y, dx, dy):
                continue
            if i < first:
                stack[top], stack[top + 1] = 2 * i, 2 * i + 1
                top += 2
                continue
            if i - first >= table.shape[0]:
                continue
            a, b = _hits(table[i - first], x, y, dx, dy)
            for hit in (a, b):
                # A point that lies on the surface meets it at once, but for round-off.
                if np.isfinite(hit) and sign * hit >= -slack and sign * hit < best:
                    best = sign * hit
        h[k] = sign * best if np.isfinite(best) else np.inf
