"""Build wheels and sdists of both distributions, install them in a clean environment, and use them there from an empty folder.

What is tried is what a user gets: ``prensa check`` and ``prensa run`` of the file in the README, and its Python; then, with
prensa-bench beside it, ``prensa bench``.
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


def cleaned() -> dict[str, str]:
    """The environment without the sources of the checkout."""
    return {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}


def told(*command: str | Path, folder: Path) -> str:
    """Standard error of a command that is to fail."""
    done = subprocess.run([str(c) for c in command], cwd=folder, env=cleaned(), text=True, capture_output=True, check=False)
    return done.stderr if done.returncode else ""


def call(*command: str | Path, folder: Path) -> str:
    """Standard output of a command in a folder; its errors are shown."""
    done = subprocess.run(
        [str(c) for c in command], cwd=folder, env=cleaned(), text=True, stdout=subprocess.PIPE, check=False
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
    call(sys.executable, "-m", "build", "--outdir", "dist", "quality", folder=ROOT)
    (wheel,) = (ROOT / "dist").glob("prensa-*.whl")
    (bench,) = (ROOT / "dist").glob("prensa_bench-*.whl")
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
        if "pip install" not in told(bin / "prensa", "bench", folder=empty):
            raise SystemExit("without its distribution, prensa bench does not say how to get it")
        call(bin / "python", "-m", "pip", "install", "--quiet", bench, folder=empty)
        call(bin / "prensa", "bench", "--count", "1", "--family", "elastic", folder=empty)
    print(f"{wheel.name} and {bench.name} work in a clean environment")


if __name__ == "__main__":
    main()
