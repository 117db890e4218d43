"""A package in a read-only place, without a folder for caches, compiles its kernels and works."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import prensa

USE = """
import numpy as np
from prensa.kernels import emit
from prensa.kernels.compiled import njit

@njit(cache=True)
def twice(x):
    return 2 * x

assert twice(3.0) == 6.0
print(emit.__file__)
"""


@pytest.mark.skipif(os.name != "posix" or not hasattr(os, "geteuid"), reason="the rights of folders are those of POSIX")
def test_kernels_do_without_a_cache(tmp_path):
    """Neither the package's folder nor the user's can be written, by root neither: the modules of kernels are imported."""
    package = tmp_path / "lib" / "prensa"
    shutil.copytree(
        Path(prensa.__file__).parent / "kernels", package / "kernels", ignore=shutil.ignore_patterns("__pycache__")
    )
    (package / "__init__.py").touch()
    nowhere = tmp_path / "file"
    nowhere.touch()
    for folder in (package, package / "kernels"):
        (folder / "__pycache__").touch()  # no folder of that name can be made, whoever asks
    # numba looks for a place beside the source and in the user's folder
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA_", "XDG_", "HOME", "PYTHON"))}
    environment |= {"HOME": str(nowhere), "XDG_CACHE_HOME": str(nowhere), "PYTHONPATH": str(tmp_path / "lib")}
    script = tmp_path / "lib" / "use.py"
    script.write_text(USE)
    (tmp_path / "lib" / "__pycache__").touch()
    done = subprocess.run(
        [sys.executable, "-B", str(script)], capture_output=True, text=True, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    assert str(package) in done.stdout
