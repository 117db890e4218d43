"""Value of each special mechanism of the solver: ``python -m prensa_bench.panel``.

    python -m prensa_bench.panel                          # everything on, and each mechanism off, over all problems: many hours
    python -m prensa_bench.panel --off edge_step          # that one
    python -m prensa_bench.panel --off edge_step,cycling  # both at once
    python -m prensa_bench.panel --only gallery           # problems of a group, or --problems "upsetting 0.1,rolls 2"
    python -m prensa_bench.panel --repeat 5               # processor time is the least of five runs
    python -m prensa_bench.panel --guard stability        # the test of a guard without it: it has to fail
    python -m prensa_bench.panel --table                  # print what was measured; --write: into MECHANISMS.md as well

Every run is a line of a file (``--file``, results/panel.jsonl) as soon as it has ended; what is there is not run again, unless
the source of the solver has changed. Runs are made in processes of their own, one at a time.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import prensa
from prensa_bench.panel import table
from prensa_bench.panel.mechanisms import GUARDS, MECHANISMS, SETS, TIMELY
from prensa_bench.panel.problems import GROUPS, problems
from prensa_bench.panel.running import RUN_CRASHED, Record

MOST_SECONDS = 300.0  # of processor time, of a run without a limit of its own …
LONGER = 5.0  # … and of one with something off, over that with everything on


def source() -> str:
    """What the solver's files are, in twelve digits: runs by other files are not compared."""
    total = hashlib.sha256()
    folder = Path(prensa.__file__).parent
    for path in sorted(folder.rglob("*.py")):
        total.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    return total.hexdigest()[:12]


class Store:
    """Records of runs in a file, those of one ``source`` of the solver."""

    def __init__(self, path: Path, source: str) -> None:
        self.path, self.source = path, source
        self.records: dict[tuple[str, tuple[str, ...]], Record] = {}
        for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
            found = json.loads(line)
            if found.pop("source") == source:
                self._put(Record(**found))

    def _put(self, record: Record) -> None:
        self.records[record.problem, tuple(record.off)] = record

    def add(self, record: Record) -> None:
        """Keep a record, in the file too; seconds of earlier runs of the same are among its own."""
        before = self.records.get((record.problem, tuple(record.off)))
        if before is not None:
            record.seconds = [*before.seconds, *record.seconds]
        self._put(record)
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"source": self.source, **asdict(record)}) + "\n")

    def missing(self, names: Sequence[str], off: Sequence[str], repeat: int) -> dict[str, int]:
        """Problems that are to be run, each so often."""
        have = {n: self.records.get((n, tuple(sorted(off)))) for n in names}
        left = {
            n: repeat - (len(r.seconds) if r is not None and r.status != "late" else repeat if r else 0)
            for n, r in have.items()
        }
        return {n: k for n, k in left.items() if k > 0}


def measure(store: Store, names: Sequence[str], off: Sequence[str], repeat: int) -> None:
    """Run problems that have not been run with some mechanisms off, in a process that goes on as long as it does not crash."""
    while left := store.missing(names, off, repeat):
        count = next(iter(left.values()))
        now = [n for n in left if left[n] == count]
        base = [store.records.get((n, ())) for n in now]
        longest = (
            max((min(r.seconds) * LONGER for r in base if r is not None), default=MOST_SECONDS) if off else MOST_SECONDS
        )
        asked = {
            "off": list(off),
            "problems": now,
            "repeat": count,
            "seconds": min(max(longest, 20.0), 2 * MOST_SECONDS),
        }
        env = os.environ | {"OMP_NUM_THREADS": "1"}
        command = [sys.executable, "-m", "prensa_bench.panel.running", json.dumps(asked)]
        done = set()
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=env
        ) as process:
            assert process.stdout is not None
            for line in process.stdout:
                record = Record(**json.loads(line))
                store.add(record)
                done.add(record.problem)
                show(record)
        for name in [n for n in now if n not in done][:1]:  # on which the process ended
            store.add(
                Record(
                    name,
                    sorted(off),
                    RUN_CRASHED,
                    f"the process ended with {process.returncode}",
                    seconds=[0.0] * repeat,
                )
            )


def show(record: Record) -> None:
    """A line on standard error."""
    off = ", ".join(record.off) or "everything on"
    what = f"{record.status} {record.reason}".strip()
    print(
        f"{record.problem}, {off}: {what} at {record.reached:.4g}, {record.increments} increments, "
        f"{record.iterations} iterations, {record.cuts} cuts, {min(record.seconds):.1f} s",
        file=sys.stderr, flush=True,
    )  # fmt: skip


def guard_holds(name: str) -> bool:
    """Whether the test of a guard fails without it."""
    env = os.environ | {"PRENSA_PANEL_OFF": name}
    how = ["-q", "-x", "-p", "no:cacheprovider", "-p", "prensa_bench.panel.in_tests"]
    command = [sys.executable, "-m", "pytest", *how, MECHANISMS[name].guard]
    return subprocess.run(command, env=env, check=False).returncode == 1


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    known = problems()
    parser = argparse.ArgumentParser(
        prog="python -m prensa_bench.panel", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--off", action="append", metavar="A,B", help="mechanisms that are off together; repeatable")
    parser.add_argument("--only", action="append", choices=GROUPS, help="problems of this group; repeatable")
    parser.add_argument("--problems", metavar="A,B", help="these problems")
    parser.add_argument("--repeat", type=int, default=1, help="runs of each, of whose times the least counts")
    parser.add_argument("--file", type=Path, default=Path("results") / "panel.jsonl", help="where runs are kept")
    parser.add_argument("--guard", metavar="NAME", help="run the test of a guard without it")
    parser.add_argument("--table", action="store_true", help="run nothing, print what was measured")
    parser.add_argument(
        "--write", action="store_true", help="renew the rows of quality/MECHANISMS.md that were measured"
    )
    a = parser.parse_args(arguments)
    if a.guard is not None:
        if a.guard not in {m.name for m in GUARDS}:
            parser.error(f"{a.guard!r} is no guard: {', '.join(m.name for m in GUARDS)}")
        return 0 if guard_holds(a.guard) else 1
    sets = [tuple(s.split(",")) for s in a.off] if a.off else [*((m.name,) for m in TIMELY), *SETS.values()]
    names = a.problems.split(",") if a.problems else [n for n, e in known.items() if not a.only or e.group in a.only]
    for what, given, may in (("mechanism", {m for s in sets for m in s}, MECHANISMS), ("problem", names, known)):
        if unknown := sorted(set(given) - set(may)):
            parser.error(f"unknown {what} {unknown[0]!r}; there are {', '.join(may)}")
    store = Store(a.file, source())
    if not a.table:
        for off in [(), *sets]:
            measure(store, names, off, a.repeat)
    groups = {g: [n for n in names if known[n].group == g] for g in GROUPS}
    measured = {", ".join(off): table.in_words(store.records, off, groups) for off in sets}
    for name, words in measured.items():
        print(f"{name} off: {words}")
    if a.write:
        seen = {name: words for name, words in measured.items() if words != "not measured"}
        table.KEPT_TABLE.write_text(table.renewed(table.KEPT_TABLE.read_text(encoding="utf-8"), seen), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
