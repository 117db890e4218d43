"""Lines and arcs of drawings, and curves turned into arcs within a tolerance."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from math import atan2, cos, hypot, inf, pi, sin, sqrt, tan
from typing import NamedTuple

from prensa.precision import NEGLIGIBLE

Point = tuple[float, float]


class Segment(NamedTuple):
    """A line (``through`` None) or an arc from ``start`` to ``end``; ``layer`` of the drawing."""

    start: Point
    end: Point
    through: Point | None = None
    layer: str = ""

    def turned(self) -> Segment:
        """The same, walked the other way."""
        return self._replace(start=self.end, end=self.start)

    @property
    def kind(self) -> str:
        """The word for it, with its article."""
        return "a line" if self.through is None else "an arc"

    def circle(self) -> tuple[Point, float, float, float]:
        """Centre, radius, angle of the start and sweep (rad, positive counter-clockwise); radius inf of what is straight."""
        (ax, ay), (bx, by) = self.start, self.end
        mx, my = self.through or self.end
        ux, uy, vx, vy = mx - ax, my - ay, bx - ax, by - ay
        twice = 2 * (ux * vy - uy * vx)
        uu, vv = ux * ux + uy * uy, vx * vx + vy * vy
        if abs(twice) <= NEGLIGIBLE * sqrt(uu * vv):
            return self.start, inf, 0.0, 0.0
        cx, cy = (vy * uu - uy * vv) / twice, (ux * vv - vx * uu) / twice
        start, side = atan2(-cy, -cx), 1.0 if twice > 0 else -1.0
        sweep = side * (atan2(vy - cy, vx - cx) - start) % (2 * pi)
        return (ax + cx, ay + cy), hypot(cx, cy), start, side * sweep

    def straightened(self) -> Segment:
        """The same, as a line where its arc is straight by rounding."""
        return self._replace(through=None) if self.through is not None and self.circle()[1] == inf else self

    def corners(self) -> list[Point]:
        """Points whose box is that of the segment: the ends, and on an arc the outermost points."""
        points = [self.start, self.end]
        if self.through is not None:
            c, r, start, sweep = self.circle()
            for quarter in range(4):
                if ((quarter * pi / 2 - start) * (1 if sweep > 0 else -1)) % (2 * pi) <= abs(sweep):
                    points.append((c[0] + r * cos(quarter * pi / 2), c[1] + r * sin(quarter * pi / 2)))
        return points

    def distance(self, x: Point) -> float:
        """Distance of a point from the line or arc."""
        ends = min(hypot(x[0] - e[0], x[1] - e[1]) for e in (self.start, self.end))
        if self.through is not None:
            c, r, start, sweep = self.circle()
            turn = (atan2(x[1] - c[1], x[0] - c[0]) - start) * (1 if sweep > 0 else -1)
            return abs(hypot(x[0] - c[0], x[1] - c[1]) - r) if turn % (2 * pi) <= abs(sweep) else ends
        (ax, ay), (bx, by) = self.start, self.end
        length = hypot(bx - ax, by - ay)
        along = ((x[0] - ax) * (bx - ax) + (x[1] - ay) * (by - ay)) / length
        return abs((x[0] - ax) * (by - ay) - (x[1] - ay) * (bx - ax)) / length if 0 <= along <= length else ends


def box(segments: list[Segment]) -> tuple[float, float, float, float]:
    """Least and largest x, least and largest y."""
    x, y = zip(*(p for s in segments for p in s.corners()))
    return min(x), max(x), min(y), max(y)


def size_of(segments: list[Segment]) -> float:
    """Longer side of the box."""
    left, right, low, high = box(segments)
    return max(right - left, high - low)


# ------------------------------------------------------------------------------------------------------------- curves
class Curve(NamedTuple):
    """A curve by its ``point`` and derivative, ``slope``, at a parameter; it may bend or break at the rising ``stations``."""

    point: Callable[[float], Point]
    slope: Callable[[float], Point]
    stations: tuple[float, ...]
    layer: str
    kind: str

    def chords(self) -> Iterator[Segment]:
        """Lines between places on it, two from station to station."""
        for a, b in pairwise(self.stations):
            middle = self.point(0.5 * (a + b))
            yield from (Segment(self.point(a), middle), Segment(middle, self.point(b)))


class _Station(NamedTuple):
    """A parameter, the place and the unit tangent there."""

    t: float
    x: Point
    tangent: Point


def arcs_of(curve: Curve, tolerance: float, most: int) -> tuple[list[Segment], float]:
    """Arcs with the tangents of a curve at their ends, two for each piece of it, and their largest distance from it.

    Pieces are halved, sixteen times at most, until the arcs are within the tolerance. Biarcs: K. M. Bolton, Biarc curves,
    Computer-Aided Design 7 (1975) 89-92, here with tangents of equal length, so that a curve walked the other way has the same
    arcs.

    Raises
    ------
    ValueError
        If the curve has a cusp that no arcs follow within the tolerance, or needs more than ``most`` pieces.

    """
    out: list[Segment] = []
    worst, count = 0.0, 0
    for a, b in pairwise(curve.stations):
        # tangents beside the stations: a spline may have a corner there
        inside = NEGLIGIBLE * (b - a)
        first = _Station(a, curve.point(a), _unit(curve, a + inside, b - a))
        last = _Station(b, curve.point(b), _unit(curve, b - inside, a - b))
        for piece, off in _pieces(curve, first, last, tolerance, 16):
            out += piece
            worst, count = max(worst, off), count + 1
            if count > most:
                where = f"a {curve.kind} on the layer {curve.layer!r} near ({first.x[0]:g}, {first.x[1]:g})"
                raise ValueError(f"{where} of more than {2 * most} arcs; give a larger 'tolerance' than {tolerance:.2g}")
    return out, worst


def _unit(curve: Curve, t: float, way: float) -> Point:
    """Direction of a curve; where its derivative vanishes, that of the chord a little way on."""
    dx, dy = curve.slope(t)
    length = hypot(dx, dy)
    (ax, ay), (bx, by) = curve.point(t), curve.point(t + sqrt(NEGLIGIBLE) * way)
    chord = hypot(bx - ax, by - ay)
    if length * abs(way) <= sqrt(NEGLIGIBLE) * chord and chord > 0:
        sign = 1.0 if way > 0 else -1.0
        return sign * (bx - ax) / chord, sign * (by - ay) / chord
    return (dx / length, dy / length) if length else (1.0, 0.0)


def _pieces(
    curve: Curve, a: _Station, b: _Station, tolerance: float, left: int
) -> Iterator[tuple[list[Segment], float]]:  # fmt: skip
    if a.x == b.x and _small(curve, a, b, tolerance):
        yield [], 0.0
        return
    pair = _biarc(a, b)
    off = inf if pair is None else _off(curve, a, b, pair)
    if pair is not None and off <= tolerance:
        yield [s._replace(layer=curve.layer).straightened() for s in pair if s.start != s.end], off
        return
    if not left:
        raise ValueError(
            f"a {curve.kind} on the layer {curve.layer!r} that arcs cannot follow within {tolerance:.2g} near "
            f"({a.x[0]:g}, {a.x[1]:g}); give a larger 'tolerance', or draw that place with lines and arcs"
        )
    t = 0.5 * (a.t + b.t)
    middle = _Station(t, curve.point(t), _unit(curve, t, b.t - a.t))
    yield from _pieces(curve, a, middle, tolerance, left - 1)
    yield from _pieces(curve, middle, b, tolerance, left - 1)


def _small(curve: Curve, a: _Station, b: _Station, tolerance: float) -> bool:
    """Whether a piece that returns to its beginning does not go anywhere."""
    return all(hypot(x[0] - a.x[0], x[1] - a.x[1]) <= tolerance for x in _samples(curve, a, b))


def _samples(curve: Curve, a: _Station, b: _Station) -> Iterator[Point]:
    """Places on a piece: fifteen, of which either arc of a pair has about seven."""
    return (curve.point(a.t + (b.t - a.t) * k / 16) for k in range(1, 16))


def _biarc(a: _Station, b: _Station) -> list[Segment] | None:
    """Two arcs from a to b with their tangents there, and one of their own between; None where they turn too far."""
    vx, vy = b.x[0] - a.x[0], b.x[1] - a.x[1]
    (px, py), (qx, qy) = a.tangent, b.tangent
    vv, vt = vx * vx + vy * vy, vx * (px + qx) + vy * (py + qy)
    # each tangent within 60° of the chord: otherwise the piece is halved
    if min(vx * px + vy * py, vx * qx + vy * qy) <= 0.5 * sqrt(vv):
        return None
    # The tangents of length d meet the common one: d² (2 − 2 cos) + 2 d v·t − v·v = 0, written so that nothing cancels.
    bend = 2.0 * (1.0 - (px * qx + py * qy))
    d = vv / (vt + sqrt(vt * vt + bend * vv)) if bend > 0 else 0.5 * vv / vt
    middle = (0.5 * (a.x[0] + b.x[0] + d * (px - qx)), 0.5 * (a.x[1] + b.x[1] + d * (py - qy)))
    return [_arc(a.x, a.tangent, middle), _arc(b.x, (-qx, -qy), middle).turned()]


def _arc(start: Point, tangent: Point, end: Point) -> Segment:
    """Arc from a point with a unit tangent there."""
    cx, cy = end[0] - start[0], end[1] - start[1]
    angle = atan2(cx * tangent[1] - cy * tangent[0], cx * tangent[0] + cy * tangent[1])
    rise = 0.5 * tan(0.5 * angle)
    return Segment(start, end, (start[0] + 0.5 * cx - rise * cy, start[1] + 0.5 * cy + rise * cx))


def _off(curve: Curve, a: _Station, b: _Station, pair: list[Segment]) -> float:
    """Largest distance of a piece from its two arcs: at the top of the parabola through the largest sample and its neighbours."""
    arcs = [s for s in pair if s.start != s.end]
    off = [0.0, *(min(s.distance(x) for s in arcs) for x in _samples(curve, a, b)), 0.0]
    k = max(range(1, len(off) - 1), key=lambda k: off[k])
    before, top, after = off[k - 1 : k + 2]
    bend = 2 * top - before - after
    return top + (after - before) ** 2 / (8 * bend) if bend > 0 else top
