"""Tables as spreadsheets and testing machines write them: read as they are, or refused in a line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from prensa.inverse.tables import DataError, Table, read_table

GOOD = {
    "commas": b"travel [mm],force [kN]\n0.5,1.25\n1.5,\n",
    "mark of UTF-8": b"\xef\xbb\xbftravel [mm],force [kN]\n0.5,1.25\n1.5,\n",
    "UTF-16": b"\xff\xfe" + "travel [mm]\tforce [kN]\n0,5\t1,25\n1,5\t\n".encode("utf-16-le"),
    "semicolons and decimal commas": b"travel [mm];force [kN]\n0,5;1,25\n1,5;\n",
    "semicolons and points": b"travel [mm];force [kN]\n0.5;1.25\n1.5;\n",
    "tabulators": b"travel [mm]\tforce [kN]\r\n0,5\t1,25\r\n1,5\t\r\n",
    "separator said first": b"sep=;\ntravel [mm];force [kN]\n0,5;1,25\n1,5;\n",
    "units in a row of their own": b"travel;force\nmm;kN\n0,5;1,25\n1,5;\n",
    "units in brackets in a row of their own": b"travel,force\n(mm),[kN]\n0.5,1.25\n1.5,\n",
    "empty columns and rows": b"travel [mm];force [kN];;\n0,5;1,25;;\n;;;\n1,5;;;\n\n",
    "comments and blanks": b"# measured\n travel [mm] , force (kN)\n\n 5e-1 , 1.25 \n1.5D0,\n",
}

BAD = {
    "no number": (b"a,b\n1,x\n1,2", r":2: b is 'x'; a number is expected"),
    "not a number": (b"a,b\n1,nan\n1,2", r":2: b is 'nan'; a number is expected"),
    "too large": (b"a,b\n1,1e999\n1,2", "too large a number"),
    "underscores": (b"a,b\n1,1_000\n", "a number is expected"),
    "decimal commas between commas": (b"a,b\n0,5,1,25\n", "separate the columns by semicolons"),
    "thousands": (b"a;b\n1.5;1,000\n", "have decimal points; write all alike"),
    "spaces": (b"travel [mm] force [kN]\n0.1 24\n0.2 26\n", "2: its numbers are separated by spaces; separate columns"),
    "names twice": (b"a,a\n1,2\n", "name every column once"),
    "no names": (b"1;2\n3;4\n", "name every column once"),
    "workbook": (b"PK\x03\x04...", "save its sheet as CSV"),
    "binary": (b"a,b\n\x00\x01\x02", "this is not text"),
    "nothing": (b"", "there are no rows"),
    "names alone": (b"a,b\n\n,,\n", "there are no rows"),
    "ragged": (b"a,b\n1\n", "1 cells, but 2 columns"),
}


@pytest.mark.parametrize("raw", GOOD.values(), ids=GOOD)
def test_what_spreadsheets_write_is_read(tmp_path: Path, raw: bytes) -> None:
    """One table in eleven notations is one table."""
    (tmp_path / "t.csv").write_bytes(raw)
    table = read_table(tmp_path / "t.csv")
    assert table.units == {"travel": "mm", "force": "kN"}
    np.testing.assert_array_equal(table.column("travel"), [0.5, 1.5])
    np.testing.assert_array_equal(table.column("force"), [1.25, np.nan])


@pytest.mark.parametrize(("raw", "message"), BAD.values(), ids=BAD)
def test_what_is_no_table_is_reported_in_a_line(tmp_path: Path, raw: bytes, message: str) -> None:
    """With the place, what stands there, and what to do."""
    (tmp_path / "t.csv").write_bytes(raw)
    with pytest.raises(DataError, match=message) as caught:
        read_table(tmp_path / "t.csv")
    assert "\n" not in str(caught.value)


def test_any_bytes_are_a_table_or_reported(tmp_path: Path) -> None:
    """Six hundred tables with random damage: numbers or one line, never another exception."""
    rng, file, read = np.random.default_rng(3), tmp_path / "t.csv", 0
    sources = list(GOOD.values())
    for k in range(600):
        raw = bytearray(sources[k % len(sources)])
        for _ in range(rng.integers(1, 5)):
            at = int(rng.integers(0, len(raw) + 1))
            what = [b"", *(bytes([c]) for c in b',;"\n\re-.\xe4\0[\t'), b"9" * 400, bytes(rng.bytes(3))]
            raw[at : at + int(rng.integers(0, 4))] = what[int(rng.integers(0, len(what)))]
        file.write_bytes(raw)
        try:
            table = read_table(file)
        except DataError as error:
            assert "\n" not in str(error)
        else:
            read += 1
            assert all(len(v) == len(table.lines) and not np.isinf(v).any() for v in table.columns.values())
    assert 60 < read < 540


def test_tables_made_in_python_are_checked() -> None:
    """Columns of different lengths, nothing, infinities."""
    with pytest.raises(DataError, match="one length"):
        Table("t", {"a": np.ones(2), "b": np.ones(3)}, {})
    with pytest.raises(DataError, match="one length"):
        Table("t", {}, {})
    with pytest.raises(DataError, match="infinite"):
        Table("t", {"a": np.array([np.inf])}, {"a": ""})
