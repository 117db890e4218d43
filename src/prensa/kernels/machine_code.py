"""Machine code of a `Program`: compiled by LLVM, kept on the disk, called with arrays.

Machine code is found again, by this process and by others, under a key of all that is computed, of the generator and of the
processor.
"""

from __future__ import annotations

import hashlib
import os
import threading
from collections.abc import Callable
from ctypes import CFUNCTYPE, POINTER, Structure, c_char, c_int64
from functools import cache, wraps
from pathlib import Path
from typing import Any, ClassVar

import llvmlite
import llvmlite.binding as llvm
import numpy as np
from numpy.typing import NDArray

from prensa.kernels.emit import Program, demanded, described, instructions
from prensa.kernels.record import fresh
from prensa.kernels.uncollected import uncollected

listeners: list[Callable[[], None]] = []
"""Called before a kernel is compiled that was not found on the disk."""
compiled = 0
"""Kernels that this process has compiled."""
_lock = threading.RLock()
_alive: list[Any] = []
"""What machine code lives in."""


@cache
def _target() -> Any:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_default_triple()


@cache
def _machine() -> Any:
    features = llvm.get_host_cpu_features().flatten()
    return _target().create_target_machine(
        llvm.get_host_cpu_name(), features, opt=2, reloc="static", codemodel="jitdefault", jit=True
    )


@cache
def _generator() -> bytes:
    """What the same graph might become other code by: this package's own source, LLVM, the processor."""
    h = hashlib.sha256()
    here = Path(__file__).parent
    # Point functions themselves (algebra, laws, elements) are in the graph, which is hashed with it.
    for name in ("emit.py", "machine_code.py", "differentiate.py", "record.py", "lanes.py"):
        h.update((here / name).read_bytes())
    version = ".".join(map(str, llvm.llvm_version_info))
    h.update(f"{llvmlite.__version__} {version} {llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}".encode())
    return h.digest()


@cache
def folder() -> Path | None:
    """Where kernels are kept: as Numba's own, or else in the user's folder for such things; None where nothing can be written."""
    own = os.environ.get("NUMBA_CACHE_DIR")
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "prensa"
    for place in [Path(own) / "prensa_kernels"] if own else [Path(__file__).parent / "__pycache__", user]:
        try:
            place.mkdir(parents=True, exist_ok=True)
            probe = place / f".{os.getpid()}"
            probe.write_bytes(b"")
            probe.unlink()
        except OSError:
            continue
        return place
    return None


def _key(program: Program) -> str:
    outputs = [*program.sums, *(x.node for x in program.puts)]
    nodes = demanded(outputs)
    numbers = {n: k for k, n in enumerate(nodes)}
    h = hashlib.sha256(_generator())
    for n in nodes:
        h.update(f"{described(n, numbers)}\n".encode())
    h.update(f"{list(program.arrays.items())} {program.points} {[numbers[o] for o in outputs]}".encode())
    h.update(f"{[(x.array, x.column) for x in program.puts]}".encode())
    return h.hexdigest()[:40]


def _read_code(path: Path) -> bytes | None:
    """Machine code from the disk; None where it is not there, or not whole."""
    try:
        whole = path.read_bytes()
    except OSError:
        return None
    return whole[32:] if hashlib.sha256(whole[32:]).digest() == whole[:32] else None


def _write_code(path: Path, code: bytes) -> None:
    own = path.with_suffix(f".{os.getpid()}.{threading.get_ident()}")
    try:
        # Under a name of its own, then in one move: other processes see whole code or none.
        own.write_bytes(hashlib.sha256(code).digest() + code)
        own.replace(path)
    except OSError:
        own.unlink(missing_ok=True)


def _compile(program: Program, name: str) -> bytes:
    global compiled
    for say in listeners:
        say()
    compiled += 1
    module = llvm.parse_assembly(instructions(program, name))
    module.triple, module.data_layout = _machine().triple, str(_machine().target_data)
    return bytes(_machine().emit_object(module))


def _load_code(code: bytes, name: str) -> int:
    """The address of a function in machine code."""
    machine = _machine_of_engine()
    # An engine wants a module; the code comes as an object file.
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    _alive.append(engine)
    return int(engine.get_function_address(name))


def _machine_of_engine() -> Any:
    """A machine of its own: an engine takes it over."""
    return _target().create_target_machine(opt=0, reloc="static", codemodel="jitdefault", jit=True)


class _Header(Structure):
    """Of an array, as NumPy's interface for C has it."""

    _fields_: ClassVar = [
        ("object", c_char * object.__basicsize__), ("data", c_int64), ("dimensions", c_int64), ("shape", POINTER(c_int64)),
        ("strides", POINTER(c_int64)),
    ]  # fmt: skip


@cache
def _headers_are_known() -> None:
    """Raise RuntimeError where arrays have other headers than machine code reads."""
    a = np.zeros((3, 5))[:, 1:]
    found = _Header.from_address(id(a))
    if (found.data, found.shape[0], found.strides[0]) != (a.__array_interface__["data"][0], 3, 40):
        raise RuntimeError("arrays of this version of NumPy are laid out otherwise than generated kernels read them")


class Kernel:
    """Machine code of a program, called with the number of rows and its arrays in their order.

    Arrays are of double precision (flags: bool), any distance between rows, each row without gaps. Other threads run meanwhile.
    Machine code looks for data, shape and strides in the header of an array itself (`PyArrayObject_fields` of NumPy's interface
    for C): to ask each array for them in Python takes longer than a hundred elements.
    """

    def __init__(self, program: Program) -> None:
        _headers_are_known()
        name = f"kernel_{_key(program)}"
        with _lock:
            place = folder()
            path = None if place is None else place / f"{name}.bin"
            code = None if path is None else _read_code(path)
            if code is None:
                code = _compile(program, name)
                if path is not None:
                    _write_code(path, code)
            self._headers = c_int64 * len(program.arrays)
            self._function = CFUNCTYPE(None, c_int64, POINTER(c_int64))(_load_code(code, name))

    def __call__(self, count: int, *arrays: NDArray[Any]) -> None:
        """Read and write ``count`` rows."""
        self._function(count, self._headers(*map(id, arrays)))


def generated(build: Callable[..., Program]) -> Callable[..., Kernel]:
    """What records a program, as what gives its kernel: made once for each set of arguments, by one thread at a time."""
    found: dict[tuple[Any, ...], Kernel] = {}

    # `cache` answers for what is known without a call in Python, but lets several threads make what is not
    @cache
    @wraps(build)
    def kernel(*args: Any) -> Kernel:
        with _lock:
            if args not in found:
                fresh()
                with uncollected():
                    found[args] = Kernel(build(*args))
            return found[args]

    return kernel
