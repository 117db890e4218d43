"""Batch kernels of surfaces of curved triangles: closest points through a tree of boxes.

A triangle with corners x0, x1, x2 is the quadratic patch (Nagata 2005, Computer Aided Geometric Design 22, eq. 19)

    x(e, z) = x0 (1 − e) + x1 (e − z) + x2 z − c0 (1 − e)(e − z) − c1 (e − z) z − c2 (1 − e) z,    0 ≤ z ≤ e ≤ 1

whose sides 0-1, 1-2, 0-2 are the parabolas a + (b − a) s − c s (1 − s). All c zero: it is flat. At sharp edges it goes on to, or
only as far as, other parabolas, the edges.

Where the closest point lies on a side or corner at which the surface is smooth, the patch itself goes on beyond it: normals of
neighbours differ a little there, and a fan of normals between them would be one of a tiny radius. At sharp edges and corners
normals do fan out: they are arcs and spheres of radius zero.

A smooth side has two of those patches, whose normals differ there by the little that their arcs leave. A node that symmetry keeps
on such a side would be pushed to and fro, so that no iteration converges: within a band about it the first of the triangles there
has the point, whose patch goes on beyond its side (ties by number, as Edelsbrunner & Mücke 1990 break them).

At open borders the surface ends, and turns away with a radius, the ``lip``: of points past a border the gap is the distance of a
curve so far behind it, less the radius. A node that slides past leaves the surface by and by, as at other edges without fillets.
Where a border runs is known to the height of a chord of its triangle: so far the patch goes on, so that points in a plane of
symmetry do not miss the border of half a tool. With a lip of zero points past a border are outside in any case, and what a file's
digits leave counts besides.
"""

from __future__ import annotations

import numpy as np

from prensa.kernels.compiled import njit
from prensa.kernels.search import push_children
from prensa.precision import NEGLIGIBLE, ROUND_OFF
from prensa.tools.facets import BORDER, CREASE, SMOOTH

FOOT_STEPS = 20
"""Newton steps to the foot of a perpendicular, quadratic from the third on."""
SEAM_BAND = 1e-3
"""Share of a triangle's height on both sides of a smooth side of it: far more than bodies yield to the angle between patches."""
# where on a patch a closest point lies: inside, on a side, at a corner
_WITHIN, _SIDE, _CORNER = 0, 1, 4


@njit(cache=True, error_model="numpy", forceinline=True)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, error_model="numpy", forceinline=True)
def _triple(a, b, c):
    return (
        (a[1] * b[2] - a[2] * b[1]) * c[0] + (a[2] * b[0] - a[0] * b[2]) * c[1] + (a[0] * b[1] - a[1] * b[0]) * c[2]
    )


@njit(cache=True, error_model="numpy")
def _at(X, C, e, z, x, xe, xz):
    """Place x (3,) and its derivatives by e and z of the patch of corners X (3, 3) and coefficients C (3, 3)."""
    a, b = 1.0 - e, e - z
    for i in range(3):
        c0, c1, c2 = C[0, i], C[1, i], C[2, i]
        x[i] = X[0, i] * a + X[1, i] * b + X[2, i] * z - c0 * (a * b) - c1 * (b * z) - c2 * (a * z)
        xe[i] = X[1, i] - X[0, i] - c0 * (a - b) - c1 * z + c2 * z
        xz[i] = X[2, i] - X[1, i] + c0 * a - c1 * (b - z) - c2 * a


@njit(cache=True, error_model="numpy")
def _foot(X, C, p, e, z, x, xe, xz):
    """Foot of the perpendicular from p on an endless patch by Newton's method from (e, z): e, z, whether it was found.

    x, xe, xz (3,): its place and derivatives.
    """
    r = np.empty(3)
    for _ in range(FOOT_STEPS):
        _at(X, C, e, z, x, xe, xz)
        for i in range(3):
            r[i] = x[i] - p[i]
        fe, fz = _dot(r, xe), _dot(r, xz)
        g11, g12, g22 = _dot(xe, xe), _dot(xe, xz), _dot(xz, xz)
        b0, b1, b2 = _dot(r, C[0]), _dot(r, C[1]), _dot(r, C[2])
        h11, h12, h22 = g11 + 2.0 * b0, g12 - b0 - b1 + b2, g22 + 2.0 * b1
        # Beyond a centre of curvature the distance is no minimum there: the first fundamental form leads downhill all the same.
        if h11 <= 0.0 or h11 * h22 - h12 * h12 <= 0.25 * (g11 * g22 - g12 * g12):
            h11, h12, h22 = g11, g12, g22
        det = h11 * h22 - h12 * h12
        de, dz = -(h22 * fe - h12 * fz) / det, -(h11 * fz - h12 * fe) / det
        size = max(abs(de), abs(dz))
        if size > 0.5:
            de, dz = 0.5 * de / size, 0.5 * dz / size
        e += de
        z += dz
        if size < NEGLIGIBLE:
            _at(X, C, e, z, x, xe, xz)
            return e, z, True
    return e, z, False


@njit(cache=True, error_model="numpy")
def _on_side(a, b, c, p):
    """Squared distance of p to the parabola a + (b − a) s − c s (1 − s), 0 ≤ s ≤ 1, and s."""
    # Half the derivative of the square is f = f0 + f1 s + f2 s² + f3 s³.
    f0, f1, f2, f3, dd = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        r, t = a[i] - p[i], b[i] - a[i] - c[i]
        f0 += r * t
        f1 += t * t + 2.0 * r * c[i]
        f2 += 3.0 * t * c[i]
        f3 += 2.0 * c[i] * c[i]
        dd += (b[i] - a[i]) ** 2
    low, high, s = 0.0, 1.0, 0.5
    if f0 >= 0.0:
        s = 0.0
    elif f0 + f1 + f2 + f3 <= 0.0:
        s = 1.0
    else:
        s = min(max(-f0 / f1 if f1 > 0.0 else 0.5, 0.0), 1.0)
        for _ in range(60):
            f = f0 + s * (f1 + s * (f2 + s * f3))
            if f > 0.0:
                high = s
            else:
                low = s
            slope = f1 + s * (2.0 * f2 + s * 3.0 * f3)
            to = s - f / slope if slope > 0.0 else 0.5 * (low + high)
            done = abs(to - s) < ROUND_OFF  # round-off may lead beyond s itself, one end of what is left
            if not done and (to <= low or to >= high):
                to = 0.5 * (low + high)
            s = to
            if done:
                break
    d = 0.0
    for i in range(3):
        d += (a[i] + (b[i] - a[i]) * s - c[i] * (s * (1.0 - s)) - p[i]) ** 2
    return d, s


@njit(cache=True, error_model="numpy", forceinline=True)
def _within(T, e, z):
    """Whether a place is on the patch, which goes T[k, 0] s (1 − s) of the triangle's height beyond its side k.

    s is where the place is along the side, from which the corner opposite is at T[k, 1].
    """
    u, v, w = 1.0 - e, e - z, z
    return _within_side(T, 0, u, v, w) and _within_side(T, 1, u, v, w) and _within_side(T, 2, u, v, w)


@njit(cache=True, error_model="numpy", forceinline=True)
def _within_side(T, k, u, v, w):
    """Whether a place with shares u, v, w of the corners is within the curve that bounds the patch at its side k."""
    off, s = (w, v) if k == 0 else ((u, w) if k == 1 else (v, w))
    return off >= -ROUND_OFF - T[k, 0] * _arc(s + T[k, 1] * off)


@njit(cache=True, error_model="numpy", forceinline=True)
def _arc(s):
    """The product s (1 − s), 0 beyond the ends of a side."""
    return s * (1.0 - s) if 0.0 < s < 1.0 else 0.0


@njit(cache=True, error_model="numpy")
def _foot_near(X, C, curved, p, x, xe, xz):
    """`_foot` of p on a patch from the foot on its flat triangle, which is all there is of a flat one."""
    s11, s12, s22, f1, f2 = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        u, v, w = X[1, i] - X[0, i], X[2, i] - X[0, i], p[i] - X[0, i]
        s11 += u * u
        s12 += u * v
        s22 += v * v
        f1 += u * w
        f2 += v * w
    det = s11 * s22 - s12 * s12
    b, z = (s22 * f1 - s12 * f2) / det, (s11 * f2 - s12 * f1) / det
    e = b + z
    there = True
    if curved:
        e, z, there = _foot(X, C, p, min(max(e, 0.0), 1.0), min(max(z, 0.0), 1.0), x, xe, xz)
    else:
        _at(X, C, e, z, x, xe, xz)
    return e, z, there


@njit(cache=True, error_model="numpy")
def _nearest_of(X, C, R, T, curved, p, x, xe, xz, found):
    """Squared distance of p to a patch, and where: inside, or the number of the side or corner; found (2,): its e, z or s.

    C: coefficients of the patch; R: those of the curves that bound it; T (3, 2): how far these are beyond its sides,
    see `_within`.
    """
    e, z, there = _foot_near(X, C, curved, p, x, xe, xz)
    if there and _within(T, e, z):
        found[0], found[1] = e, z
        return (x[0] - p[0]) ** 2 + (x[1] - p[1]) ** 2 + (x[2] - p[2]) ** 2, _WITHIN
    best, where = np.inf, _WITHIN
    for k in range(3):
        i, j = (0, 1) if k == 0 else ((1, 2) if k == 1 else (0, 2))
        d, s = _on_side(X[i], X[j], R[k], p)
        if d < best:
            best = d
            found[0] = s
            where = _CORNER + i if s == 0.0 else (_CORNER + j if s == 1.0 else _SIDE + k)
    return best, where


@njit(cache=True, error_model="numpy", forceinline=True)
def _margin(T, kinds, e, z, band):
    """Least distance (over heights) of a place from the smooth sides of a triangle, a ``band`` beyond them; −1 beyond others.

    T (3, 2): see `_within`; kinds (7,): see `closest`.
    """
    u, v, w = 1.0 - e, e - z, z
    least = np.inf
    for k in range(3):
        if kinds[1 + k] == SMOOTH:
            least = min(least, (w if k == 0 else (u if k == 1 else v)) + band)
        elif not _within_side(T, k, u, v, w):
            return -1.0
    return least


@njit(cache=True, error_model="numpy")
def _first(P, C, T, curved, flats, kinds, groups, start, members, p, t, where, at, x, xe, xz):
    """The first of the triangles that have p within their bands about smooth sides, and where on it; t if there is no other.

    t, where, at (2,): what is nearest to p, and what is found; groups (m, 3): numbers of the corners of triangles, the same where
    no sharp edge parts them; ``members`` from start[i] to start[i + 1]: triangles at the corner i. What begins in a flat, of
    ``flats`` (m,), has its normal there: flats have what is over them, and nothing else.
    """
    if kinds[t, where] != SMOOTH or flats[t]:
        return t, where
    if where == _WITHIN and _margin(T[t], kinds[t], at[0], at[1], 0.0) > SEAM_BAND:
        return t, where
    first = t
    for c in range(3):
        for o in members[start[groups[t, c]] : start[groups[t, c] + 1]]:
            if o > first or flats[o] or (o == t and where == _WITHIN):
                continue
            e, z, there = _foot_near(P[o], C[o], curved[o], p, x, xe, xz)
            if there and _margin(T[o], kinds[o], e, z, SEAM_BAND) >= 0.0:
                first, where, at[0], at[1] = o, _WITHIN, e, z
    return first, where


@njit(cache=True, error_model="numpy", forceinline=True)
def _beyond(box, p):
    """Squared distance of p to a box (6,)."""
    d = 0.0
    for i in range(3):
        way = max(box[i] - p[i], 0.0, p[i] - box[3 + i])
        d += way * way
    return d


@njit(cache=True, error_model="numpy")
def nearest(P, C, R, T, curved, flats, kinds, groups, start, members, boxes, order, xi, triangle, where, at):
    """Points xi (k, 3) → nearest triangles (k,), where on them (k,), and parameters there (k, 2).

    P, C, R (m, 3, 3), T (m, 3, 2), curved (m,): patches and the curves that bound them, see `_nearest_of`; flats, kinds, groups,
    start, members: what they have in common, see `_first`. ``boxes`` (2 l, 6): binary heap, node i with children 2i and 2i + 1,
    leaves last, of which ``order`` (l,) are the triangles (−1: none).
    """
    first = boxes.shape[0] // 2
    x, xe, xz, found = np.empty(3), np.empty(3), np.empty(3), np.empty(2)
    stack = np.empty(64, dtype=np.int64)
    for k in range(xi.shape[0]):
        p = xi[k]
        best, t_best, w_best = np.inf, -1, 0
        stack[0], top = 1, 1
        while top > 0:
            top -= 1
            i = stack[top]
            # Neighbours are equally near at their common side, but for round-off: the first one is taken, always.
            if _beyond(boxes[i], p) > best * (1.0 + NEGLIGIBLE):
                continue
            if i < first:
                top = push_children(stack, top, i, _beyond(boxes[2 * i], p), _beyond(boxes[2 * i + 1], p))
                continue
            t = order[i - first]
            if t < 0:
                continue
            d, w = _nearest_of(P[t], C[t], R[t], T[t], curved[t], p, x, xe, xz, found)
            same = d <= best * (1.0 + NEGLIGIBLE) and t < t_best
            if d < best * (1.0 - NEGLIGIBLE) or same or t_best < 0:
                best, t_best, w_best = min(best, d), t, w
                at[k, 0], at[k, 1] = found[0], found[1]
        triangle[k], where[k] = _first(
            P, C, T, curved, flats, kinds, groups, start, members, p, t_best, w_best, at[k], x, xe, xz
        )


@njit(cache=True, error_model="numpy")
def _of_patch(C, xe, xz, x, p, n, H):
    """Gap of p over the foot x of a patch with derivatives xe, xz; normal n (3,) and H = ∂n/∂p (3, 3).

    With the fundamental forms G and L: dn = −E G⁻¹ L (G − g L)⁻¹ Eᵀ dp.
    """
    n[0] = xe[1] * xz[2] - xe[2] * xz[1]
    n[1] = xe[2] * xz[0] - xe[0] * xz[2]
    n[2] = xe[0] * xz[1] - xe[1] * xz[0]
    size, g = np.sqrt(_dot(n, n)), 0.0
    for i in range(3):
        n[i] /= size
        g += n[i] * (p[i] - x[i])
    b0, b1, b2 = _dot(n, C[0]), _dot(n, C[1]), _dot(n, C[2])
    g11, g12, g22 = _dot(xe, xe), _dot(xe, xz), _dot(xz, xz)
    l11, l12, l22 = 2.0 * b0, -b0 - b1 + b2, 2.0 * b1
    m11, m12, m22 = g11 - g * l11, g12 - g * l12, g22 - g * l22
    det_g, det_m = g11 * g22 - g12 * g12, m11 * m22 - m12 * m12
    for j in range(3):
        be, bz = (m22 * xe[j] - m12 * xz[j]) / det_m, (m11 * xz[j] - m12 * xe[j]) / det_m
        le, lz = -(l11 * be + l12 * bz), -(l12 * be + l22 * bz)
        ge, gz = (g22 * le - g12 * lz) / det_g, (g11 * lz - g12 * le) / det_g
        for i in range(3):
            H[i, j] = xe[i] * ge + xz[i] * gz
    return g


@njit(cache=True, error_model="numpy")
def _fan(foot, t, bend, mean, outside, p, least, n, H):
    """Gap of p over a sharp place at ``foot``; t (3,): tangent of the side there, 0 at corners; bend (3,): half its derivative.

    ``mean`` (3,): mean normal, which says on which side of the surface p is, if it is not ``outside`` in any case; ``least``:
    distance below which it is the normal.
    """
    d, side = np.empty(3), 0.0
    for i in range(3):
        d[i] = p[i] - foot[i]
        side += d[i] * mean[i]
    r, sign = np.sqrt(_dot(d, d)), 1.0 if outside or side >= 0.0 else -1.0
    length = _dot(t, t)
    along = 0.0
    if length > 0.0:
        along = 1.0 / (length - 2.0 * _dot(d, bend))
    for i in range(3):
        n[i] = sign * d[i] / r if r > least else mean[i]
    for i in range(3):
        for j in range(3):
            H[i, j] = sign / max(r, least) * ((1.0 if i == j else 0.0) - n[i] * n[j] - along * t[i] * t[j])
    return sign * r


@njit(cache=True, error_model="numpy")
def _place(where, at):
    """Parameters e, z of a place that `_nearest_of` found."""
    s = at[0]
    if where == _WITHIN:
        return at[0], at[1]
    if where == _SIDE:
        return s, 0.0
    if where == _SIDE + 1:
        return 1.0, s
    if where == _SIDE + 2:
        return s, s
    return (0.0, 0.0) if where == _CORNER else ((1.0, 0.0) if where == _CORNER + 1 else (1.0, 1.0))


@njit(cache=True, error_model="numpy")
def closest(P, C, R, curved, kinds, means, slack, lip, least, xi, triangle, where, at, g, n, H, past):
    """Points xi (k, 3) and what `nearest` says of them → gaps g (k,), normals n (k, 3), H = ∂n/∂ξ (k, 3, 3), past (k,).

    kinds (m, 7): what sides 0 to 2 (from column 1) and corners 0 to 2 (from column 4) of triangles are; means (m, 7, 3): mean
    normals of the surface there; slack (m,): how far from a border a point is ``past`` it; ``lip``: radius of borders.
    """
    x, xe, xz, t, foot, q = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    none = np.zeros(3)
    for k in range(xi.shape[0]):
        p, m, w = xi[k], triangle[k], where[k]
        kind = kinds[m, w]
        e, z = _place(w, at[k])
        _at(P[m], C[m], e, z, foot, xe, xz)
        if kind != CREASE:
            e_foot, z_foot, there = _foot(P[m], C[m], p, e, z, x, xe, xz)
            # A curved patch is not followed farther than by its own size, nor where it has turned over.
            near = not curved[m] or (abs(e_foot - 0.5) <= 1.5 and abs(z_foot - 0.5) <= 1.5)
            if there and near and kind == BORDER:
                way = 0.0
                for i in range(3):
                    way += (x[i] - foot[i]) ** 2
                near = way <= slack[m] ** 2
            if there and near and _triple(xe, xz, means[m, 0]) > 0.0:
                g[k] = _of_patch(C[m], xe, xz, x, p, n[k], H[k])
                continue
        past[k] = kind == BORDER
        behind = lip if past[k] else 0.0
        for i in range(3):  # from the curve behind the border p is where q is from the border
            q[i] = p[i] + behind * means[m, w, i]
        if w >= _CORNER or w == _WITHIN:
            g[k] = _fan(foot, none, none, means[m, w], past[k], q, least, n[k], H[k]) - behind
            continue
        a, b, c, s = P[m, 1 if w == _SIDE + 1 else 0], P[m, 1 if w == _SIDE else 2], R[m, w - _SIDE], at[k, 0]
        if past[k]:
            s = _on_side(a, b, c, q)[1]
        for i in range(3):
            foot[i] = a[i] + (b[i] - a[i]) * s - c[i] * (s * (1.0 - s))
            t[i] = b[i] - a[i] - c[i] * (1.0 - 2.0 * s) if 0.0 < s < 1.0 else 0.0
        g[k] = _fan(foot, t, c, means[m, w], past[k], q, least, n[k], H[k]) - behind
