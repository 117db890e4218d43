"""What ``prensa run CASE`` does until its first Newton iteration has been reported; then it stops."""

from __future__ import annotations

import sys
from pathlib import Path

import prensa as pr
from prensa.solver.increment import Progress


class Reported(Exception):
    """The first iteration is there."""


def main() -> None:
    import prensa.cli  # noqa: F401  (the command imports it)

    def monitor(sign: Progress) -> None:
        if sign.event == "iteration":
            raise Reported

    try:
        for _ in pr.solve(pr.load(Path(sys.argv[1])).problem, monitor=monitor):
            pass
    except Reported:
        print("first iteration")


if __name__ == "__main__":
    main()
