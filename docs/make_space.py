"""Draw ``guide/pictures/space.png``, of the README and the page on three dimensions, from two examples that are run for it."""

from __future__ import annotations

import tempfile
from pathlib import Path

from side_by_side import join

import prensa as pr

DOCS = Path(__file__).parent
HEIGHT = 340  # pixels


def main() -> None:
    """Run, draw, join."""
    with tempfile.TemporaryDirectory() as folder:
        runs = {}
        for name in ("ball_indentation", "square_billet"):
            pr.run(pr.load(DOCS.parent / "examples" / f"{name}.yaml"), out=Path(folder) / name, quiet=True)
            runs[name] = pr.results(Path(folder) / name)
        ball, billet = runs["ball_indentation"], runs["square_billet"]
        figures = [ball.plot("plastic_strain", at="drag", section="z", dpi=200), ball.plot("pressure", at="drag", dpi=200),
                   billet.plot("mises", dpi=200)]  # fmt: skip
        join(figures, HEIGHT, 200, DOCS / "guide" / "pictures" / "space.png", margin=0.05)


if __name__ == "__main__":
    main()
