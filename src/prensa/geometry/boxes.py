"""Pairs of boxes that meet, by a sweep over x."""

from __future__ import annotations

from collections.abc import Iterator, Sequence


def meeting_boxes(boxes: Sequence[tuple[float, float, float, float]], slack: float) -> Iterator[tuple[int, int]]:
    """Numbers of boxes (x low, x high, y low, y high) that meet or are ``slack`` apart, that farther right first."""
    order = sorted(range(len(boxes)), key=lambda i: boxes[i][0])
    active: list[int] = []
    for j in order:
        x0, _, y0, y1 = boxes[j]
        active = [i for i in active if boxes[i][1] >= x0 - slack]
        for i in active:
            if boxes[i][2] <= y1 + slack and boxes[i][3] >= y0 - slack:
                yield j, i
        active.append(j)
