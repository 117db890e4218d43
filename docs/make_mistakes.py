"""Write ``guide/mistakes.md``: what is said about each seeded mistake of ``tests/robustness/seeded.py``.

Run it after any change of a message or of the list; a test says when the page is behind.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

PAGE = Path(__file__).parent / "guide" / "mistakes.md"
TESTS = Path(__file__).parents[1] / "tests"
sys.path[:0] = [str(TESTS / "robustness"), str(TESTS)]

from seeded import CASE, IN_SPACE, SEEDED, said, the_line  # noqa: E402

OPENING = f"""\
# Mistakes and their messages

Each row is one deliberate change of the case below, and the message of `prensa check` (or `prensa run` and, in the last
table, the command shown): position in the file, what is wrong, how to fix it. This page is written by
`docs/make_mistakes.py`; a test makes every mistake and compares the messages. A line with "warning" does not stop the run.

```yaml
{CASE}```

`prensa check` reads the file, meshes the bodies, places the tools, moves them through all steps past the bodies at rest, and
compares supports and contacts with the rigid-body motions of each body. `prensa run` and `prensa.solve` do the same before
solving.
"""


def page() -> str:
    """The whole page."""
    parts = [OPENING]
    for area, items in SEEDED.items():
        case = f"The rows of this table change this case:\n\n```yaml\n{IN_SPACE}```\n\n" if items[0].case == IN_SPACE else ""
        parts.append(f"## {area.capitalize()}\n\n{case}| mistake | answer |\n|---|---|\n" + "".join(_row(s) for s in items))
    return "\n".join(parts)


def _row(seeded: object) -> str:
    with tempfile.TemporaryDirectory() as folder:
        _, lines = said(seeded, Path(folder))  # type: ignore[arg-type]
    line = the_line(seeded, lines).replace("|", "\\|")  # type: ignore[arg-type]
    return f"| {seeded.what} | `{line}` |\n"  # type: ignore[attr-defined]


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"{PAGE.name} written")
