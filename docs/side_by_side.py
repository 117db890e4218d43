"""Figures side by side in one picture, for the pages."""

from __future__ import annotations

import io
from collections.abc import Iterable
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from PIL import Image


def drawn(figure: Figure, height: int, dpi: int, margin: float) -> Image.Image:
    """A figure as a picture of a height (pixels), drawn with ``dpi`` and a ``margin`` (inches)."""
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=dpi, bbox_inches="tight", pad_inches=margin)
    plt.close(figure)
    picture = Image.open(buffer).convert("RGB")
    return picture.resize((round(picture.width * height / picture.height), height), Image.Resampling.LANCZOS)


def join(figures: Iterable[Figure], height: int, dpi: int, path: Path, margin: float = 0.1) -> None:
    """Write figures beside each other to a file."""
    pictures = [drawn(f, height, dpi, margin) for f in figures]
    joined = Image.new("RGB", (sum(p.width for p in pictures), height), "white")
    left = 0
    for p in pictures:
        joined.paste(p, (left, 0))
        left += p.width
    joined.save(path, optimize=True)
    print(f"{path.name} written")
