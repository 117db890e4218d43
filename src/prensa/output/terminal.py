"""Terminal output: lines broken at words to the width of the terminal, bars, one live line in notebooks.

Where there is no terminal (a file, a pipe, another program) lines stay whole, so that they can be searched.
"""

from __future__ import annotations

import re
import shutil
import sys
import textwrap
import time as clocks
from collections.abc import Callable, Iterable
from types import TracebackType
from typing import IO, TYPE_CHECKING, Any, Self

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

NARROWEST = 40  # columns: narrower terminals get lines of this length
_QUOTED = re.compile(r"'[^'\n]*'|\"[^\"\n]*\"")
_HELD = "\uf8ff"  # of the private use area: it stands for a blank at which no line is broken


def wrapped(text: str, width: int, whole: Iterable[str] = ()) -> str:
    """Break the lines of a text at blanks to a width; what follows the first line of each is indented.

    Never inside what is quoted, inside one of *whole* (paths with blanks) or inside a word, so that a path stays one that can
    be copied.
    """

    def held(found: re.Match[str] | str) -> str:
        return (found if isinstance(found, str) else found[0]).replace(" ", _HELD)

    for path in whole:
        text = text.replace(path, held(path)) if " " in path else text
    lines = []
    for line in _QUOTED.sub(held, text).split("\n"):
        indent = " " * (len(line) - len(line.lstrip()))
        broken = textwrap.wrap(
            line, max(width, NARROWEST), subsequent_indent=f"{indent}  ", break_long_words=False, break_on_hyphens=False,
            drop_whitespace=True, replace_whitespace=False,
        )  # fmt: skip
        lines += broken or [""]
    return "\n".join(lines).replace(_HELD, " ")


def fitted(text: str, stream: IO[str] | None = None, whole: Iterable[str] = ()) -> str:
    """A text as it is shown on a stream (standard error if None): broken to its width where that is a terminal."""
    stream = stream or sys.stderr
    if not (hasattr(stream, "isatty") and stream.isatty()):
        return text
    return wrapped(text, shutil.get_terminal_size().columns, whole)


class Display:
    """A bar on a terminal and lines elsewhere, on standard error: standard output stays free for results.

    Parameters
    ----------
    quiet
        Show nothing but warnings.
    console
        Where to show, in place of standard error.

    """

    def __init__(self, quiet: bool = False, console: Console | None = None) -> None:
        from rich.console import Console

        self._console = console or Console(stderr=True, quiet=quiet)
        self._quiet, self._began = quiet, clocks.perf_counter()
        self._bar: Progress | None = None
        self._line = None if quiet or console is not None else notebook_line()
        self.warned: Callable[[str], str] = "warning: {}".format
        """A warning in words, with its place in the case where that is known."""

    @property
    def quiet(self) -> bool:
        """Whether it shows warnings alone."""
        return self._quiet

    @property
    def has_bar(self) -> bool:
        """Whether there is something to show a bar on."""
        return not self._quiet and self._line is None and self._console.is_terminal

    def __enter__(self) -> Self:
        if self._bar:
            self._bar.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._bar:
            self._bar.stop()

    def say(self, line: str) -> None:
        """Show a line of text, unless asked to be quiet."""
        if not self._quiet:
            self._print(line)

    def show_always(self, text: str) -> None:
        """Show a line that stays, also when asked to be quiet."""
        from rich.console import Console

        self._show(self._console if self._bar else Console(stderr=True, force_jupyter=False), text)

    def warn(self, text: str) -> None:
        """Show a warning, also when asked to be quiet."""
        self.show_always(self.warned(text))

    def _print(self, line: str) -> None:
        if self._line is not None:
            self._line(line)
        else:
            self._show(self._console, line)

    @staticmethod
    def _show(console: Console, line: str) -> None:
        text = wrapped(line, console.width) if console.is_terminal else line
        console.print(text, markup=False, highlight=False, soft_wrap=True)

    def _left(self, done: float, todo: float) -> str:
        """Time left, in words, if what is to do goes as fast as what is done."""
        if done <= 0:
            return "–"
        seconds = round((clocks.perf_counter() - self._began) * todo / done)
        return f"{seconds // 3600}:{seconds // 60 % 60:02d}:{seconds % 60:02d}"


def notebook_line() -> Callable[[str], None] | None:
    """What replaces the text of one line below the running cell; None outside notebooks. Nothing of IPython is imported there."""
    shell = sys.modules.get("IPython")
    running = shell.get_ipython() if shell is not None else None
    if running is None or getattr(running, "kernel", None) is None:
        return None
    from IPython.display import display

    handle: Any = None

    def show(line: str) -> None:
        nonlocal handle
        text = {"text/plain": line}
        if handle is None:
            handle = display(text, raw=True, display_id=True)
        else:
            handle.update(text, raw=True)

    return show
