"""Draw ``guide/pictures/cover.png``, with which the README opens: the upsetting of the README, in three pictures."""

from __future__ import annotations

import io
import re
import tempfile
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from PIL import Image

import prensa as pr

DOCS = Path(__file__).parent
COVER_HEIGHT = 440


def drawn(figure: Figure) -> Image.Image:
    """A figure as a picture of that height."""
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=130, bbox_inches="tight")
    plt.close(figure)
    picture = Image.open(buffer).convert("RGB")
    return picture.resize((round(picture.width * COVER_HEIGHT / picture.height), COVER_HEIGHT), Image.Resampling.LANCZOS)


def main() -> None:
    """Run, draw, join."""
    text = re.findall(r"```yaml\n(.*?)```", (DOCS.parent / "README.md").read_text(encoding="utf-8"), re.DOTALL)[0]
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "upsetting.yaml"
        case.write_text(text.replace("y: -3}", "y: -7}").replace("increments: 20", "increments: 50"), encoding="utf-8")
        pr.run(pr.load(case), out=Path(folder) / "run", quiet=True)
        result = pr.results(Path(folder) / "run")
        figures = [result.plot("plastic_strain"), result.plot("pressure"), result.plot("force_stroke")]
        pictures = [drawn(f) for f in figures]
    cover = Image.new("RGB", (sum(p.width for p in pictures), COVER_HEIGHT), "white")
    left = 0
    for p in pictures:
        cover.paste(p, (left, 0))
        left += p.width
    path = DOCS / "guide" / "pictures" / "cover.png"
    cover.save(path, optimize=True)
    print(f"{path.name} written")


if __name__ == "__main__":
    main()
