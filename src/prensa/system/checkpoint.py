"""Checkpoints for a restart, ``checkpoint.h5``: the case and its last committed state, to resume or to start another case from.

Layout of the file: attributes ``format``, ``version`` (of the layout), ``prensa`` (of the package), ``input_hash`` (of
the case) and ``state_hash`` (of the arrays); data set ``case`` (YAML text); group ``state`` (one data set per array of
`State.arrays`). Behind what HDF5 reads the checksum of all of it.
"""

from __future__ import annotations

import hashlib
import logging
from pathlib import Path
from typing import IO, TYPE_CHECKING
from zlib import crc32

import numpy as np

from prensa import __version__
from prensa.errors import PrensaError
from prensa.model.problem import Case
from prensa.system.state import State
from prensa.types import Stored

if TYPE_CHECKING:
    from h5py import AttributeManager

CHECKPOINT = "checkpoint.h5"
FORMAT = "prensa checkpoint"
VERSION = 13
# 2: second difference of the increments; 3: named fields of contact points, clock and energies; 4: stability; 5: speed of slip;
# 6: ends of the steps, meshes made during the run; 9: how steadily bodies flow; 10: areas of contact points;
# 11: third difference of the increments; 12: without it; 13: times and paths of contact points

SEAL_NAME = b"prensa crc32 "
SEAL = SEAL_NAME + b"%08x\n"
SUMMED_AT_ONCE = 1 << 22  # bytes of a file

log = logging.getLogger(__name__)


def seal(path: Path) -> None:
    """Append the checksum of a file to it, behind what HDF5 reads."""
    with path.open("rb+") as file:
        checksum = _checksum(file, file.seek(0, 2))
        file.write(SEAL % checksum)


def seal_broken(path: Path) -> bool:
    """Whether a file ends in a checksum that is not its own: HDF5 may crash on a damaged file, and must not see it.

    A file without one, because it was cut off or written to again, is left to HDF5, which reports those.
    """
    length = len(SEAL % 0)
    with path.open("rb") as file:
        size = file.seek(0, 2) - length
        if size < 0:
            return False
        file.seek(size)
        end = file.read()
        return end.startswith(SEAL_NAME) and end != SEAL % _checksum(file, size)


def _checksum(file: IO[bytes], size: int) -> int:
    """CRC-32 of the first bytes of a file, whose place is at their end afterwards."""
    file.seek(0)
    value = 0
    while size > 0 and (part := file.read(min(size, SUMMED_AT_ONCE))):
        value, size = crc32(part, value), size - len(part)
    return value


def text_hash(text: str) -> str:
    """SHA-256 of *text* (hexadecimal)."""
    return hashlib.sha256(text.encode()).hexdigest()


def read_checkpoint(path: str | Path) -> tuple[Case, State]:
    """Return (case, state) of a checkpoint.

    Raises
    ------
    PrensaError
        If the file is missing, cut off, no checkpoint of prensa, of another layout, or does not match its own hashes.

    """
    from prensa.model.schema import loads

    text, arrays = _read(Path(path))
    return loads(text, bounded=False), State.from_arrays(arrays)


def _read(path: Path) -> tuple[str, dict[str, Stored]]:
    import h5py

    again = "run the case again"
    if not path.is_file():
        raise PrensaError(f"{path}: there is no checkpoint; start with 'prensa run'")
    if not h5py.is_hdf5(path):
        raise PrensaError(f"{path}: this is not an HDF5 file, or its beginning is damaged; {again}")
    if seal_broken(path):
        raise PrensaError(f"{path}: the file is damaged (its checksum does not match); {again}")
    try:
        with h5py.File(path, "r") as file:
            _check_origin(path, file.attrs)
            text = str(file["case"].asstr()[()])
            arrays = {str(name): np.array(data) for name, data in file["state"].items()}  # damaged names are bytes
            hashes = file.attrs["input_hash"], file.attrs["state_hash"]
    except (OSError, KeyError, RuntimeError, TypeError, ValueError) as error:
        raise PrensaError(f"{path}: the file is cut off or damaged ({error}); {again}") from error
    if hashes[0] != text_hash(text):
        raise PrensaError(f"{path}: the stored case was changed after the run (its hash does not match); {again}")
    if hashes[1] != arrays_hash(arrays):
        raise PrensaError(f"{path}: the stored state is damaged (its hash does not match); {again}")
    return text, arrays


def _check_origin(path: Path, attributes: AttributeManager) -> None:
    if attributes.get("format") != FORMAT:
        raise PrensaError(f"{path}: this HDF5 file was not written by prensa; give the folder of a run")
    version = int(attributes.get("version", 0))
    if version != VERSION:
        raise PrensaError(
            f"{path}: checkpoint layout {version}, written by prensa {attributes.get('prensa')}; this is prensa "
            f"{__version__}, which reads layout {VERSION}: resume with the version that wrote it or run the case again"
        )
    if attributes.get("prensa") != __version__:
        log.warning("%s was written by prensa %s; prensa %s may continue it with slightly different last digits",
                    path, attributes.get("prensa"), __version__)  # fmt: skip


def arrays_hash(arrays: dict[str, Stored]) -> str:
    """SHA-256 of named arrays: names, shapes, types and values."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {arrays[name].shape} {array.dtype.str}\n".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()
