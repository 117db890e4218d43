"""Chains of the lines and arcs of a drawing: doubles merged, gaps joined, ends found that meet."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import combinations
from math import atan2, cos, hypot, inf, pi, sin
from typing import NamedTuple

from prensa.geometry.boxes import meeting_boxes
from prensa.geometry.chain import shown
from prensa.importers.segments import Point, Segment, box, size_of


class Chain(NamedTuple):
    """Lines and arcs one after the other, from the left end or counter-clockwise; in any order where there is a ``branch``."""

    segments: list[Segment]
    closed: bool
    branch: Point | None = None

    def line(self) -> str:
        """What it is, for lists of chains."""
        left, right, low, high = box(self.segments)
        layers = ", ".join(map(repr, dict.fromkeys(s.layer for s in self.segments)))
        many = len(self.segments)
        how = f"branches at {shown(self.branch)}" if self.branch else "closed" if self.closed else "open"
        return f"layer {layers}, x {left:g} … {right:g}, y {low:g} … {high:g}, {many} segment{'s' * (many > 1)}, {how}"


class Gap(NamedTuple):
    """Two ends apart."""

    a: Point
    b: Point

    @property
    def width(self) -> float:
        """Distance of the two."""
        return distance(self.a, self.b)


def distance(a: Point, b: Point) -> float:
    """Distance of two points."""
    return hypot(a[0] - b[0], a[1] - b[1])


class _Grid:
    """Places by number, found in squares as wide as the distance ``near`` within which they are looked for."""

    def __init__(self, near: float) -> None:
        self.near = near
        self.places: list[Point] = []
        self._squares: dict[tuple[int, int], list[int]] = {}

    def _square(self, x: Point) -> tuple[int, int]:
        return int(x[0] // self.near), int(x[1] // self.near)

    def around(self, x: Point) -> list[int]:
        """Numbers of the places within the distance."""
        i, j = self._square(x)
        found = (k for a in (-1, 0, 1) for b in (-1, 0, 1) for k in self._squares.get((i + a, j + b), ()))
        return [k for k in found if distance(x, self.places[k]) <= self.near]

    def add(self, x: Point) -> int:
        """Number of a new place."""
        self.places.append(x)
        self._squares.setdefault(self._square(x), []).append(len(self.places) - 1)
        return len(self.places) - 1


class _Ends:
    """Ends of segments by number, those within ``near`` of one another one; ``meets``: the segments at each."""

    def __init__(self, segments: Sequence[Segment], near: float) -> None:
        grid = _Grid(near)
        self.places = grid.places
        self.pairs: list[tuple[int, int]] = []
        self.meets: dict[int, list[int]] = {}
        for i, s in enumerate(segments):
            pair = tuple(next(iter(grid.around(x)), None) for x in (s.start, s.end))
            first, last = (grid.add(x) if k is None else k for k, x in zip(pair, (s.start, s.end)))
            self.pairs.append((first, last))
            for end in (first, last):
                self.meets.setdefault(end, []).append(i)


# ------------------------------------------------------------------------------------------------------------- doubles
def merged(segments: Sequence[Segment], near: float) -> tuple[list[Segment], list[str]]:
    """Segments without doubles and overlaps, and sentences about these; ``near``: distance within which places are one.

    Lines on one line, and arcs on one circle, that overlap are made one where their inner ends belong to no other segment: the
    outlines of two bodies that touch along a side stay as they are.
    """
    once, said = _without_doubles(segments, near)
    ends = _Ends(once, near)
    # Overlaps leave ends at which not exactly two segments meet.
    if all(len(several) == 2 for several in ends.meets.values()):
        return once, said
    gone: set[int] = set()
    new: list[Segment] = []
    for group in _groups(len(once), _overlaps(once, near)):
        union = _union([once[i] for i in group], near)
        kept = [x for s in (union if len(union) == 1 else ()) for x in (s.start, s.end)]
        inner = {e for i in group for e in ends.pairs[i] if all(distance(ends.places[e], x) > near for x in kept)}
        if all(group.issuperset(ends.meets[e]) for e in inner):
            gone |= group
            new += union
            words = f"{len(group)} {'lines' if union[0].through is None else 'arcs'}"
            said.append(f"{words} overlap from {shown(union[0].start)} to {shown(union[-1].end)} and are taken as one")
    return [s for i, s in enumerate(once) if i not in gone] + new, said


def _without_doubles(segments: Sequence[Segment], near: float) -> tuple[list[Segment], list[str]]:
    """Segments that are not the same as one before."""
    ends = _Ends(segments, near)
    known: dict[frozenset[int], list[int]] = {}
    copies: dict[int, int] = {}
    for i, (s, pair) in enumerate(zip(segments, ends.pairs)):
        some = known.setdefault(frozenset(pair), [])
        # two half circles between the same ends differ in the places half way
        same = next((j for j in some if distance(_middle(s), _middle(segments[j])) <= near), None)
        if same is None:
            some.append(i)
            copies[i] = 1
        else:
            copies[same] += 1
    said = []
    for s, n in ((segments[i], n) for i, n in copies.items() if n > 1):
        said.append(f"{s.kind} is drawn {'twice' if n == 2 else f'{n} times'}, from {shown(s.start)} to {shown(s.end)}")
    return [segments[i] for i in copies], said


def _middle(s: Segment) -> Point:
    """Place half way along."""
    if s.through is None:
        return 0.5 * (s.start[0] + s.end[0]), 0.5 * (s.start[1] + s.end[1])
    c, r, start, sweep = s.circle()
    return c[0] + r * cos(start + 0.5 * sweep), c[1] + r * sin(start + 0.5 * sweep)


def _overlaps(segments: Sequence[Segment], near: float) -> Iterator[tuple[int, int]]:
    """Pairs of segments that lie on one another for some way."""
    for i, j in meeting_boxes([box([s]) for s in segments], near):
        if _overlap(segments[i], segments[j], near):
            yield i, j


def _overlap(s: Segment, t: Segment, near: float) -> bool:
    """Whether two lines, or two arcs, lie within ``near`` of one another for longer than that."""
    if (s.through is None) != (t.through is None):
        return False
    longer, other = (s, t) if _length(s) >= _length(t) else (t, s)
    if longer.through is None:
        (ax, ay), (bx, by), length = longer.start, longer.end, _length(longer)
        off = [abs((x - ax) * (by - ay) - (y - ay) * (bx - ax)) / length for x, y in (other.start, other.end)]
        along = [((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length for x, y in (other.start, other.end)]
        return max(off) <= near and min(max(along), length) - max(min(along), 0.0) > near
    c, r, _, _ = longer.circle()
    if r == inf or any(abs(distance(x, c) - r) > near for x in (other.start, _middle(other), other.end)):
        return False
    (a, sweep), (b, way) = _interval(longer, c), _interval(other, c)
    ahead = (b - a) % (2 * pi)
    # on a circle two arcs may have two common stretches
    common = max(min(sweep, ahead + way) - ahead, min(sweep, ahead + way - 2 * pi))
    return common * r > near


def _length(s: Segment) -> float:
    if s.through is None:
        return distance(s.start, s.end)
    _, r, _, sweep = s.circle()
    return distance(s.start, s.end) if r == inf else r * abs(sweep)


def _interval(s: Segment, c: Point) -> tuple[float, float]:
    """Angle at which an arc begins, walked counter-clockwise round a centre, and its sweep as seen from there."""
    x, y = (s.start, s.end) if s.circle()[3] > 0 else (s.end, s.start)
    first, last = (atan2(p[1] - c[1], p[0] - c[0]) for p in (x, y))
    return first, (last - first) % (2 * pi)


def _groups(count: int, pairs: Iterable[tuple[int, int]]) -> list[set[int]]:
    """Sets of two and more numbers below ``count`` that pairs join."""
    group = {i: {i} for i in range(count)}
    for i, j in pairs:
        if group[i] is not group[j]:
            joined = group[i] | group[j]
            group.update((k, joined) for k in joined)
    return [g for i, g in group.items() if len(g) > 1 and i == min(g)]


def _union(group: list[Segment], near: float) -> list[Segment]:
    """What overlapping lines, or arcs, cover together: one segment, or the two halves of a circle."""
    base = max(group, key=_length)
    if base.through is None:
        (ax, ay), (bx, by) = base.start, base.end
        points = sorted(
            (x for s in group for x in (s.start, s.end)), key=lambda x: (x[0] - ax) * (bx - ax) + (x[1] - ay) * (by - ay)
        )
        return [base._replace(start=points[0], end=points[-1])]
    c, r, _, _ = base.circle()
    begin, sweep = _interval(base, c)
    low, high, slack = 0.0, sweep, near / r
    # each arc may lengthen what there is at either end; after as many rounds as there are arcs none does any more
    for _ in group:
        for s in group:
            first, way = _interval(s, c)
            ahead = (first - begin) % (2 * pi)
            for at in (ahead, ahead - 2 * pi):
                if at <= high + slack and at + way >= low - slack:
                    low, high = min(low, at), max(high, at + way)

    def place(angle: float) -> Point:
        return c[0] + r * cos(begin + angle), c[1] + r * sin(begin + angle)

    if high - low >= 2 * pi - slack:
        x = [place(k * pi / 2) for k in range(4)]
        return [base._replace(start=x[0], through=x[1], end=x[2]), base._replace(start=x[2], through=x[3], end=x[0])]
    drawn = [x for s in group for x in (s.start, s.end)]
    start, end = (min(drawn, key=partial(distance, e)) for e in (place(low), place(high)))
    return [base._replace(start=start, through=place(0.5 * (low + high)), end=end)]


# -------------------------------------------------------------------------------------------------------------- chains
def chains(segments: Sequence[Segment], near: float, gap: float) -> tuple[list[Chain], list[Gap]]:
    """Chains from the left to the right, and the gaps that were joined.

    ``near``: distance within which ends are one; ``gap``: largest distance of two free ends that are joined, nearest first, if
    it is no more than half as long as either segment.
    """
    ends = _Ends(segments, near)
    joined = _joined(segments, ends, gap) if gap > near else []
    for a, b in joined:
        for i in ends.meets.pop(b):
            ends.meets[a].append(i)
            ends.pairs[i] = tuple(a if e == b else e for e in ends.pairs[i])  # type: ignore[assignment]
    rest, out = set(range(len(segments))), []
    while rest:
        part, ahead = set[int](), [min(rest)]
        while ahead:
            i = ahead.pop()
            if i not in part:
                part.add(i)
                ahead += [j for e in ends.pairs[i] for j in ends.meets[e]]
        rest -= part
        out.append(_chain(segments, ends, sorted(part)))
    return from_left(out), [Gap(ends.places[a], ends.places[b]) for a, b in joined]


def from_left(some: Iterable[Chain]) -> list[Chain]:
    """Chains in the order of their left ends, then of their lower ones."""
    return sorted(some, key=lambda c: box(c.segments)[::2])


def _joined(segments: Sequence[Segment], ends: _Ends, gap: float) -> list[tuple[int, int]]:
    """Pairs of free ends to join."""
    free = {e: several[0] for e, several in ends.meets.items() if len(several) == 1}
    grid, numbers, pairs = _Grid(gap), list(free), []
    for k, e in enumerate(numbers):
        pairs += [(distance(ends.places[e], ends.places[numbers[j]]), numbers[j], e) for j in grid.around(ends.places[e])]
        assert grid.add(ends.places[e]) == k
    out, taken = [], set[int]()
    for width, a, b in sorted(pairs):
        shorter = min(_length(segments[free[e]]) for e in (a, b))
        if taken.isdisjoint((a, b)) and free[a] != free[b] and width <= 0.5 * shorter:
            taken |= {a, b}
            out.append((a, b))
    return out


def nearest_gap(found: Sequence[Chain]) -> Gap | None:
    """The narrowest gap between ends of different open chains, if it is narrower than either of the two."""
    ends = [(size_of(c.segments), (c.segments[0].start, c.segments[-1].end)) for c in found if not c.closed and not c.branch]
    if len(ends) > 100:  # a drawing of many loose lines: none of its gaps is the one that matters
        return None
    gaps = (
        gap for (s, one), (t, other) in combinations(ends, 2) for a in one for b in other if (gap := Gap(a, b)).width < min(s, t)
    )
    return min(gaps, key=lambda g: g.width, default=None)


def _chain(segments: Sequence[Segment], ends: _Ends, part: list[int]) -> Chain:
    """Segments that hang together, one after the other."""
    own = {e: ends.meets[e] for i in part for e in ends.pairs[i]}
    for end, several in own.items():
        if len(several) > 2:
            return Chain([segments[i] for i in part], False, ends.places[end])
    free = sorted((e for e, several in own.items() if len(several) == 1), key=lambda e: ends.places[e])
    at, rest = free[0] if free else ends.pairs[part[0]][0], set(part)
    walk: list[Segment] = []
    while here := [i for i in own[at] if i in rest]:
        i = here[0]
        rest.remove(i)
        turn = ends.pairs[i][0] != at
        at = ends.pairs[i][0] if turn else ends.pairs[i][1]
        s = segments[i].turned() if turn else segments[i]
        # The profile is to be continuous to the last digit: gaps within the tolerance are closed here.
        walk.append(s._replace(start=walk[-1].end if walk else s.start))
    if free:
        return Chain(walk, False)
    walk[-1] = walk[-1]._replace(end=walk[0].start)
    # The sign of the area gives the direction; points on arcs count, since two half circles have no area between their ends.
    corners = [x for s in walk for x in ([s.start] if s.through is None else [s.start, s.through])]
    area = sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(corners, corners[1:] + corners[:1]))
    return Chain(walk if area > 0 else [s.turned() for s in reversed(walk)], True)
