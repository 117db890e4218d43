"""Draw the pictures of the page on three dimensions: ``space.png``, of the README too, ``snap_hook.png`` and ``sides.png``."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from side_by_side import join

import prensa as pr
from prensa.output.sketch import sketch

DOCS = Path(__file__).parent
HEIGHT = 340  # pixels


def main() -> None:
    """Run, draw, join."""
    draw_sides()
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


if __name__ == "__main__":
    main()
