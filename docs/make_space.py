"""Draw ``guide/pictures/space.png``, of the README and the page on three dimensions, from two examples that are run for it."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
from matplotlib.figure import Figure
from PIL import Image

import prensa as pr

DOCS = Path(__file__).parent
HEIGHT = 340  # pixels


def drawn(figure: Figure) -> Image.Image:
    """A figure as a picture of that height."""
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=200, bbox_inches="tight", pad_inches=0.05)
    picture = Image.open(buffer).convert("RGB")
    return picture.resize((round(picture.width * HEIGHT / picture.height), HEIGHT), Image.Resampling.LANCZOS)


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
        pictures = [drawn(f) for f in figures]
    joined = Image.new("RGB", (sum(p.width for p in pictures), HEIGHT), "white")
    left = 0
    for p in pictures:
        joined.paste(p, (left, 0))
        left += p.width
    path = DOCS / "guide" / "pictures" / "space.png"
    joined.save(path, optimize=True)
    print(f"{path.name} written")


if __name__ == "__main__":
    main()
