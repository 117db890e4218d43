"""Arrays packed for a page: quantised, predicted from their neighbours in time and place, compressed, as text.

A page of ten thousand elements and fifty increments holds millions of numbers; as text of decimals they would be a hundred
megabytes. The reading half is ``unpack`` in ``templates/report.js``.
"""

from __future__ import annotations

import base64
import gzip
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.types import Array

PLACE_BITS, VALUE_BITS = 16, 12
"""Of displacements (1/65535 of their range) and of fields (1/4095: finer than any colour)."""
LEVEL = 6  # of the compression: more takes several times as long for a hundredth


class Packer:
    """Collects arrays into one block of bytes; `put` returns what the page needs to find an array again."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []
        self._size = 0

    def floats(self, values: Any) -> dict[str, Any]:
        """Any numbers, in single precision."""
        array = np.ascontiguousarray(values, dtype="<f4")
        return {"kind": "f4", "shape": list(array.shape), "at": self._append(_planes(array.view("<u4").ravel(), 4))}

    def whole(self, values: Any) -> dict[str, Any]:
        """Whole numbers from 0, such as the nodes of cells or a status."""
        array = np.ascontiguousarray(values)
        steps = np.ediff1d(array.ravel().astype(np.int64), to_begin=array.ravel()[:1])
        return {"kind": "i4", "shape": list(array.shape), "at": self._append(_planes(_zigzag(steps).astype("<u4"), 4))}

    def quantised(self, frames: Sequence[Array], bits: int, low: float, high: float) -> dict[str, Any]:
        """Values (n,) at each of some frames, as multiples of (high − low)/(2^bits − 1) above *low*."""
        values = np.asarray(frames, dtype=float)
        most = 2**bits - 1
        scale = (high - low) / most if high > low else 1.0
        q = np.clip(np.rint((values - low) / scale), 0, most).astype(np.int64)
        q = np.diff(q, axis=0, prepend=0)  # what changed since the frame before,
        q = np.diff(q, axis=1, prepend=0)  # less what changed at the node before
        at = self._append(_planes(_zigzag(q.ravel()).astype("<u4"), 3))
        return {"kind": "q", "shape": list(values.shape), "at": at, "low": low, "scale": scale}

    def text(self) -> str:
        """Everything, compressed (gzip) and in base64."""
        return as_text(b"".join(self._pieces))

    def _append(self, data: bytes) -> int:
        at = self._size
        self._pieces.append(data)
        self._size += len(data)
        return at


def as_text(data: bytes) -> str:
    """Bytes compressed (gzip) and in base64."""
    return base64.b64encode(gzip.compress(data, LEVEL, mtime=0)).decode("ascii")


def _zigzag(values: Any) -> Any:
    """Small numbers of either sign as small numbers without: 0, −1, 1, −2 … are 0, 1, 2, 3 …"""
    return (values << 1) ^ (values >> 63)


def _planes(values: NDArray[np.uint32], width: int) -> bytes:
    """The lowest bytes of all values, then the next: zeros stand together."""
    return values.view(np.uint8).reshape(-1, 4)[:, :width].T.tobytes()
