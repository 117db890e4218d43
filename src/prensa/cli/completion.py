"""Shell completion: the values for a word to be completed; Typer installs the completion.

Nothing here may fail or print: whoever presses a key wants words or silence.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import typer


def kinds(incomplete: str) -> list[tuple[str, str]]:
    """Kinds of starter cases."""
    from prensa.output.starters import STARTERS

    return [(name, what) for name, (_, what) in STARTERS.items() if name.startswith(incomplete)]


def metals(incomplete: str) -> list[str]:
    """Metals that come with prensa."""
    from prensa.materials.metals import names

    return [name for name in names() if name.casefold().startswith(incomplete.casefold())]


def fields(incomplete: str) -> list[str]:
    """What can be drawn of every run."""
    known = (
        "mises", "plastic_strain", "damage", "displacement", "stress.xx", "stress.yy", "stress.xy", "stress.zz", "mean_stress",
        "triaxiality", "lode", "strain_rate", "pressure", "mesh", "force_stroke", "energy", "convergence",
    )  # fmt: skip
    return [name for name in known if name.startswith(incomplete)]


def moments(ctx: typer.Context, incomplete: str) -> list[str]:
    """Moments of the run that is named before: its steps too."""
    import json

    names = ["last", "largest force"]
    with suppress(Exception):
        from prensa.model.schema import loads

        summary = json.loads((_named(ctx, "folder") / "summary.json").read_text(encoding="utf-8"))
        names += [step.name for step in loads(summary["case"], bounded=False).problem.steps]
    return [name for name in names if name.startswith(incomplete)]


def changes(ctx: typer.Context, incomplete: str) -> list[str]:
    """Paths of the case that is named before, with ``=`` where a value stands."""
    found: list[str] = []
    with suppress(Exception):
        from prensa.model import text as yaml

        path = _named(ctx, "case")
        tree, _ = yaml.read(path.read_text(encoding="utf-8"), path.name)
        head = incomplete.rpartition(".")[0]
        start = _below(tree.plain(), head.split(".") if head else [])
        found = [f"{head}.{name}" if head else name for name in _names(start)]
    return [name for name in found if name.startswith(incomplete)]


def _named(ctx: typer.Context, argument: str) -> Path:
    """The file or folder that stands before; an option without its value leaves it among the arguments not read."""
    given = ctx.params.get(argument) or next(word for word in ctx.args if not word.startswith("-"))
    return Path(str(given))


def _below(value: Any, parts: list[str]) -> Any:
    """The value at a path, entries of lists by name or number."""
    for part in parts:
        if isinstance(value, list):
            named = {str(v["name"]): v for v in value if isinstance(v, dict) and "name" in v}
            value = named[part] if part in named else value[int(part)]
        else:
            value = value[part]
    return value


def _names(value: Any) -> Iterator[str]:
    """Names directly below a value, with ``.`` where more follows and ``=`` where none does."""
    if isinstance(value, list):
        pairs = [(str(v["name"]) if isinstance(v, dict) and "name" in v else str(k), v) for k, v in enumerate(value)]
    else:
        pairs = list(value.items()) if isinstance(value, dict) else []
    for name, below in pairs:
        deeper = isinstance(below, dict) or (isinstance(below, list) and any(isinstance(v, dict) for v in below))
        yield f"{name}{'.' if deeper else '='}"
