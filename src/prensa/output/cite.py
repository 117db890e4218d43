"""How to cite what is installed: year and version from ``CITATION.cff``, the commit from the installation or the clone."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import NamedTuple

from prensa.errors import PrensaError

FILE = "CITATION.cff"


class Work(NamedTuple):
    """One entry of a bibliography: its key, its kind, and its fields in order."""

    key: str
    kind: str
    fields: dict[str, str]

    @property
    def bibtex(self) -> str:
        """The entry in BibTeX; a second pair of braces keeps titles and groups of authors as they are written."""
        kept = {k: f"{{{v}}}" if k == "title" or (k == "author" and "," not in v) else v for k, v in self.fields.items()}
        rows = "".join(f"  {name} = {{{value}}},\n" for name, value in kept.items())
        return f"@{self.kind}{{{self.key},\n{rows}}}\n"


def works() -> list[Work]:
    """The program with year, version and, where it is known, commit; and the paper that its method starts from.

    Raises
    ------
    PrensaError
        If the file does not come with this installation.

    """
    from ruamel.yaml import YAML

    known = YAML(typ="safe", pure=True).load(_file().read_text(encoding="utf-8"))
    year, commit = str(known["date-released"])[:4], installed_commit()
    version = str(known["version"])
    program = {
        "author": known["authors"][0]["name"], "title": known["title"], "year": year, "version": version,
        "note": f"Version {version}, commit {commit}" if commit else f"Version {version}",
    }  # fmt: skip
    paper = known["preferred-citation"]
    authors = " and ".join(f"{a['family-names']}, {a['given-names']}" for a in paper["authors"])
    founding = {"author": authors, "title": paper["title"], "note": paper["institution"]["name"]}
    return [Work(f"prensa{year}", "misc", program), Work("iturrioz_awruch_creus", "misc", founding)]


def _file() -> Path:
    inside = Path(__file__).parents[1] / FILE  # in a wheel
    beside = Path(__file__).parents[3] / FILE  # in a checkout
    for place in (inside, beside):
        if place.is_file():
            return place
    raise PrensaError(f"the file {FILE} does not come with this installation; it is in the root of the repository")


def installed_commit() -> str:
    """The commit that is installed, by ``pip install git+…`` (PEP 610) or as a clone; '' if it is not known.

    A clone with changes of its own says so behind the commit.
    """
    return _of_clone(Path(__file__).parents[3]) or _of_installation()


def _of_installation() -> str:
    try:
        text = distribution("prensa").read_text("direct_url.json") or "{}"
    except PackageNotFoundError:
        return ""
    return str(json.loads(text).get("vcs_info", {}).get("commit_id", ""))


def _of_clone(root: Path) -> str:
    if not (root / ".git").exists() or not (root / FILE).is_file() or shutil.which("git") is None:
        return ""

    def git(*words: str) -> str:
        done = subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=False)
        return done.stdout.strip() if done.returncode == 0 else ""

    commit = git("rev-parse", "HEAD")
    changed = git("status", "--porcelain", "--untracked-files=no")
    return f"{commit} with local changes" if changed and re.fullmatch("[0-9a-f]{40,}", commit) else commit
