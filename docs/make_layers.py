"""Draw ``developer/pictures/layers.svg``: packages as boxes, imports as arrows, layers from the imports themselves.

A package stands next below the lowest one that imports it. An arrow that another path already shows is left out, so that the
picture stays readable: what may be imported is in CONTRIBUTING.md. Run it after a change of the packages; a test says when the
picture is behind. ``python docs/make_layers.py --png FILE`` writes a bitmap instead.
"""

from __future__ import annotations

import sys
from itertools import product
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PICTURE = ROOT / "docs" / "developer" / "pictures" / "layers.svg"
sys.path.insert(0, str(ROOT / "tests" / "docs"))

import structure  # noqa: E402

WIDTH, HEIGHT, COLUMN, ROW = 1.5, 0.56, 2.15, 1.1  # of a box, and of the raster that boxes stand on
Point = tuple[float, float]
PLAIN = ("prensa", "errors", "types")  # the public names, the exceptions and the types of arrays, which every layer may use


def graph() -> dict[str, set[str]]:
    """Package → packages that it imports."""
    found: dict[str, set[str]] = {structure.package(m): set() for m in structure.modules()}
    for a, b in structure.arrows(structure.imports(types=False)):
        found[a].add(b)
    return {a: {b for b in below if b not in PLAIN} for a, below in found.items() if a not in PLAIN}


def reduced(edges: dict[str, set[str]]) -> dict[str, set[str]]:
    """Without the arrows that a longer path implies."""

    def below(a: str) -> set[str]:
        return edges[a].union(*(below(b) for b in edges[a]))

    return {a: {b for b in targets if not any(b in below(c) for c in targets - {b})} for a, targets in edges.items()}


def depths(edges: dict[str, set[str]]) -> dict[str, int]:
    """Layer of each package, 0 at the top, next below the lowest that imports it; RecursionError if two import one another.

    A package that nothing imports stands next above the highest that it imports, or at the top if there is none.
    """

    def depth(a: str) -> int:
        return max((depth(b) + 1 for b in edges if a in edges[b]), default=0)

    layer = {a: depth(a) for a in edges}
    for a in edges:
        if layer[a] == 0 and edges[a]:
            layer[a] = min(layer[b] for b in edges[a]) - 1
    return layer


def places(edges: dict[str, set[str]]) -> dict[str, Point]:
    """Middle of each box: rows by layer, order within a row by where those above stand, centred."""
    depth, arrows = depths(edges), reduced(edges)
    place: dict[str, Point] = {}
    last = max(depth.values())
    for layer in range(last + 1):
        row = [a for a in sorted(edges) if depth[a] == layer]
        above = {a: [place[b][0] for b in arrows if a in arrows[b]] for a in row}
        row.sort(key=lambda a: (sum(above[a]) / max(len(above[a]), 1), a))
        for k, a in enumerate(row):
            place[a] = (COLUMN * (k - 0.5 * (len(row) - 1)), ROW * (last - layer))
    return place


def way(a: str, b: str, place: dict[str, Point]) -> tuple[Point, Point, float]:
    """Start, end and curvature (matplotlib's ``rad`` of ``arc3``) of an arrow, as plain as leads around the boxes between."""
    boxes = [p for name, p in place.items() if name not in (a, b)]
    offsets = [0.0, -0.45 * WIDTH, 0.45 * WIDTH]
    tried = sorted(product((0.0, -0.25, 0.25, -0.4, 0.4, -0.6, 0.6), offsets, offsets), key=lambda c: sum(map(abs, c)))
    for bend, out, into in tried:
        (xa, ya), (xb, yb) = (
            (place[a][0] + out, place[a][1] - 0.5 * HEIGHT),
            (place[b][0] + into, place[b][1] + 0.5 * HEIGHT),
        )
        x, y = 0.5 * (xa + xb) + bend * (yb - ya), 0.5 * (ya + yb) - bend * (xb - xa)
        shares = [
            ((1 - t / 60) ** 2, 2 * t / 60 * (1 - t / 60), (t / 60) ** 2) for t in range(61)
        ]  # a quadratic Bézier curve
        path = [(p * xa + q * x + r * xb, p * ya + q * y + r * yb) for p, q, r in shares]
        if not any(abs(u - p) < 0.52 * WIDTH and abs(v - q) < 0.55 * HEIGHT for u, v in path for p, q in boxes):
            return (xa, ya), (xb, yb), bend
    return (place[a][0], place[a][1] - 0.5 * HEIGHT), (place[b][0], place[b][1] + 0.5 * HEIGHT), 0.0  # behind a box


def draw() -> Any:
    """The figure."""
    from matplotlib.figure import Figure
    from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

    edges = graph()
    place, arrows = places(edges), reduced(edges)
    x, y = [p[0] for p in place.values()], [p[1] for p in place.values()]
    figure = Figure(figsize=(max(x) - min(x) + 2.2, max(y) + 1.2))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(min(x) - 1.1, max(x) + 1.1), ylim=(-0.6, max(y) + 0.6), aspect="equal")
    axes.axis("off")
    for a in sorted(arrows):
        for b in sorted(arrows[a]):
            start, end, bend = way(a, b, place)
            style = f"arc3,rad={bend}"
            axes.add_patch(FancyArrowPatch(start, end, connectionstyle=style, arrowstyle="-|>", mutation_scale=11,
                                           linewidth=1.0, color="0.45", shrinkA=0, shrinkB=0, zorder=1))  # fmt: skip
    for a, (xa, ya) in place.items():
        corner = (xa - 0.5 * WIDTH, ya - 0.5 * HEIGHT)
        axes.add_patch(
            FancyBboxPatch(corner, WIDTH, HEIGHT, "round,pad=0,rounding_size=0.08", fc="white", ec="0.15", zorder=2)
        )
        axes.text(xa, ya, a, ha="center", va="center", fontsize=13, family="monospace", zorder=3)
    return figure


def description() -> str:
    """The arrows in words, which the picture carries: by them a test sees that it is behind."""
    return "; ".join(f"{a} → {', '.join(sorted(b))}" for a, b in sorted(reduced(graph()).items()) if b)


def write(path: Path) -> None:
    """Write the picture; the same bytes for the same imports."""
    import matplotlib

    with matplotlib.rc_context({"svg.hashsalt": "prensa", "svg.fonttype": "none"}):
        about = {"Date": None, "Creator": None, "Description": description()} if path.suffix == ".svg" else None
        draw().savefig(path, metadata=about, dpi=100)
    if path.suffix == ".svg":  # no spaces at the ends of lines
        lines = path.read_text(encoding="utf-8").splitlines()
        path.write_text("\n".join(line.rstrip() for line in lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    target = Path(sys.argv[2]) if sys.argv[1:2] == ["--png"] else PICTURE
    write(target)
    print(f"{target.name} written")
