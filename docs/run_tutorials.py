"""Run the notebooks of docs/tutorials and keep what they show: ``python docs/run_tutorials.py``."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

TUTORIALS = Path(__file__).parent / "tutorials"


def executed(path: Path, folder: Path) -> Any:
    """The notebook at *path*, run from top to bottom in *folder* by the Python that runs this; raises where a cell fails."""
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(notebook, timeout=120, kernel_name="python3", resources={"metadata": {"path": str(folder)}})
    client.execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # times of the day
    return notebook


if __name__ == "__main__":
    import nbformat

    os.environ.setdefault("OMP_NUM_THREADS", "1")
    for path in sorted(TUTORIALS.glob("*.ipynb")):
        with tempfile.TemporaryDirectory() as folder:
            nbformat.write(executed(path, Path(folder)), path)
        print(f"{path.name} run")
