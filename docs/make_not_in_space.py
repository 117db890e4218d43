"""Write the table of ``guide/space.md`` of what there is not in space, from the sentences with which it is refused.

Run it after any change of ``prensa/model/not_in_space.py``, or of the elements that files in space may have; a test says when the
page is behind.
"""

from __future__ import annotations

from pathlib import Path

from prensa.importers.solids import SOLID_KINDS
from prensa.model.not_in_space import NOT_IN_SPACE

PAGE = Path(__file__).parent / "guide" / "space.md"
BEGIN, END = "<!-- refusals: written by docs/make_not_in_space.py -->\n", "<!-- end of refusals -->\n"


def table() -> str:
    """A row for each feature, and one for each kind of element that is refused."""
    rows = [(f.part, f"`{f.written}`", f.words.format(**f.example)) for f in NOT_IN_SPACE.values()]
    rows += [("files", kind.name, kind.remedy) for kind in SOLID_KINDS if kind.remedy]
    return "\n".join(["| where | what | answer |", "|---|---|---|", *(f"| {' | '.join(row)} |" for row in rows), ""])


def page(text: str) -> str:
    """The page with the table of today."""
    before, rest = text.split(BEGIN)
    return f"{before}{BEGIN}{table()}{END}{rest.split(END)[1]}"


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"{PAGE.name} written")
