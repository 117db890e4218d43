import subprocess
import sys

import h5py
import numpy as np
import pytest
import synthetic

from prensa.errors import PrensaError
from prensa.output.checkpoint import read_checkpoint, write_checkpoint
from prensa.output.files import replacing
from prensa.system.checkpoint import VERSION


@pytest.fixture
def path(tmp_path):
    return write_checkpoint(tmp_path / "checkpoint.h5", synthetic.case(), synthetic.committed(3, 0.3))


def test_a_checkpoint_returns_case_and_state_bit_for_bit(path):
    """Every array has the same bits, and the case is the same case."""
    case, state = read_checkpoint(path)
    before, after = synthetic.committed(3, 0.3).arrays(), state.arrays()
    assert case == synthetic.case()
    assert list(before) == list(after)
    for name in before:
        assert before[name].shape == after[name].shape and before[name].tobytes() == after[name].tobytes(), name


@pytest.mark.parametrize("size", [0, 100, 2000, -1000])
def test_a_truncated_file_is_refused(path, size):
    """A file that lost its end (or nearly everything) is refused with its name and a remedy."""
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(PrensaError, match=r"checkpoint\.h5: .*run the case again"):
        read_checkpoint(path)


def test_a_foreign_file_is_refused(path):
    """An HDF5 file of someone else, or no HDF5 file at all, is not taken for a checkpoint."""
    with h5py.File(path, "w") as file:
        file["x"] = 1
    with pytest.raises(PrensaError, match="not written by prensa"):
        read_checkpoint(path)
    path.write_text("name: hertz\n")
    with pytest.raises(PrensaError, match="not an HDF5 file"):
        read_checkpoint(path)


def test_another_layout_is_refused(path):
    """A checkpoint of another layout names both versions and what to do."""
    with h5py.File(path, "a") as file:
        file.attrs["version"] = 99
    with pytest.raises(PrensaError, match=rf"layout 99.*reads layout {VERSION}.*resume with the version that wrote it"):
        read_checkpoint(path)


def test_a_changed_case_or_state_is_refused(path):
    """Editing the case or flipping one bit of the state breaks the hash, and the message says which."""
    with h5py.File(path, "a") as file:
        u = np.array(file["state/u"])
        u.view(np.uint64)[7] ^= 1
        file["state/u"][...] = u
    with pytest.raises(PrensaError, match="stored state is damaged"):
        read_checkpoint(path)
    with h5py.File(path, "a") as file:
        text = file["case"].asstr()[()].replace("0.3", "0.4")
        del file["case"]
        file["case"] = text
    with pytest.raises(PrensaError, match="stored case was changed"):
        read_checkpoint(path)


def test_hdf5_does_not_see_a_damaged_file(path, monkeypatch):
    """It crashes on some: any byte that has changed is reported before, wherever it is."""
    monkeypatch.setattr("h5py.File", None)
    whole = path.read_bytes()
    for place in np.random.default_rng(3).integers(8, len(whole) - 22, 50).tolist():  # behind the signature
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x5A]) + whole[place + 1 :])
        with pytest.raises(PrensaError, match=r"checkpoint\.h5: the file is damaged \(its checksum does not match\); run"):
            read_checkpoint(path)


def test_a_missing_checkpoint_is_reported(tmp_path):
    """No file: the message says how a checkpoint comes to be."""
    with pytest.raises(PrensaError, match="prensa run"):
        read_checkpoint(tmp_path / "checkpoint.h5")


def test_an_error_while_writing_leaves_the_previous_file(path):
    """When the writer fails half-way the old checkpoint is untouched and no temporary file stays."""
    before = path.read_bytes()
    with pytest.raises(RuntimeError), replacing(path) as temporary:
        temporary.write_bytes(b"half")
        raise RuntimeError
    assert path.read_bytes() == before
    assert [p.name for p in path.parent.iterdir()] == ["checkpoint.h5"]


def test_a_killed_writer_leaves_the_previous_file(path):
    """When the process dies in the middle of writing the old checkpoint still opens."""
    program = (
        "import os, sys; from pathlib import Path; from prensa.output.files import replacing\n"
        "with replacing(Path(sys.argv[1])) as temporary:\n    temporary.write_bytes(b'half'); os._exit(9)"
    )
    assert subprocess.run([sys.executable, "-c", program, str(path)], check=False).returncode == 9
    read_checkpoint(path)
