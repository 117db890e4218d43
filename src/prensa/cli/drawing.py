"""Options of ``prensa plot`` as values, and the file that they make."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from prensa.errors import PrensaError

if TYPE_CHECKING:
    from prensa.output.result import RunResult

FILMS = (".gif", ".mp4")


def options(
    size: str | None, dpi: float | None, box: str | None, colours: str | None, mesh: bool | None, contact: str | None,
    view: str | None, section: str | None,
) -> dict[str, Any]:  # fmt: skip
    """What was given, as `RunResult.plot` takes it.

    Raises
    ------
    PrensaError
        For what is no size, resolution, part or range.

    """
    if dpi is not None and not 10.0 <= dpi <= 2400.0:
        raise PrensaError(f"--dpi {dpi:g}: give pixels an inch between 10 and 2400")
    inches = None if size is None else _numbers("--size", size.replace("x", ","), (2,), "6x4")
    if inches is not None and not all(0.5 <= v <= 60.0 for v in inches):
        raise PrensaError(f"--size {size}: give width and height in inches between 0.5 and 60")
    found: dict[str, Any] = {
        "size": inches, "dpi": dpi, "mesh": mesh, "contact": contact, "view": view, "section": section,
        "box": None if box is None else _intervals("--box", box, (4, 6), "0,10,-5,5"),
        "range": None if colours is None else _intervals("--range", colours, (2,), "0,400"),
    }  # fmt: skip
    return {name: value for name, value in found.items() if value is not None}


def draw(run: RunResult, what: str, step: str | None, out: Path | None, film: bool, given: dict[str, Any]) -> Path:
    """Draw a picture or a film of a run; returns its file.

    Raises
    ------
    PrensaError
        If there is no such picture, or no picture with such an ending.

    """
    name = what.replace(".", "_")
    if film or (out is not None and out.suffix.lower() in FILMS):
        if step is not None:
            raise PrensaError("a film shows the whole run; leave --step out")
        target = out or run.directory / f"{name}.gif"
        run.animate(what, target, **given)
        return target
    step = step or "last"
    target = out or run.directory / f"{name}.png"
    figure = run.plot(what, at=int(step) if step.isdecimal() else step, **given)
    kinds = figure.canvas.get_supported_filetypes()
    if target.suffix and target.suffix[1:].lower() not in kinds:  # without one it is a .png
        endings = ", ".join(f".{kind}" for kind in kinds)
        raise PrensaError(f"{target}: no picture ends in {target.suffix!r}; give one of {endings}, .gif, .mp4")
    figure.savefig(target, dpi="figure", bbox_inches=None if "size" in given else "tight")
    return target


def _intervals(option: str, text: str, counts: tuple[int, ...], example: str) -> tuple[float, ...]:
    values = _numbers(option, text, counts, example)
    if not all(low < high for low, high in zip(values[::2], values[1::2])):
        raise PrensaError(f"{option} {text}: give the lower end first, as in {option} {example}")
    return values


def _numbers(option: str, text: str, counts: tuple[int, ...], example: str) -> tuple[float, ...]:
    try:
        values = tuple(map(float, text.split(",")))
    except ValueError:
        values = ()
    if len(values) not in counts:
        many = " or ".join(map(str, counts))
        raise PrensaError(f"{option} {text}: give {many} numbers, as in {option} {example}")
    return values
