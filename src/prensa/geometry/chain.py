"""Chains of lines and arcs: the outline of a profile from its points, with fillets at the corners. Plain arithmetic.

Somebody who walks along a chain has the tool on the left. Corners that turn left are convex (the tool's edge), those that
turn right are concave. An open chain goes on straight beyond both ends.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import atan2, cos, hypot, inf, isfinite, pi, sin, sqrt, tan
from typing import Any

from prensa.geometry.boxes import meeting_boxes
from prensa.precision import DRAWN, NEGLIGIBLE

Point = tuple[float, float]

CUSP = pi - DRAWN  # turn at which a chain doubles back on itself
SHARE = 0.4  # of the shorter neighbour that an automatic fillet may take


class ChainError(ValueError):
    """A chain that cannot be built; ``point``: index of the point where, ``key``: the key to change."""

    def __init__(self, message: str, point: int | None = None, key: str = "points") -> None:
        super().__init__(message)
        self.point, self.key = point, key


@dataclass(frozen=True)
class Piece:
    """A line or an arc between the coordinates ``lo`` and ``hi`` (lengths along it; infinite on an endless side).

    Line: ``origin`` and unit ``direction``. Arc (``radius`` > 0): ``origin`` is the centre, ``angle`` the direction of
    its coordinate 0, ``side`` +1 where it is walked counter-clockwise (convex), −1 clockwise (concave).
    ``point``: index of the point of the description at its start.
    """

    origin: Point
    direction: Point
    lo: float
    hi: float
    radius: float = 0.0
    angle: float = 0.0
    side: int = 0
    point: int = 0

    @property
    def length(self) -> float:
        """Length, inf for the ends of an open chain."""
        return self.hi - self.lo

    @cached_property
    def box(self) -> tuple[float, float, float, float]:
        """Least and largest x, least and largest y."""
        if self.radius:
            # of the whole circle where it may bulge: a little too large is good enough
            (x, y), r = self.origin, self.radius
            if self.length > 0.5 * pi * r:
                return x - r, x + r, y - r, y + r
            rise = r * (1 - cos(0.5 * self.length / r))
            (ax, ay), (bx, by) = self.at(self.lo), self.at(self.hi)
            return min(ax, bx) - rise, max(ax, bx) + rise, min(ay, by) - rise, max(ay, by) + rise
        out = []
        for k in range(2):
            d = self.direction[k]
            values = [self.origin[k] + t * d if isfinite(t) else (t * d if d else self.origin[k]) for t in (self.lo, self.hi)]
            out += [min(values), max(values)]
        return out[0], out[1], out[2], out[3]

    def at(self, t: float) -> Point:
        """Place at the coordinate t."""
        if not self.radius:
            return self.origin[0] + t * self.direction[0], self.origin[1] + t * self.direction[1]
        a = self.angle + self.side * t / self.radius
        return self.origin[0] + self.radius * cos(a), self.origin[1] + self.radius * sin(a)

    def tangent(self, t: float) -> Point:
        """Unit vector of the walk at the coordinate t."""
        if not self.radius:
            return self.direction
        a = self.angle + self.side * t / self.radius
        return -self.side * sin(a), self.side * cos(a)

    def coordinate(self, x: Point) -> float:
        """Coordinate of the foot of x; on arcs the one nearest to the middle, so that it may lie outside lo … hi."""
        dx, dy = x[0] - self.origin[0], x[1] - self.origin[1]
        if not self.radius:
            return dx * self.direction[0] + dy * self.direction[1]
        middle = 0.5 * (self.lo + self.hi) / self.radius
        turn = self.side * (atan2(dy, dx) - self.angle) - middle
        return self.radius * (middle + turn - 2 * pi * round(turn / (2 * pi)))

    def moved(self, distance: float) -> Piece | None:
        """The endless line or the circle at a distance to the left; None where nothing is left of a circle."""
        if not self.radius:
            (x, y), (dx, dy) = self.origin, self.direction
            return replace(self, origin=(x - distance * dy, y + distance * dx))
        radius = self.radius - self.side * distance
        return replace(self, radius=radius) if radius > 0 else None


def corner(p: Piece, q: Piece) -> float:
    """Turn (rad) from the end of p to the start of q, left positive."""
    (ax, ay), (bx, by) = p.tangent(p.hi), q.tangent(q.lo)
    return atan2(ax * by - ay * bx, ax * bx + ay * by)


def _ends(item: Any) -> Point:
    return tuple(item.to) if hasattr(item, "to") else tuple(item)


def _line(a: Point, b: Point, point: int) -> Piece:
    length = hypot(b[0] - a[0], b[1] - a[1])
    return Piece(a, ((b[0] - a[0]) / length, (b[1] - a[1]) / length), 0.0, length, point=point)


def _arc(a: Point, m: Point, b: Point, point: int) -> Piece:
    """Arc from a through m to b."""
    ux, uy, vx, vy = m[0] - a[0], m[1] - a[1], b[0] - a[0], b[1] - a[1]
    twice = 2 * (ux * vy - uy * vx)
    uu, vv = ux * ux + uy * uy, vx * vx + vy * vy
    if abs(twice) <= NEGLIGIBLE * sqrt(uu * vv):
        raise ChainError(
            f"the arc through {shown(m)} is straight; write its end {shown(b)} as a plain point", point + 1
        )
    cx, cy = (vy * uu - uy * vv) / twice, (ux * vv - vx * uu) / twice
    radius = hypot(cx, cy)
    side = 1 if twice > 0 else -1
    start = atan2(-cy, -cx)
    sweep = side * (atan2(vy - cy, vx - cx) - start) % (2 * pi)
    return Piece((a[0] + cx, a[1] + cy), (0.0, 0.0), 0.0, radius * sweep, radius, start, side, point)


def shown(x: Point) -> str:
    """A point in a message."""
    return f"({x[0]:g}, {x[1]:g})"


def pieces(points: Sequence[Any], closed: bool) -> list[Piece]:
    """Lines and arcs between the points (pairs, or objects with ``through`` and ``to``), corners sharp.

    Raises
    ------
    ChainError
        For too few points, neighbours that coincide, straight arcs, a chain that doubles back.

    """
    least = 3 if closed else 2
    arcs = any(hasattr(p, "to") for p in points)
    if len(points) < (least - arcs if closed else least):
        raise ChainError(f"{len(points)} points; give at least {least}")
    if hasattr(points[0], "to"):
        raise ChainError("an arc cannot be the first point: it begins at the point before", 0)
    ends = [_ends(p) for p in points]
    size = max(max(c) - min(c) for c in zip(*ends))
    out = []
    for k in range(len(points) - (not closed)):
        n = (k + 1) % len(points)
        a, b = ends[k], ends[n]
        if hypot(b[0] - a[0], b[1] - a[1]) <= NEGLIGIBLE * size:
            if n == 0 and hasattr(points[k], "to"):
                break  # the last arc has closed the chain
            hint = "; a closed chain returns to its first point by itself" if closed and n == 0 else ""
            raise ChainError(f"points {k} and {n} coincide at {shown(a)}; leave one out{hint}", n or k)
        item = points[n]
        out.append(_arc(a, tuple(item.through), b, k) if hasattr(item, "to") and n else _line(a, b, k))
    if not closed:
        out = [*_endless(out[0], -1), *out[1:]]
        out = [*out[:-1], *_endless(out[-1], 1)]
    for p, q in _joints(out, closed):
        if abs(corner(p, q)) >= CUSP:
            raise ChainError(f"the chain doubles back at {shown(q.at(q.lo))}; move one of its neighbours", q.point)
    return out


def _endless(p: Piece, way: int) -> list[Piece]:
    """The first (way −1) or last (+1) piece of an open chain, prolonged along its tangent."""
    if not p.radius:
        return [replace(p, lo=-inf) if way < 0 else replace(p, hi=inf)]
    if way < 0:
        return [Piece(p.at(p.lo), p.tangent(p.lo), -inf, 0.0, point=p.point), p]
    return [p, Piece(p.at(p.hi), p.tangent(p.hi), 0.0, inf, point=p.point + 1)]


def _joints(chain: list[Piece], closed: bool) -> Iterator[tuple[Piece, Piece]]:
    yield from pairwise(chain)
    if closed:
        yield chain[-1], chain[0]


# ------------------------------------------------------------------------------------------------------------- fillets
def crossings(p: Piece, q: Piece) -> list[Point]:
    """Points that the endless lines or whole circles of two pieces have in common (up to two; none where parallel)."""
    if not p.radius and not q.radius:
        (ax, ay), (bx, by) = p.direction, q.direction
        cross = ax * by - ay * bx
        if abs(cross) <= NEGLIGIBLE:
            return []
        dx, dy = q.origin[0] - p.origin[0], q.origin[1] - p.origin[1]
        return [p.at((dx * by - dy * bx) / cross)]
    if not p.radius:
        p, q = q, p
    cx, cy = p.origin
    if not q.radius:
        t = q.coordinate((cx, cy))
        fx, fy = q.at(t)
        away = hypot(fx - cx, fy - cy)
        # As a product: the difference of the squares cancels where the line all but touches the circle.
        half = (p.radius - away) * (p.radius + away)
        if half < -NEGLIGIBLE * p.radius * p.radius:
            return []
        h = sqrt(max(half, 0.0))
        return [q.at(t - h), q.at(t + h)]
    dx, dy = q.origin[0] - cx, q.origin[1] - cy
    d = hypot(dx, dy)
    if d <= NEGLIGIBLE * (p.radius + q.radius):
        return []
    along = (d * d + p.radius**2 - q.radius**2) / (2 * d)
    half = p.radius**2 - along**2
    if half < -NEGLIGIBLE * p.radius**2:
        return []
    h = sqrt(max(half, 0.0))
    return [(cx + (along * dx - s * h * dy) / d, cy + (along * dy + s * h * dx) / d) for s in (-1, 1)]


def _fillet(p: Piece, q: Piece, radius: float, slack: float) -> tuple[Piece, Piece, Piece] | None:
    """First piece shortened, the arc, second piece shortened; None where an arc of that radius does not fit."""
    side = 1 if corner(p, q) > 0 else -1
    a, b = p.moved(side * radius), q.moved(side * radius)
    if a is None or b is None:
        return None
    vertex = q.at(q.lo)
    fits = []
    for c in crossings(a, b):
        tp, tq = p.coordinate(c), q.coordinate(c)
        if p.lo - slack <= tp <= p.hi + slack and q.lo - slack <= tq <= q.hi + slack:
            fits.append((hypot(c[0] - vertex[0], c[1] - vertex[1]), c, max(tp, p.lo), min(tq, q.hi)))
    if not fits:
        return None
    # Lines and arcs may be touched by up to four such circles: the one nearest to the corner is its fillet.
    _, c, tp, tq = min(fits)
    (x0, y0), (x1, y1) = p.at(tp), q.at(tq)
    start = atan2(y0 - c[1], x0 - c[0])
    sweep = side * (atan2(y1 - c[1], x1 - c[0]) - start) % (2 * pi)
    if sweep >= pi:  # round-off at a flat corner, or the wrong side of a short neighbour
        return None
    arc = Piece(c, (0.0, 0.0), 0.0, radius * sweep, radius, start, side, q.point)
    return replace(p, hi=tp), arc, replace(q, lo=tq)


def _rounded(chain: list[Piece], radii: Sequence[float], closed: bool, slack: float) -> list[Piece]:
    """The chain with the fillet ``radii[i]`` at the corner before piece i; raises `ChainError` where one does not fit."""
    out = list(chain)
    arcs: dict[int, Piece] = {}
    for i in range(0 if closed else 1, len(out)):
        before = (i - 1) % len(out)
        if radii[i] <= 0 or abs(corner(out[before], out[i])) <= DRAWN:
            continue
        made = _fillet(out[before], out[i], radii[i], slack)
        if made is None:
            raise ChainError(
                f"the fillet {radii[i]:g} does not fit at point {out[i].point}, {shown(chain[i].at(chain[i].lo))}",
                out[i].point,
                "fillet",
            )
        out[before], arcs[i], out[i] = made
    return [p for i, q in enumerate(out) for p in (arcs.get(i), q) if p is not None and p.length > slack]


def chain(points: Sequence[Any], fillet: Any, closed: bool, automatic: float = 0.0) -> list[Piece]:
    """The outline of a description.

    Parameters
    ----------
    points, closed
        As in `prensa.Profile`.
    fillet
        One radius for all corners, a list with one for each point, or None: ``automatic``, smaller where it must be.
    automatic
        That radius.

    Raises
    ------
    ChainError
        For points that make no chain, a fillet that does not fit (with the largest that does), a chain that crosses
        itself.

    """
    sharp = pieces(points, closed)
    size = max(hypot(*_ends(p)) for p in points)
    slack = NEGLIGIBLE * size
    radii = _radii(sharp, points, fillet, closed, automatic)
    try:
        out = _rounded(sharp, radii, closed, slack)
    except ChainError as error:
        if fillet is None:  # neighbours of an odd shape: no automatic fillets then
            out = sharp
        else:
            lo, hi = 0.0, 1.0
            for _ in range(30):
                mid = 0.5 * (lo + hi)
                # For the message alone: the largest share of the radii that still fits.
                lo, hi = (mid, hi) if _fits(sharp, [mid * r for r in radii], closed, slack) else (lo, mid)
            raise ChainError(
                f"{error}; {lo * radii[_index(sharp, error.point)]:.3g} does", error.point, "fillet"
            ) from None
    crossing = _self_crossing(out, closed, slack)
    if crossing is not None:
        p, q, x = crossing
        raise ChainError(
            f"the chain crosses itself near {shown(x)}, between points {p.point} and {p.point + 1} and points {q.point} "
            f"and {q.point + 1}; an open chain goes on straight beyond its ends: add a point to end it elsewhere",
            q.point,
        )
    return out


def _index(chain: list[Piece], point: int | None) -> int:
    return next(i for i, p in enumerate(chain) if p.point == point and (p.lo > -inf or i > 0))


def _fits(sharp: list[Piece], radii: list[float], closed: bool, slack: float) -> bool:
    try:
        _rounded(sharp, radii, closed, slack)
    except ChainError:
        return False
    return True


def _radii(sharp: list[Piece], points: Sequence[Any], fillet: Any, closed: bool, automatic: float) -> list[float]:
    """Fillet radius at the corner before each piece."""
    if isinstance(fillet, list | tuple):
        if len(fillet) != len(points):
            raise ChainError(f"{len(fillet)} radii for {len(points)} points; give one for each point", None, "fillet")
        if not closed and (fillet[0] or fillet[-1]):
            raise ChainError("the ends of an open profile are not corners; their radii are 0", None, "fillet")
        return [float(fillet[p.point]) if p.point < len(points) else 0.0 for p in sharp]
    if fillet is not None:
        return [float(fillet)] * len(sharp)
    out = []
    for i, q in enumerate(sharp):
        if not closed and i == 0:
            out.append(0.0)
            continue
        p = sharp[i - 1]
        turn = corner(p, q)  # a concave corner has nothing to slide over: a fillet there would only take room
        room = SHARE * min(p.length, q.length, *(x.radius for x in (p, q) if x.radius))
        out.append(min(automatic, room / tan(0.5 * turn)) if turn > DRAWN and automatic > 0 else 0.0)
    return out


# ------------------------------------------------------------------------------------------------------- crossing itself
def _self_crossing(chain: list[Piece], closed: bool, slack: float) -> tuple[Piece, Piece, Point] | None:
    """Two pieces and a point that both pass through away from the joint they share."""
    for pair in meeting_boxes([p.box for p in chain], slack):
        a, b = min(pair), max(pair)
        x = _meeting(chain[a], chain[b], _shared(chain, a, b, closed), slack)
        if x is not None:
            return chain[a], chain[b], x
    return None


def _shared(chain: list[Piece], a: int, b: int, closed: bool) -> list[Point]:
    out = []
    if b == a + 1:
        out.append(chain[b].at(chain[b].lo))
    if closed and a == 0 and b == len(chain) - 1:
        out.append(chain[0].at(chain[0].lo))
    return out


def _meeting(p: Piece, q: Piece, joints: list[Point], slack: float) -> Point | None:
    near = 10 * slack
    found = crossings(p, q)
    if not found:  # parallel lines and circles about one centre meet where they lie on each other
        found = [x.at(t) for x in (p, q) for t in (x.lo, x.hi) if isfinite(t)]
        found = [x for x in found if _distance(p, x) <= slack and _distance(q, x) <= slack]
    for x in found:
        if any(hypot(x[0] - v[0], x[1] - v[1]) <= near for v in joints):
            continue
        if all(c.lo - slack <= c.coordinate(x) <= c.hi + slack for c in (p, q)):
            # smooth neighbours are tangent: their crossings scatter about the joint by the root of the round-off
            if joints and any(hypot(x[0] - v[0], x[1] - v[1]) <= 1e-4 * min(p.length, q.length) for v in joints):
                continue
            return x
    return None


def _distance(p: Piece, x: Point) -> float:
    if p.radius:
        return abs(hypot(x[0] - p.origin[0], x[1] - p.origin[1]) - p.radius)
    y = p.at(p.coordinate(x))
    return hypot(x[0] - y[0], x[1] - y[1])


def signed_area(chain: Sequence[Piece]) -> float:
    """Area inside a closed chain, positive where it is walked counter-clockwise."""
    total = 0.0
    for p in chain:
        (ax, ay), (bx, by) = p.at(p.lo), p.at(p.hi)
        total += 0.5 * (ax * by - ay * bx)
        if p.radius:
            sweep = p.length / p.radius
            total += 0.5 * p.side * p.radius**2 * (sweep - sin(sweep))
    return total


def drawn(chain: Sequence[Piece], reach: float, degrees: float = 2.0) -> list[Point]:
    """Points of a chain, arcs in steps of ``degrees``, endless ends cut at ``reach``, a line alone that far from (0, 0) too."""
    out: list[Point] = []
    for p in chain:
        lo, hi = (p.lo if isfinite(p.lo) else p.hi - reach), (p.hi if isfinite(p.hi) else p.lo + reach)
        if not isfinite(p.lo) and not isfinite(p.hi):
            far = reach + hypot(*p.origin)
            lo, hi = -far, far
        n = 1 if not p.radius else max(1, round((hi - lo) / p.radius / (degrees * pi / 180)))
        out += [p.at(lo + (hi - lo) * k / n) for k in range(n + (p is chain[-1]))]
    return out
