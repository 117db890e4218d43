"""Build wheel and sdist, install the wheel in a clean environment, and use it there from an empty folder.

What is tried is what a user gets: ``prensa check`` and ``prensa run`` of the file in the README, and its Python.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def call(*command: str | Path, folder: Path) -> str:
    """Standard output of a command in a folder; its errors are shown."""
    clean = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        [str(c) for c in command], cwd=folder, env=clean, text=True, stdout=subprocess.PIPE, check=False
    )
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, command))} ended with {done.returncode}\n{done.stdout}")
    return done.stdout


def blocks(language: str) -> list[str]:
    """Code blocks of the README."""
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)


def main() -> None:
    """Build, install, use."""
    shutil.rmtree(ROOT / "dist", ignore_errors=True)
    call(sys.executable, "-m", "build", "--outdir", "dist", ".", folder=ROOT)
    (wheel,) = (ROOT / "dist").glob("*.whl")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        venv.create(folder / "env", with_pip=True)
        bin = folder / "env" / ("Scripts" if os.name == "nt" else "bin")
        empty = folder / "empty"
        empty.mkdir()
        call(bin / "python", "-m", "pip", "install", "--quiet", wheel, folder=empty)
        (empty / "upsetting.yaml").write_text(blocks("yaml")[0], encoding="utf-8")
        call(bin / "prensa", "check", "upsetting.yaml", folder=empty)
        call(bin / "prensa", "run", "upsetting.yaml", folder=empty)
        left = {path.name for path in (empty / "results" / "upsetting").iterdir()}
        missing = {"history.csv", "summary.json", "report.html", "checkpoint.h5", "run.log"} - left
        if missing:
            raise SystemExit(f"the run left no {', '.join(sorted(missing))}")
        (empty / "first.py").write_text(blocks("python")[0], encoding="utf-8")
        printed = call(bin / "python", "first.py", folder=empty)
        if printed != blocks("text")[0]:
            raise SystemExit(f"the README promises\n{blocks('text')[0]}and the wheel prints\n{printed}")
    print(f"{wheel.name} works in a clean environment")


if __name__ == "__main__":
    main()
