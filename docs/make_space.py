"""Draw the pictures of the page on three dimensions, ``space.png`` of the README among them, and of the tutorial in space.

With the words ``tutorial``, ``sides`` or ``space`` one of them alone.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image
from side_by_side import join

import prensa as pr
from prensa.output.sketch import sketch

DOCS = Path(__file__).parent
HEIGHT = 340  # pixels


def draw_space() -> None:
    """Run, draw, join: the ball, the billet and the hook."""
    with tempfile.TemporaryDirectory() as folder:
        runs = {}
        for name in ("ball_indentation", "square_billet", "snap_hook"):
            pr.run(pr.load(DOCS.parent / "examples" / f"{name}.yaml"), out=Path(folder) / name, quiet=True)
            runs[name] = pr.results(Path(folder) / name)
        ball, billet = runs["ball_indentation"], runs["square_billet"]
        figures = [ball.plot("plastic_strain", at="drag", section="z", dpi=200), ball.plot("pressure", at="drag", dpi=200),
                   billet.plot("mises", dpi=200)]  # fmt: skip
        join(figures, HEIGHT, 200, DOCS / "guide" / "pictures" / "space.png", margin=0.05)
        over_the_nose = int(np.argmax(np.abs(runs["snap_hook"].history["bar.fy"]))) + 1
        hook = runs["snap_hook"].plot("mises", at=over_the_nose, size=(6.4, 4.8), dpi=150)
        hook.savefig(DOCS / "guide" / "pictures" / "snap_hook.png", dpi=150, bbox_inches="tight")


def draw_sides() -> None:
    """What ``prensa check --picture`` shows of a bolt's head before a run."""
    system = pr.discretise(pr.load(DOCS.parent / "examples" / "square_head.yaml").problem)
    figure = sketch(system.problem, system.meshes, system)
    figure.savefig(DOCS / "guide" / "pictures" / "sides.png", dpi=110, bbox_inches="tight")


def draw_tutorial() -> None:
    """The pictures of docs/tutorials/space.md, by its own case and commands."""
    page = (DOCS / "tutorials" / "space.md").read_text(encoding="utf-8")
    found = re.search(r"^```yaml\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    assert found is not None
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "ball.yaml").write_text(found[1], encoding="utf-8")
        for line in re.findall(r"^\$ prensa ((?:check|run) ball\.yaml.*|plot results/ball .*)$", page, re.MULTILINE):
            subprocess.run([sys.executable, "-m", "prensa", *line.split()], cwd=folder, check=True)
        for name in ("check", "strain", "pressure"):
            with Image.open(Path(folder) / f"{name}.png") as made:
                small = made.convert("RGB")
                small.thumbnail((1200, 1200))
                small.quantize(200).save(DOCS / "guide" / "pictures" / f"tutorial_space_{name}.png", optimize=True)


def main() -> None:
    """All of them, or those that the command line names."""
    for name, draw in {"tutorial": draw_tutorial, "sides": draw_sides, "space": draw_space}.items():
        if name in (sys.argv[1:] or [name]):
            draw()


if __name__ == "__main__":
    main()
