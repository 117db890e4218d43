import dataclasses
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import synthetic

from prensa.errors import PrensaError
from prensa.output import history


def write(directory: Path, numbers, keep=None) -> None:
    with closing(history.History(directory, synthetic.problem(), keep)) as writer:
        for number in numbers:
            writer.append(synthetic.increment(number))


def test_columns_of_the_history_are_the_stable_names(tmp_path):
    """The header of history.csv is, name by name, the interface that others build on."""
    write(tmp_path, [])
    assert (tmp_path / "history.csv").read_text().strip() == (
        "step,increment,time,"
        "cylinder.ux,cylinder.uy,cylinder.rz,cylinder.fx,cylinder.fy,cylinder.mz,"
        "block.top-cylinder.area,"
        "energy.external,energy.elastic,energy.plastic,energy.friction,energy.contact,energy.imbalance,"
        "iterations,cutbacks,"
        "fixed.block.bottom.fx,fixed.block.bottom.fy,fixed.block.left.fx,fixed.block.left.fy"
    )


def test_numbers_survive_the_text_bit_for_bit(tmp_path):
    """What read_history returns is what the increments held, to the last bit."""
    write(tmp_path, range(1, 11))
    table = history.read_history(tmp_path)
    made = [synthetic.increment(n) for n in range(1, 11)]
    assert table["cylinder.fy"].tolist() == [i.tools["cylinder"].force.y for i in made]
    assert table["energy.imbalance"].tolist() == [i.energy["imbalance"] for i in made]
    assert table["block.top-cylinder.area"].tolist() == [i.contacts[synthetic.CONTACT].area for i in made]
    assert table["step"].tolist() == ["press"] * 10
    assert table["increment"].dtype.kind == table["cutbacks"].dtype.kind == "i"


def test_every_row_is_on_the_disk_when_append_returns(tmp_path):
    """A reader sees each row before the writer is closed."""
    with closing(history.History(tmp_path, synthetic.problem())) as writer:
        for n in (1, 2, 3):
            writer.append(synthetic.increment(n))
            assert len(history.read_history(tmp_path)["time"]) == n


def test_a_row_cut_in_the_middle_is_ignored(tmp_path):
    """The history of a run killed while it wrote a row opens, without that row."""
    write(tmp_path, [1, 2])
    path = tmp_path / "history.csv"
    path.write_bytes(path.read_bytes()[:-30])
    assert history.read_history(tmp_path)["increment"].tolist() == [1]


def test_a_continued_history_equals_an_uninterrupted_one(tmp_path):
    """Rows later than the checkpoint, whole or cut, are dropped before the table grows again."""
    whole, resumed = tmp_path / "whole", tmp_path / "resumed"
    write(whole, range(1, 8))
    write(resumed, range(1, 6))
    with open(resumed / "history.csv", "a") as file:
        file.write("press,6,0.6,0")
    write(resumed, range(4, 8), keep=3)
    for name in ("history.csv", "convergence.csv"):
        assert (resumed / name).read_bytes() == (whole / name).read_bytes()


def test_a_history_of_another_case_is_not_continued(tmp_path):
    """Other columns than the case's are refused by name of the file."""
    (tmp_path / "history.csv").write_text("step,increment,time\npress,1,0.1\n")
    with pytest.raises(PrensaError, match=r"history\.csv: the columns are not those of this case"):
        write(tmp_path, [2], keep=1)


@pytest.mark.parametrize("end", ["\u2028", "\x0b", "\x85"])
def test_names_with_other_ends_of_lines_do_not_end_a_row(end, tmp_path):
    """A separator of lines that is no line feed, in a name, stands in the middle of the row of names."""
    write(tmp_path, [1, 2])
    path = tmp_path / "history.csv"
    path.write_text(path.read_text(encoding="utf-8").replace("block.left", f"bl{end}ock.left"), encoding="utf-8")
    table = history.read_history(tmp_path)
    assert table["increment"].tolist() == [1, 2]
    assert f"fixed.bl{end}ock.left.fy" in table


def test_contact_table_has_the_stable_columns_and_reads_back(tmp_path):
    """contact/<surface>-<tool>/NNNN.csv holds the contact state, status in words, to the last bit."""
    contact = synthetic.increment(10).contacts[synthetic.CONTACT]
    path = history.write_contact(tmp_path, synthetic.CONTACT, 3, contact)
    assert path == tmp_path / "contact" / "block.top-cylinder" / "0003.csv"
    columns = "node,x,y,gap,pressure,shear,slip,status,pressure_from_stress,pressure_smoothed,error,X,Y"
    columns += ",weight,force_x,force_y,speed"
    assert path.read_text().splitlines()[0] == columns
    table = history.read_contact(path)
    for name in ("gap", "pressure", "shear", "slip", "pressure_from_stress", "pressure_smoothed", "error"):
        assert np.array_equal(table[name], getattr(contact, name))
    assert np.array_equal(np.column_stack([table["x"], table["y"]]), contact.x)
    assert np.array_equal(np.column_stack([table["X"], table["Y"]]), contact.X)
    assert set(table["status"]) == {"open", "stick", "slip"}
    assert [p.name for p in path.parent.iterdir()] == ["0003.csv"]


def test_integration_points_have_a_table_of_their_own(tmp_path):
    """NNNN.points.csv holds what the law says at the points where these are not the nodes, and goes with its increment."""
    contact = synthetic.increment(10).contacts[synthetic.CONTACT]
    q = contact.points
    between = dataclasses.replace(q, X=0.5 * (q.X + np.roll(q.X, 1, axis=0)))
    path = history.write_contact(tmp_path, synthetic.CONTACT, 3, dataclasses.replace(contact, points=between))
    table = history.read_contact(path.with_name("0003.points.csv"))
    for name in ("gap", "pressure", "shear", "slip", "weight"):
        assert np.array_equal(table[name], getattr(between, name))
    assert np.array_equal(np.column_stack([table["X"], table["Y"]]), between.X)
    history.forget_contacts_after(tmp_path, 2)
    assert not path.parent.exists()


def test_a_folder_without_history_says_so(tmp_path):
    """Reading what is not there names the file and how it comes to be."""
    with pytest.raises(PrensaError, match=r"history\.csv.*prensa run"):
        history.read_history(tmp_path)
