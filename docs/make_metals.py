"""Write the table of metals of ``guide/materials.md`` from the files of the library, and draw their flow curves.

Run it after any change of ``prensa/materials/library``; a test says when the page is behind.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from prensa.materials.flow_curve import FlowCurve
from prensa.materials.metals import library, names, read_metal
from prensa.model.schema import plain

PAGE = Path(__file__).parent / "guide" / "materials.md"
PICTURE = PAGE.parent / "pictures" / "metals.svg"
BEGIN, END = "<!-- metals: written by docs/make_metals.py -->\n", "<!-- end of metals -->\n"


def table() -> str:
    """Rows of all metals, and the sources that they number."""
    sources: dict[str, int] = {}
    heads = ("`of`", "metal", "E, nu", "flow curve, stresses in MPa", "strain to", "source")
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for name, file in library().items():
        number = sources.setdefault(f"{file.source} (<{file.see}>)", len(sources) + 1)
        also = "".join(f", `{a}`" for a in file.also)
        constants = ", ".join(f"{key} {value:.3g}" if key == "e0" else f"{key} {value:g}" for key, value in _numbers(file.flow))
        rate = f", {file.rate[0]:g} to {file.rate[1]:g} /s" if file.rate else ""
        cells = (
            f"`{name}`", f"{file.what}{also}", f"{file.E / 1e3:g} GPa, {file.nu:g}", f"`{file.flow.type}` {constants}",
            f"{file.strain[1]:g}{rate}", f"[{number}]",
        )  # fmt: skip
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", *(f"{number}. {source}" for source, number in sources.items()), ""])


def _numbers(flow: FlowCurve) -> Iterator[tuple[str, float]]:
    return ((key, value) for key, value in plain(flow).items() if key != "type" and value)


def page(text: str) -> str:
    """The page with the table as it is now."""
    before, _, rest = text.partition(BEGIN)
    return before + BEGIN + "\n" + table() + "\n" + END + rest.partition(END)[2]


if __name__ == "__main__":
    from prensa.output.metals import flow_curves
    from prensa.output.plot import save

    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    save(flow_curves({name: read_metal(name) for name in names()}), PICTURE)
    print(f"{PAGE.name} and {PICTURE.name} written")
