"""The tutorial in space works as printed: its commands run in an empty folder, and answer what the page says."""

from __future__ import annotations

import io
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

import prensa as pr
from prensa.model.schema import loads

PAGE = Path(__file__).parents[2] / "docs" / "tutorials" / "space.md"
FENCE = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
TEXT = PAGE.read_text(encoding="utf-8")
BLOCKS = [(m[1].strip(), m[2]) for m in FENCE.finditer(TEXT)]
COMMANDS = [line[2:] for kind, text in BLOCKS if kind == "console" for line in text.splitlines()]
SAID = [text for kind, text in BLOCKS if kind == "text"]


def written(folder: Path) -> None:
    """The files that the page tells to save: the case, the script, the STL file, and the two changed cases."""
    ball = next(text for kind, text in BLOCKS if kind == "yaml")
    script = next(text for kind, text in BLOCKS if kind == "python")
    stl = next(text for text in SAID if text.startswith("  ball: {type: stl"))
    (folder / "ball.yaml").write_text(ball, encoding="utf-8")
    (folder / "cap.py").write_text(script, encoding="utf-8")
    cap = re.sub(r"^  ball: \{type: sphere.*\n", lambda _: stl, ball, flags=re.MULTILINE)
    (folder / "cap.yaml").write_text(cap, encoding="utf-8")
    changed = next(text for kind, text in BLOCKS if kind == "yaml fragment")
    (folder / "quarter.yaml").write_text(pr.dump(_merged(ball, changed)), encoding="utf-8")
    subprocess.run([sys.executable, "cap.py"], cwd=folder, check=True)


def _merged(ball: str, changed: str) -> pr.Case:
    yaml, whole = YAML(typ="safe", pure=True), io.StringIO()
    yaml.dump({**yaml.load(ball), **yaml.load(changed)}, whole)
    return loads(whole.getvalue())


def answered(command: str, folder: Path) -> str:
    """What a command of the page prints, in both streams; no browser is opened."""
    program, *words = shlex.split(command, comments=True)
    assert program == "prensa"
    made = subprocess.run([sys.executable, "-m", "prensa", *words], cwd=folder, env=os.environ | {"BROWSER": "true"},
                          text=True, capture_output=True, check=False)  # fmt: skip
    assert made.returncode == 0, made.stderr
    return made.stdout + made.stderr


@pytest.mark.slow
def test_checks_of_the_tutorial_say_what_it_shows(tmp_path):
    """Sizes, the STL file, the picture of the sides, and the mistake; the case is one of thirty lines at most."""
    written(tmp_path)
    assert len((tmp_path / "ball.yaml").read_text().splitlines()) <= 30
    made = answered("prensa check ball.yaml --picture check.png", tmp_path)
    assert all(line in made for line in SAID[0].splitlines()) and (tmp_path / "check.png").stat().st_size > 50_000
    assert SAID[3].splitlines()[0].startswith("  ball: {type: stl")
    assert SAID[4].strip() in answered("prensa check cap.yaml", tmp_path)
    wrong = (tmp_path / "ball.yaml").read_text().replace("bottom", "botom")
    with pytest.raises(pr.PrensaError) as caught:
        pr.discretise(loads(wrong, "ball.yaml").problem)
    assert str(caught.value) == SAID[1].strip()


@pytest.mark.slow
def test_all_commands_of_the_tutorial_run_and_end_as_it_says(tmp_path):
    """Each command in turn; forces of the table, answers of the three runs, the pictures, the report that turns."""
    written(tmp_path)
    ends = {text.splitlines()[0].rpartition("/")[2]: text for text in SAID if text.startswith("completed")}
    assert set(ends) == {"ball", "cap", "quarter"}
    for command in COMMANDS:
        made = answered(command, tmp_path)
        if command.startswith("prensa run"):
            name = re.search(r"(\w+)\.yaml", command)[1]
            assert all(line in made for line in ends[name].splitlines()), made
    ball = pr.results(tmp_path / "results" / "ball")
    for step, *numbers in re.findall(r"^\| `(\w+)`" + r" \| ([−\d.]+)" * 6 + r" \|$", TEXT, re.MULTILINE):
        last = max(k for k, s in enumerate(ball.history["step"]) if s == step)
        ours = [ball.history[f"ball.{c}"][last] for c in ("fx", "fy", "fz", "mx", "my", "mz")]
        said = [float(v.replace("−", "-")) for v in numbers]
        assert np.allclose(ours, said, rtol=2e-3, atol=1.0), (step, ours)
    for name in ("check.png", "strain.png", "pressure.png", "force.csv", "results/ball/report.html"):
        assert (tmp_path / name).stat().st_size > 400, name
    assert 'id="turned"' in (tmp_path / "results/ball/report.html").read_text(encoding="utf-8")
