"""Draw ``guide/pictures/conventions.png``: the side of a profile, signs of forces, steps and time."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.patches import Polygon, Rectangle

PAGE = Path(__file__).parent / "guide" / "pictures" / "conventions.png"
TOOL, METAL, WALK, FORCE = "#c9ced6", "#dbe7f3", "#b8442b", "#1f5fa8"


def arrow(ax: Axes, start: tuple[float, float], end: tuple[float, float], colour: str, text: str = "", dx: float = 0.12) -> None:
    """An arrow with a word beside its end."""
    ax.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 2, "shrinkA": 0, "shrinkB": 0})
    ax.text(end[0] + dx, end[1], text, color=colour, va="center", fontsize=10)


def profiles(ax: Axes) -> None:
    """A punch is walked from left to right, a die from right to left."""
    punch = [(-2.2, 3.6), (-2.2, 2.4), (-1, 1.2), (1, 1.2), (2.2, 2.4), (2.2, 3.6)]
    die = [(3.4, 0.2), (1.6, 0.2), (1.2, -1.2), (-1.2, -1.2), (-1.6, 0.2), (-3.4, 0.2)]
    ax.add_patch(Polygon(punch, fc=TOOL, ec="none"))
    ax.add_patch(Polygon([*die, (-3.4, -2.2), (3.4, -2.2)], fc=TOOL, ec="none"))
    ax.add_patch(Rectangle((-3.2, 0.25), 6.4, 0.5, fc=METAL, ec="#7d93ab"))
    for chain in (punch, die):
        for a, b in pairwise(chain):
            arrow(ax, a, b, WALK)
    ax.text(0, 2.4, "punch:\nwalked left to right", ha="center", fontsize=10)
    ax.text(0, -1.85, "die: walked right to left", ha="center", fontsize=10)
    ax.text(0, 0.5, "sheet", ha="center", va="center", fontsize=10)
    ax.set_title("profile: the tool is on your left", fontsize=11)
    ax.set(xlim=(-3.6, 3.6), ylim=(-2.4, 3.8), aspect="equal")


def signs(ax: Axes) -> None:
    """Force of the metal on the tool, pressure, shear along e, rotation."""
    ax.add_patch(Rectangle((-2.6, -2), 5.2, 2.2, fc=METAL, ec="#7d93ab"))
    ax.add_patch(plt.Circle((0, 1.9), 1.7, fc=TOOL, ec="#6b7480"))
    ax.plot([0], [1.9], "k+", ms=9)
    arrow(ax, (0, 1.9), (0, 3.3), FORCE, "fy")
    arrow(ax, (0, 1.9), (1.3, 1.9), FORCE, "fx")
    arrow(ax, (-2.3, 1.7), (-2.3, 0.5), WALK)
    ax.text(-1.95, 1.95, "move y < 0", color=WALK, ha="right", fontsize=10)
    arrow(ax, (0, 0.2), (0, -1.0), "k", "pressure > 0")
    arrow(ax, (0.2, 0.1), (1.5, 0.1), "#2d7d46")
    ax.text(1.6, -0.25, "e: shear, s", color="#2d7d46", va="center", ha="center", fontsize=10)
    turn = {"arrowstyle": "-|>", "connectionstyle": "arc3,rad=0.4", "color": "k"}
    ax.annotate("", (-0.95, 2.4), (-0.15, 2.95), arrowprops=turn)
    ax.text(-1.25, 2.0, "rz, mz", fontsize=10)
    arrow(ax, (-4.2, -2.6), (-3.2, -2.6), "k", "x, r")
    arrow(ax, (-4.2, -2.6), (-4.2, -1.6), "k")
    ax.text(-4.2, -1.4, "y, axis", ha="center", fontsize=10)
    ax.set_title("signs: forces of the metal on the tool", fontsize=11)
    ax.set(xlim=(-5.0, 3.2), ylim=(-2.9, 3.8), aspect="equal")


def times(ax: Axes) -> None:
    """A number is reached by a ramp over its step; what is not mentioned stays."""
    ax.plot([0, 1, 2, 3], [0, -2, -2, -1.2], color=WALK, lw=2)
    ax.text(0.5, -0.6, "move: {y: -2}", color=WALK, fontsize=10)
    ax.text(1.5, -1.8, "not mentioned: held", color=WALK, fontsize=10, ha="center")
    ax.text(2.45, -1.35, "by: {y: 0.8}", color=WALK, fontsize=10, ha="right")
    ax.plot([0, 1, 2, 3], [-3.2, -3.2, -4, -3.2], color=FORCE, lw=2)
    ax.text(1.1, -4.0, "push: {y: -2}", color=FORCE, fontsize=10)
    ax.text(2.3, -4.05, "push: {y: 0}, fades linearly", color=FORCE, fontsize=10)
    for k in range(4):
        ax.axvline(k, color="#999999", lw=0.8, ls=":")
    for k, name in enumerate(("press", "hold", "release")):
        ax.text(k + 0.5, 0.25, f"step {k + 1}: {name}", ha="center", fontsize=10)
    ax.set(xlim=(0, 3), ylim=(-4.4, 0.6), xlabel="time", yticks=[], xticks=[0, 1, 2, 3])
    ax.set_title("steps: one unit of time each", fontsize=11)
    ax.spines[["top", "right", "left"]].set_visible(False)


def main() -> None:
    """Two panels above one: on a page their text is as large as that around it."""
    panels = [["sides", "signs"], ["times", "times"]]
    figure, axes = plt.subplot_mosaic(panels, figsize=(9, 7.4), height_ratios=(4, 3), layout="constrained")
    for name, draw in (("sides", profiles), ("signs", signs), ("times", times)):
        draw(axes[name])
        if name != "times":
            axes[name].set_axis_off()
    PAGE.parent.mkdir(exist_ok=True)
    figure.savefig(PAGE, dpi=120, bbox_inches="tight", pad_inches=0.1)
    print(f"{PAGE.name} written")


if __name__ == "__main__":
    main()
