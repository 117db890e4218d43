"""Output of the commands: results on standard output, everything else on standard error, errors in plain text with exit codes."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import typer

if TYPE_CHECKING:
    from prensa.model.problem import Case

BAD_INPUT, FAILED, INTERRUPTED, TERMINATED = 2, 1, 130, 143
STANDARD_INPUT = Path("-")


class Source:
    """A case as it was named on the command line: a file, or ``-`` for standard input, and changes to it."""

    def __init__(self, path: Path, changes: Iterable[str] | None = None) -> None:
        self.path, self.changes = path, list(changes or ())

    @property
    def is_file(self) -> bool:
        """Whether it is a file, and not standard input."""
        return self.path != STANDARD_INPUT

    @property
    def name(self) -> str:
        """Its name in messages."""
        return str(self.path) if self.is_file else "<standard input>"

    @cached_property
    def _text(self) -> str:
        from prensa.model.schema import text_of

        return text_of(sys.stdin.buffer.read, self.name)

    def read(self) -> Case:
        """The case; raises CaseError with what is wrong with it. Files that standard input names are sought where we are."""
        from prensa.model.schema import load, loads

        return load(self.path, self.changes) if self.is_file else loads(self._text, self.name, Path(), self.changes)

    @property
    def given(self) -> Path | Case:
        """The file, which a study reads again for each of its runs; of standard input the case."""
        return self.path if self.is_file else self.read()

    def located(self, message: str) -> str:
        """A message with file, line and column before each of its lines that names a part of the case."""
        from prensa.model.schema import located, located_in

        if self.is_file:
            return located(message, self.path, self.changes)
        return located_in(message, self._text, self.name, self.changes)

    def folder(self, ending: str = "") -> Path:
        """Where its results go unless something else is said: named as its file, or as the case of standard input."""
        from prensa.output.files import file_name

        return Path("results") / f"{self.path.stem if self.is_file else file_name(self.read().problem.name)}{ending}"


class Voice:
    """What a verb says, and how it ends; a context that turns errors into text and exit codes.

    ``quiet``: no progress and no remarks; ``verbose``: also what a run's log says, and tracebacks; ``json``: the result as one
    JSON document, and no progress. ``source`` is the case in whose file messages are looked up, ``folder`` where an interrupted
    run left what it has, ``interrupted`` what to say of an interruption in place of that.
    """

    def __init__(
        self, quiet: bool = False, verbose: bool = False, json: bool = False, *, source: Source | None = None,
        folder: Path | None = None, interrupted: str = "",
    ) -> None:  # fmt: skip
        self.verbose, self.json, self.source, self.folder, self._interrupted = verbose, json, source, folder, interrupted
        self.quiet = quiet or json
        self._handler: logging.Handler | None = None
        self._signals: AbstractContextManager[object] = nullcontext()

    @property
    def no_bar(self) -> bool:
        """Whether progress is not shown by a bar: because nothing is asked for, or every line of the log."""
        return self.quiet or self.verbose

    # --------------------------------------------------------------------------------------------------------- to say
    def say(self, text: str) -> None:
        """A line of the result, on standard output; left out where it is given as JSON."""
        if not self.json:
            typer.echo(self._fitted(text, sys.stdout))

    def confirm(self, text: str) -> None:
        """What was done, on standard output, unless asked to be quiet."""
        if not self.quiet:
            self.say(text)

    def remark(self, text: str) -> None:
        """What is worth knowing on the way, on standard error, unless asked to be quiet."""
        if not self.quiet:
            self.complain(text)

    def complain(self, text: str) -> None:
        """A warning or an error, on standard error."""
        typer.echo(self._fitted(text, sys.stderr), err=True)

    def warn(self, text: str) -> None:
        """A warning about the case, with its place in the file."""
        self.complain(self.warned(text))

    def warned(self, text: str) -> str:
        """A warning in words, with its place in the file of the case if it names one."""
        return self._located(text, "warning: ")

    def give(self, result: Mapping[str, Any]) -> None:
        """The result as JSON, where that is asked for; numbers that are none are null."""
        if self.json:
            import json

            typer.echo(json.dumps(_plain(result), indent=2, ensure_ascii=False))

    def announcing_compilation(self) -> AbstractContextManager[None]:
        """A line on the terminal when kernels have to be compiled, unless quiet."""
        from prensa.kernels.compiling import announced

        return nullcontext() if self.quiet else announced(self.remark)

    def _fitted(self, text: str, stream: Any) -> str:
        from prensa.output.terminal import fitted

        whole = [str(p) for p in (self.source.path if self.source else None, self.folder) if p is not None]
        return fitted(text, stream, whole)

    def _located(self, message: str, kind: str = "") -> str:
        if self.source is None:
            return kind + message
        text = self.source.located(message)
        return kind + text if text == message else text.replace(message, kind + message)

    # --------------------------------------------------------------------------------------------------------- to end
    def __enter__(self) -> Self:
        from prensa.output.interrupt import Interruptible

        self._signals = Interruptible()  # studies end at SIGTERM as at Ctrl-C, with what is computed kept
        self._signals.__enter__()
        if self.verbose:
            self._handler = logging.StreamHandler(sys.stderr)
            self._handler.setFormatter(logging.Formatter("%(message)s"))
            self._handler.addFilter(lambda record: record.levelno < logging.WARNING)  # warnings are reported anyway
            log = logging.getLogger("prensa")
            log.addHandler(self._handler)
            log.setLevel(logging.INFO)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._signals.__exit__(None, None, None)
        if self._handler is not None:
            log = logging.getLogger("prensa")
            log.removeHandler(self._handler)
            log.setLevel(logging.NOTSET)
        if error is None or isinstance(error, typer.Exit):
            return
        code = self._reported(error)
        if code is not None:
            raise typer.Exit(code) from None

    def _reported(self, error: BaseException) -> int | None:
        """Report an error; its exit code, None where it is a mistake of this program."""
        from prensa.errors import PrensaError, SolveError

        if self.verbose and isinstance(error, PrensaError | OSError | MemoryError):
            import traceback

            typer.echo("".join(traceback.format_exception(error)), err=True, nl=False)
        if isinstance(error, PrensaError):
            self.complain(self._located(str(error)))
            return FAILED if isinstance(error, SolveError) else BAD_INPUT
        if isinstance(error, OSError):
            self.complain(f"prensa: {error}")
            return FAILED
        if isinstance(error, MemoryError):
            self.complain(f"prensa: out of memory ({error}); use fewer elements")
            return FAILED
        if isinstance(error, KeyboardInterrupt):
            self.complain(f"\ninterrupted; {self._interrupted or left_on_disk(self.folder)}")
            from prensa.output.interrupt import Terminated

            return TERMINATED if isinstance(error, Terminated) else INTERRUPTED
        return None


def left_on_disk(folder: Path | None) -> str:
    """What an interrupted run has left on disk, in words."""
    if folder is None:
        return "nothing was written"
    history = folder / "history.csv"
    if not history.is_file():
        return f"no increment was finished, {folder} holds no results"
    rows = max(history.read_text(errors="replace").count("\n") - 1, 0)
    text = f"{folder} holds {rows} increments" if rows != 1 else f"{folder} holds 1 increment"
    return f"{text}; continue with 'prensa resume {folder}'" if (folder / "checkpoint.h5").is_file() else text


def refuse_unknown(voice: Voice, kind: str, names: Iterable[str], known: Iterable[str]) -> None:
    """Leave with a word where a name is not a known one."""
    from prensa.model.names import nearest

    known = list(known)
    for name in names:
        if name not in known:
            similar = nearest(name, known)
            hint = f"did you mean {similar!r}? " if similar is not None else ""
            voice.complain(f"unknown {kind} {name!r}; {hint}known: {', '.join(known)}")
            raise typer.Exit(BAD_INPUT)


def near(path: Path) -> str:
    """A path as short as it can be said."""
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)


def _plain(value: Any) -> Any:
    """Dicts, lists and scalars of a result: paths as text, arrays as lists, numbers that JSON has not as null."""
    convert: Callable[[], Any] | None = getattr(value, "tolist", None)
    if convert is not None:
        value = convert()
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, float):
        return value if abs(value) < float("inf") else None
    return str(value) if isinstance(value, Path) else value
