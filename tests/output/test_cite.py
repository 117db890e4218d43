"""``prensa cite``: BibTeX with year, version and commit; the file that citation managers read says the same."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from importlib import metadata
from pathlib import Path

import pytest
from typer.testing import CliRunner

import prensa
from prensa.cli import app
from prensa.output import cite

ROOT = Path(__file__).parents[2]


def entries(text: str) -> dict[str, dict[str, str]]:
    """A reader of BibTeX of its own: fields by key of the entry, braces around values taken off."""
    found = {}
    for key, body in re.findall(r"^@\w+\{(\w+),\n(.*?)^\}", text, re.MULTILINE | re.DOTALL):
        found[key] = {name: value.strip("{}") for name, value in re.findall(r"^  (\w+) = \{(.*)\},$", body, re.MULTILINE)}
    return found


def test_the_program_is_cited_with_year_and_version():
    done = CliRunner().invoke(app, ["cite"])
    program, paper = entries(done.output).values()
    assert re.fullmatch(r"20\d\d", program["year"]) and program["version"] == prensa.__version__
    assert program["year"] in done.output.split(",")[0]
    assert paper["author"] == "Iturrioz, Ignacio and Awruch, Armando M. and Creus, Guillermo J."
    as_json = json.loads(CliRunner().invoke(app, ["cite", "--json"]).output)
    assert [{k: v for k, v in entry.items() if k != "type"} for entry in as_json.values()] == [program, paper]


def test_version_is_one_everywhere():
    """Package, its metadata and CITATION.cff have one version, and the file goes into the wheel."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert f'version = "{prensa.__version__}"' in text and '"CITATION.cff" = "prensa/CITATION.cff"' in text
    assert cite.works()[0].fields["version"] == prensa.__version__


def test_the_commit_of_a_clone_and_of_an_installation(tmp_path, monkeypatch):
    """A clone has the commit that git names, changed or not; an installation that which pip wrote down (PEP 610)."""

    def git(*words: str) -> str:
        call = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b", *words]
        return subprocess.run(call, check=True, capture_output=True, text=True).stdout.strip()

    if shutil.which("git") is None:
        pytest.skip("no git on this machine")
    git("init", "-q")
    (tmp_path / cite.FILE).write_text("a\n")
    git("add", ".")
    git("commit", "-q", "-m", "one")
    commit = git("rev-parse", "HEAD")
    assert cite._of_clone(tmp_path) == commit
    (tmp_path / cite.FILE).write_text("b\n")
    assert cite._of_clone(tmp_path) == f"{commit} with local changes"
    assert cite._of_clone(tmp_path / "elsewhere") == ""

    class Installed:
        def read_text(self, name: str) -> str | None:
            return json.dumps({"vcs_info": {"vcs": "git", "commit_id": commit}}) if name == "direct_url.json" else None

    monkeypatch.setattr(cite, "distribution", lambda name: Installed())
    assert cite._of_installation() == commit

    def missing(name: str) -> Installed:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(cite, "distribution", missing)
    assert cite._of_installation() == ""
