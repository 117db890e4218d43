"""One folder, one run, one truth: who writes there, whose results it holds, and that tables and checkpoint agree."""

from __future__ import annotations

import dataclasses
import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.output import files, history, lock, vtk
from prensa.output.history import read_history
from prensa.output.run import resume, run
from problems import stroke, upset_block


def small(name: str = "small", increments: int = 3) -> pr.Case:
    """An elastic block under a plane."""
    problem = upset_block(
        stroke(-0.1, increments=increments, tool="punch"), size=(4, 3), n=(2, 2), body="block", plane="punch", name=name
    )
    return pr.Case(problem, output=pr.Output(pictures=False, report=False))


# ---------------------------------------------------------------------------------------------------------------- lock
def test_a_second_run_in_a_folder_is_refused_with_the_first_ones_process(tmp_path):
    """While one run writes, another reports which; afterwards the folder is free and has no lock left."""
    with lock.locked(tmp_path):
        for second in (lambda: run(small(), tmp_path, quiet=True), lambda: _locked_by_another(tmp_path)):
            with pytest.raises(PrensaError, match=f"process {os.getpid()} on {socket.gethostname()} has been running"):
                second()
    assert not (tmp_path / lock.LOCK).exists()
    assert run(small(), tmp_path, quiet=True).status == "completed"
    assert not (tmp_path / lock.LOCK).exists()


def _locked_by_another(directory: Path) -> None:
    code = f"""
from pathlib import Path
from prensa.output.lock import locked
from prensa.errors import PrensaError
try:
    with locked(Path({str(directory)!r})):
        pass
except PrensaError as error:
    print(error)
"""
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    raise PrensaError(said)


def test_the_lock_of_a_killed_process_is_taken_over(tmp_path):
    """What a process that is gone has left behind stops nobody, whoever it was."""
    code = f"""
import os
from pathlib import Path
from prensa.output.lock import locked
with locked(Path({str(tmp_path)!r})):
    os._exit(9)
"""
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 9
    left = json.loads((tmp_path / lock.LOCK).read_text())
    assert left["pid"] != os.getpid() and left["host"] == socket.gethostname()
    with lock.locked(tmp_path):
        assert json.loads((tmp_path / lock.LOCK).read_text())["pid"] == os.getpid()


@pytest.mark.skipif(os.name != "posix", reason="elsewhere nobody asks whether a process lives")
def test_without_locks_of_the_system_the_holder_is_asked_for(tmp_path, monkeypatch):
    """On a file system without locks a living process keeps the folder and a dead one does not."""
    import fcntl

    def none(*_):
        raise OSError("no locks here")

    monkeypatch.setattr(fcntl, "flock", none)
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    entry = {"pid": os.getpid(), "host": socket.gethostname(), "since": "now"}
    (tmp_path / lock.LOCK).write_text(json.dumps(entry))
    with pytest.raises(PrensaError, match="has been running"), lock.locked(tmp_path):
        pass
    (tmp_path / lock.LOCK).write_text(json.dumps(entry | {"pid": dead.pid}))
    with lock.locked(tmp_path):
        pass
    (tmp_path / lock.LOCK).write_text(json.dumps(entry | {"host": "elsewhere"}))
    with pytest.raises(PrensaError, match="on elsewhere"), lock.locked(tmp_path):
        pass


# ----------------------------------------------------------------------------------------------------------- ownership
def test_results_of_another_case_are_replaced_only_on_request(tmp_path):
    """Another case is refused and changes nothing; the same one, changed or not, is run again; force replaces."""
    run(small("first"), tmp_path, quiet=True)
    before = (tmp_path / "history.csv").read_bytes()
    with pytest.raises(PrensaError, match=r"the results of the case 'first'.*--force"):
        run(small("second"), tmp_path, quiet=True)
    assert (tmp_path / "history.csv").read_bytes() == before
    (tmp_path / "summary.json").unlink()  # a run that was killed has a log only
    with pytest.raises(PrensaError, match="the results of the case 'first'"):
        run(small("second"), tmp_path, quiet=True)
    run(small("first", increments=2), tmp_path, quiet=True)
    assert run(small("second"), tmp_path, quiet=True, force=True).summary["name"] == "second"


def test_a_run_killed_before_its_first_line_is_begun_again(tmp_path):
    """An empty log says nothing of whose it is, and holds nothing that could be lost."""
    (tmp_path / "run.log").touch()
    run(small(), tmp_path, quiet=True)
    assert "prensa" in (tmp_path / "run.log").read_text(encoding="utf-8").splitlines()[0]
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "run.log").write_text("mine", encoding="utf-8")
    with pytest.raises(PrensaError, match=r"run\.log here was not left by a run"):
        run(small(), tmp_path / "other", quiet=True)


def test_a_file_that_no_run_left_is_not_overwritten(tmp_path):
    """Somebody's own history.csv stays."""
    (tmp_path / "history.csv").write_text("year,king\n")
    with pytest.raises(PrensaError, match=r"history\.csv here was not left by a run"):
        run(small(), tmp_path, quiet=True)
    assert (tmp_path / "history.csv").read_text() == "year,king\n"


@pytest.mark.skipif(os.name != "posix", reason="links are a privilege there")
@pytest.mark.parametrize("name", ["fields", "pictures", "contact"])
def test_links_inside_a_folder_are_not_followed(tmp_path, name):
    """A folder of results that is a link is refused by run and resume; what it leads to is left alone."""
    foreign, out = tmp_path / "foreign", tmp_path / "out"
    foreign.mkdir()
    (foreign / "0001.vtu").write_text("mine")
    out.mkdir()
    (out / name).symlink_to(foreign)
    with pytest.raises(PrensaError, match="this is a link"):
        run(small(), out, quiet=True)
    assert [p.name for p in foreign.iterdir()] == ["0001.vtu"] and (foreign / "0001.vtu").read_text() == "mine"


@pytest.mark.skipif(os.name != "posix", reason="links are a privilege there")
def test_linked_files_are_replaced_and_not_written_through(tmp_path):
    """A run removes a link in the place of a file, or of its temporary one; a resume refuses it."""
    mine = tmp_path / "mine.txt"
    mine.write_text("mine")
    out = tmp_path / "out"
    run(small(), out, quiet=True)
    for name in ("run.log", "history.csv", "fields/0001.vtu.part", "history.csv.part"):
        (out / name).unlink(missing_ok=True)
        (out / name).symlink_to(mine)
    with pytest.raises(PrensaError, match="this is a link"):
        resume(out, quiet=True)
    run(small(), out, quiet=True)
    assert mine.read_text() == "mine" and not (out / "run.log").is_symlink()


# --------------------------------------------------------------------------------------------------------------- names
def test_every_contact_has_a_table_of_its_own(tmp_path):
    """Names that a file system would take for one another get different ones, and each keeps its rows."""
    points = pr.Points(
        ((0, 0), (1, 0), (1, 1), (0, 1)),
        ((0, 1, 2, 3),),
        {"a/b": (2, 3), "a_b": (2, 3), "A_B": (2, 3), "bottom": (0, 1)},
    )
    problem = dataclasses.replace(
        small(increments=1).problem, bodies={"block": pr.Body(points, pr.Elastic(1000, 0.3))},
        tools={"punch": pr.Plane(touching="block.a/b")}, fixed={"block.bottom": "xy"},
        contacts=tuple(pr.Contact(f"block.{n}", "punch") for n in ("a/b", "a_b", "A_B")),
    )  # fmt: skip
    names = files.file_names(c.name for c in problem.contacts)
    assert len({n.casefold() for n in names.values()}) == 3 and names["block.a/b-punch"] == "block.a_b-punch"
    for name, file in names.items():
        path = tmp_path / history.CONTACT_FOLDER / file / "0001.csv"
        path.parent.mkdir(parents=True)
        path.write_text(name)
    assert len(list((tmp_path / history.CONTACT_FOLDER).iterdir())) == 3


@pytest.mark.parametrize("name", ["..", ".", "", "a\0b", "CON", "nul.txt", "ö" * 300, "a" * 300, "a.", "x\ny"])
def test_a_file_name_is_one_safe_component(tmp_path, name):
    """No name leads out of its folder, is a device, or is longer than file systems bear."""
    safe = files.file_name(name)
    (tmp_path / safe).write_text("x")
    assert [p.name for p in tmp_path.iterdir()] == [safe] and len(safe.encode()) < 200
    assert safe.lower() not in ("con", "nul.txt") and not safe.endswith(".")


# ---------------------------------------------------------------------------------------------- tables and checkpoint
def test_tables_that_lost_rows_are_not_continued(tmp_path):
    """Where the checkpoint knows more than a table, a resume says what is missing and leaves everything as it is."""
    run(small(), tmp_path, quiet=True)
    path = tmp_path / "history.csv"
    lines = path.read_text().splitlines(keepends=True)
    for rows, words in ((lines[:2], "increment 2 is missing"), (lines[:1] + lines[2:], "increment 1 is missing")):
        path.write_text("".join(rows))
        with pytest.raises(PrensaError, match=f"after increment 3, time 1, and {words}"):
            resume(tmp_path, quiet=True)
        assert path.read_text() == "".join(rows)
    path.write_text("".join([*lines[:3], lines[3].replace(",1.0,", ",0.9,", 1)]))
    with pytest.raises(PrensaError, match=r"ends at 0\.9: they are of two runs"):
        resume(tmp_path, quiet=True)
    path.write_text("".join(lines))
    convergence = tmp_path / "convergence.csv"
    convergence.write_text(convergence.read_text().splitlines()[0] + "\n")
    with pytest.raises(PrensaError, match=r"convergence\.csv.*rows were lost"):
        resume(tmp_path, quiet=True)


@pytest.mark.parametrize("damage", [b"\0\0\0\0\n", b"\xff\xfe\n", b"press,x,y\n"])
def test_a_damaged_table_is_reported_as_such(tmp_path, damage):
    """Bytes that a crash left in a table are no traceback."""
    header = b"step,increment,time\n"
    (tmp_path / "history.csv").write_bytes(header + damage)
    try:
        read_history(tmp_path)
    except PrensaError as error:
        assert "history.csv: the table is damaged" in str(error)
    else:
        assert damage.startswith(b"\0")  # too short for a row: as one that was cut off


def test_everything_reaches_the_disk_before_the_checkpoint_that_refers_to_it(tmp_path, monkeypatch):
    """Tables, contacts, fields and their folders are flushed since the last checkpoint, and then it takes its place."""
    events: list[str] = []
    flush, replace = files.flush, os.replace

    def flushed(paths, directory):
        events.extend(p.relative_to(directory).as_posix() for p in paths if p.is_file())
        flush(paths, directory)

    def replaced(old, new):
        if Path(new).name == "checkpoint.h5":
            events.append("checkpoint.h5")
        replace(old, new)

    monkeypatch.setattr("prensa.output.run.flush", flushed)
    monkeypatch.setattr(files.os, "replace", replaced)
    run(small(), tmp_path, quiet=True)
    last = len(events) - 1 - events[::-1].index("checkpoint.h5")
    before = set(events[:last])
    assert {"history.csv", "convergence.csv", "fields.pvd"} <= before
    assert {f"fields/{k:04d}.vtu" for k in (1, 2, 3)} <= before
    assert {f"contact/block.top-punch/{k:04d}.csv" for k in (1, 2, 3)} <= before


def test_a_collection_cut_in_pieces_is_continued(tmp_path):
    """Of a list of fields whose end a power cut took, the whole entries are kept."""
    run(small(), tmp_path, quiet=True)
    path = tmp_path / vtk.COLLECTION
    whole = path.read_text()
    path.write_text(whole[: whole.index("0003.vtu") + 4])
    with pytest.raises(PrensaError, match="cannot be read"):
        vtk.read_collection(path)
    vtk.Fields(tmp_path, keep=3)
    assert [name for _, name in vtk.read_collection(path)] == ["fields/0001.vtu", "fields/0002.vtu"]


def test_a_collection_with_a_damaged_time_is_continued(tmp_path):
    """Of a list of fields in which a time is not a number, the other entries are kept."""
    run(small(), tmp_path, quiet=True)
    path = tmp_path / vtk.COLLECTION
    path.write_text(path.read_text().replace('timestep="0', 'timestep="0ˇ', 1), encoding="utf-8")
    vtk.Fields(tmp_path, keep=3)
    assert len(vtk.read_collection(path)) == 2


def test_a_folder_in_the_place_of_a_file_is_reported_by_name(tmp_path):
    """A folder that has the name of a file to be written, or of its temporary one, is said to be in the way, and stays."""
    for taken in ("fields.pvd", "fields.pvd.part"):
        (tmp_path / taken / "kept").mkdir(parents=True)
        with pytest.raises(PrensaError, match=f"{taken} is a folder, where a file is to be written"):
            files.write_text(tmp_path / "fields.pvd", "text")
        assert (tmp_path / taken / "kept").is_dir()
        (tmp_path / taken / "kept").rmdir()
        (tmp_path / taken).rmdir()
