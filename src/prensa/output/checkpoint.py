"""Writing of ``checkpoint.h5``: the case and its last committed state, enough to continue bit for bit."""

from __future__ import annotations

from pathlib import Path

from prensa import __version__
from prensa.model.problem import Case
from prensa.output.files import replacing
from prensa.system.checkpoint import CHECKPOINT, FORMAT, VERSION, arrays_hash, read_checkpoint, seal, text_hash
from prensa.system.state import State

__all__ = ["CHECKPOINT", "case_text", "read_checkpoint", "text_hash", "write_checkpoint"]


def case_text(case: Case) -> str:
    """The whole case as YAML: what the input hash is taken of, whatever file or script the case came from."""
    from prensa.model.schema import dump

    return dump(case)


def write_checkpoint(path: str | Path, case: Case | str, state: State) -> Path:
    """Write a checkpoint, atomically: the previous one stays until the new one is on the disk.

    Parameters
    ----------
    path
        File to (re)place.
    case
        The case, or its YAML text (the same at every increment, so that the caller may keep it).
    state
        Committed state; its arrays are stored as they are.

    """
    import h5py

    text = case if isinstance(case, str) else case_text(case)
    arrays = state.arrays()
    with replacing(Path(path)) as temporary:
        with h5py.File(temporary, "w") as file:
            file.attrs.update(format=FORMAT, version=VERSION, prensa=__version__)
            file.attrs.update(input_hash=text_hash(text), state_hash=arrays_hash(arrays))
            file.create_dataset("case", data=text, track_times=False)
            for name, array in arrays.items():
                file.create_dataset(f"state/{name}", data=array, track_times=False)
        seal(temporary)
    return Path(path)
