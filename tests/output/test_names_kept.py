"""Names that others go by are kept: keys of cases, columns of tables, arrays of fields, keys of summary.json.

``names_kept.json`` was written once, from a run of the example `cylinder_on_block` and the schema of commit 5d577d5c. Names may
be added, columns after those that were there; none may go.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from prensa.cli import app
from prensa.model.schema import json_schema

EXAMPLE = Path(__file__).parents[2] / "examples" / "cylinder_on_block.yaml"
KEPT = json.loads((Path(__file__).parent / "names_kept.json").read_text(encoding="utf-8"))
COARSE = ("--set", "bodies.block.mesh.n=[10, 8]", "--set", "bodies.block.mesh.grade.ratio=2")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of the example on a coarse mesh."""
    out = tmp_path_factory.mktemp("kept") / "run"
    result = CliRunner().invoke(app, ["run", str(EXAMPLE), *COARSE, "--out", str(out), "--quiet"])
    assert result.exit_code == 0, result.output
    return out


def keys_of(schema: Any) -> set[str]:
    """Keys that a definition of a JSON schema knows, those of its alternatives included."""
    found = set(schema.get("properties", {}))
    for kind in ("anyOf", "oneOf", "allOf"):
        for part in schema.get(kind, []):
            found |= keys_of(part)
    return found


def paths(value: Any, above: str = "") -> Iterator[str]:
    """Keys of nested objects, with a slash between them."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield f"{above}{key}"
            yield from paths(inner, f"{above}{key}/")


def test_no_key_of_a_case_is_gone() -> None:
    """Those of each block of a case file, by which `--set` finds its way, too."""
    schema = json_schema()
    now = {"": keys_of(schema)} | {name: keys_of(block) for name, block in schema["$defs"].items()}
    gone = {name: sorted(set(keys) - now.get(name, set())) for name, keys in KEPT["case"].items()}
    assert {name: keys for name, keys in gone.items() if keys} == {}
    assert sum(map(len, KEPT["case"].values())) > 300


def test_no_file_of_a_result_folder_is_gone(folder: Path) -> None:
    """Nor a folder in it."""
    assert set(KEPT["files"]) <= {path.name for path in folder.iterdir()}


@pytest.mark.parametrize("file", KEPT["columns"])
def test_columns_stand_where_they_stood(folder: Path, file: str) -> None:
    """New ones come after them, or belong to tools and contacts that were not there."""
    with (folder / file).open(encoding="utf-8", newline="") as lines:
        now = next(csv.reader(lines))
    assert [column for column in now if column in KEPT["columns"][file]] == KEPT["columns"][file]


def test_no_array_of_the_fields_is_gone(folder: Path) -> None:
    """By the names with which ParaView lists them."""
    text = (folder / "fields" / "0001.vtu").read_bytes().decode("latin1")
    assert set(KEPT["arrays"]) <= set(re.findall(r'Name="([^"]+)"', text))


def test_no_key_of_the_summary_is_gone(folder: Path) -> None:
    """Seconds by section excepted: sections are those of the code."""
    now = set(paths(json.loads((folder / "summary.json").read_text(encoding="utf-8"))))
    assert sorted(set(KEPT["summary"]) - now) == []
