"""``checkpoint.h5``: the case and its last committed state, enough to continue bit for bit.

Layout of the file: attributes ``format``, ``version`` (of the layout), ``prensa`` (of the package), ``input_hash`` (of
the case) and ``state_hash`` (of the arrays); data set ``case`` (YAML text); group ``state`` (one data set per array of
`State.arrays`).
"""

from __future__ import annotations

import hashlib
import logging
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from prensa import __version__
from prensa.errors import PrensaError
from prensa.fem.state import State
from prensa.model.problem import Case
from prensa.output.files import replacing

CHECKPOINT = "checkpoint.h5"
FORMAT = "prensa checkpoint"
VERSION = 1

log = logging.getLogger(__name__)


def case_text(case: Case) -> str:
    """The whole case as YAML: what the input hash is taken of, whatever file or script the case came from."""
    from prensa.model.schema import dump

    return dump(case)


def text_hash(text: str) -> str:
    """SHA-256 of *text* (hexadecimal)."""
    return hashlib.sha256(text.encode()).hexdigest()


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
    text = case if isinstance(case, str) else case_text(case)
    arrays = state.arrays()
    with replacing(Path(path)) as temporary, h5py.File(temporary, "w") as file:
        file.attrs.update(format=FORMAT, version=VERSION, prensa=__version__)
        file.attrs.update(input_hash=text_hash(text), state_hash=_arrays_hash(arrays))
        file.create_dataset("case", data=text, track_times=False)
        for name, array in arrays.items():
            file.create_dataset(f"state/{name}", data=array, track_times=False)
    return Path(path)


def read_checkpoint(path: str | Path) -> tuple[Case, State]:
    """Return (case, state) of a checkpoint.

    Raises
    ------
    PrensaError
        If the file is missing, cut off, no checkpoint of prensa, of another layout, or does not match its own hashes.

    """
    from prensa.model.schema import loads

    text, arrays = _read(Path(path))
    return loads(text), State.from_arrays(arrays)


def _read(path: Path) -> tuple[str, dict[str, NDArray[Any]]]:
    again = "run the case again"
    if not path.is_file():
        raise PrensaError(f"{path}: there is no checkpoint; start with 'prensa run'")
    if not h5py.is_hdf5(path):
        raise PrensaError(f"{path}: this is not an HDF5 file, or its beginning is damaged; {again}")
    try:
        with h5py.File(path, "r") as file:
            _check_origin(path, dict(file.attrs))
            text = str(file["case"].asstr()[()])
            arrays = {name: np.array(data) for name, data in file["state"].items()}
            hashes = file.attrs["input_hash"], file.attrs["state_hash"]
    except (OSError, KeyError, RuntimeError, TypeError, ValueError) as error:
        raise PrensaError(f"{path}: the file is cut off or damaged ({error}); {again}") from error
    if hashes[0] != text_hash(text):
        raise PrensaError(f"{path}: the stored case was changed after the run (its hash does not match); {again}")
    if hashes[1] != _arrays_hash(arrays):
        raise PrensaError(f"{path}: the stored state is damaged (its hash does not match); {again}")
    return text, arrays


def _check_origin(path: Path, attributes: dict[str, Any]) -> None:
    if attributes.get("format") != FORMAT:
        raise PrensaError(f"{path}: this HDF5 file was not written by prensa; give the folder of a run")
    version = int(attributes.get("version", 0))
    if version != VERSION:
        raise PrensaError(
            f"{path}: checkpoint layout {version}, written by prensa {attributes.get('prensa')}; this is prensa "
            f"{__version__}, which reads layout {VERSION}: resume with the version that wrote it or run the case again"
        )
    if attributes.get("prensa") != __version__:
        log.warning("%s was written by prensa %s; prensa %s may continue it with other last digits",
                    path, attributes.get("prensa"), __version__)  # fmt: skip


def _arrays_hash(arrays: dict[str, NDArray[Any]]) -> str:
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {arrays[name].shape} {array.dtype.str}\n".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()
