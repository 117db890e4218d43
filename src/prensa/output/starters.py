"""Cases to start from: examples that are copied, with their comments, into the user's folder."""

from __future__ import annotations

from pathlib import Path

from prensa.errors import PrensaError

STARTERS = {
    "ring": ("ring_compression", "ring compression, from which friction is read"),
    "upsetting": ("upsetting", "a billet upset with friction"),
    "rolling": ("flat_rolling", "a strip fed into a roll gap and rolled"),
    "drawing": ("wire_drawing", "a pointed wire drawn through a conical die"),
    "dome": ("hemispherical_stretching", "a clamped sheet stretched over a hemispherical punch"),
    "v-bend": ("free_bending", "a strip bent into a V, and its springback"),
    "can": ("backward_can", "a can extruded backward, with remeshing"),
    "hertz": ("cylinder_on_block", "a cylinder pressed on an elastic block"),
}
"""By kind: the example, and what it is."""


def starter(kind: str) -> str:
    """Text of the case of a kind.

    Raises
    ------
    PrensaError
        If the file does not come with this installation.

    """
    name = f"{STARTERS[kind][0]}.yaml"
    inside = Path(__file__).parents[1] / "examples" / name  # in a wheel
    beside = Path(__file__).parents[3] / "examples" / name  # in a checkout
    for place in (inside, beside):
        if place.is_file():
            return place.read_text(encoding="utf-8")
    raise PrensaError(f"the example {name} does not come with this installation")
