"""Draw ``guide/pictures/cover.png``, with which the README opens: the upsetting of the README, in three pictures."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from side_by_side import join

import prensa as pr

DOCS = Path(__file__).parent
COVER_HEIGHT = 440


def main() -> None:
    """Run, draw, join."""
    text = re.findall(r"```yaml\n(.*?)```", (DOCS.parent / "README.md").read_text(encoding="utf-8"), re.DOTALL)[0]
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "upsetting.yaml"
        case.write_text(text.replace("y: -3}", "y: -7}").replace("increments: 20", "increments: 50"), encoding="utf-8")
        pr.run(pr.load(case), out=Path(folder) / "run", quiet=True)
        result = pr.results(Path(folder) / "run")
        figures = [result.plot("plastic_strain"), result.plot("pressure"), result.plot("force_stroke")]
        join(figures, COVER_HEIGHT, 130, DOCS / "guide" / "pictures" / "cover.png")


if __name__ == "__main__":
    main()
