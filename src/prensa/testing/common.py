"""Common parts of the suites: the error that they raise, sizes of samples and differences."""

from __future__ import annotations

TRIALS = 400  # random points at which a law is tried
FD_ERROR = 1e-6  # accepted difference of a derivative from finite differences, over the size of its terms
KINK = 1e-3  # change of a slope, over its size, within a step of differences from which there is a kink; also the error of slopes


class LawError(AssertionError):
    """A law that cannot be right; the text says what was found wrong, one sentence a line."""


def raise_if_wrong(what: str, found: list[str]) -> None:
    """Raise `LawError` with what was found, if anything was."""
    if found:
        raise LawError("\n".join([f"{what}:", *(f"- {line}" for line in found)]))
