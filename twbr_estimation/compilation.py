"""Compilation of loops around step functions; the only module that imports numba.

Compiled code is cached on disk. A change of any source file that a loop is made of makes a
new entry in place of the old one.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any


@contextmanager
def _without(*packages: str) -> Iterator[None]:
    """Keep packages that are not loaded yet from being imported for a while."""
    absent = [name for name in packages if name not in sys.modules]
    sys.modules.update(dict.fromkeys(absent))  # type: ignore[arg-type]
    try:
        yield
    finally:
        for name in absent:
            del sys.modules[name]


# Numba looks for both; neither serves our loops, and they take as long as numba itself.
with _without("coverage", "scipy.linalg.cython_blas"):
    import numba
    import numba.np.arraymath
    from llvmlite.binding import get_host_cpu_name
    from numba.extending import overload

NOT_COMPILABLE = (numba.core.errors.NumbaError,)
"""What a loop raises at its first call where the functions in it cannot be compiled."""


def compiled(
    run: Callable[..., Any],
    version: str | None,
    *called: Callable[..., Any],
    name: str | None = None,
) -> Any:
    """Compile the loop `run`.

    Args:
        run: a closure over the plain functions it calls.
        version: `source_version(...)` of everything the loop is made of; None keeps it out of
            the cache on disk.
        called: those functions; what they call in turn is found by itself.
        name: of its files in the cache; by default that of the function.

    Returns:
        The compiled loop, which takes the same arguments.
    """
    for function in called:
        _let_compile(function)
    if version is None:
        return numba.njit(nogil=True, error_model="numpy")(run)
    # The cache's index is a file named after the function. It names classes of the package, so
    # one that older sources wrote must never be read: it may name what is gone.
    name = name or run.__qualname__
    run.__qualname__ = f"{name}.{version}"
    try:
        loop = numba.njit(cache=True, nogil=True, error_model="numpy")(run)
    except RuntimeError:  # neither the package's folder nor the user's cache can be written
        return numba.njit(error_model="numpy")(run)
    if folder := loop.stats.cache_path:
        _delete_others(Path(folder), _file_prefix(run, name), version)
    return loop


def is_ready(loop: Any) -> bool:
    """Return whether a loop is compiled in memory, or in the cache on disk."""
    if loop.signatures:
        return True
    name, dot, version = loop.py_func.__qualname__.rpartition(".")
    folder = loop.stats.cache_path
    if not folder or not dot:
        return False
    return any(Path(folder).glob(f"{_file_prefix(loop.py_func, name)}{version}-*.nbi"))


def _file_prefix(run: Callable[..., Any], name: str) -> str:
    """Return how numba begins the names of a loop's files in the cache, up to the version."""
    plain = name.replace("<", "").replace(">", "")
    return f"{run.__module__.rpartition('.')[2]}.{plain}."


def _delete_others(folder: Path, prefix: str, version: str) -> None:
    """Delete what other versions of a loop left in the cache."""
    with suppress(OSError):
        for file in folder.glob(f"{prefix}*.nb[ci]"):
            if not file.name.startswith(f"{prefix}{version}-"):
                file.unlink(missing_ok=True)


_COMPILABLE: set[FunctionType] = set()


def _let_compile(function: Any) -> None:
    """Allow compiled code to call `function` and the plain functions it calls in turn.

    A function marked with `filters.base.compiled_as` is compiled in its other spelling.
    """
    if function in _COMPILABLE:
        return
    _COMPILABLE.add(function)
    spelled = getattr(function, "compiled_as", function)
    called_by_name = (spelled.__globals__.get(name) for name in spelled.__code__.co_names)
    enclosed = (cell.cell_contents for cell in spelled.__closure__ or ())
    for called in (*called_by_name, *enclosed):
        if isinstance(called, FunctionType):
            _let_compile(called)

    @overload(function, jit_options={"error_model": "numpy"}, strict=False)
    def _(*arguments: Any) -> Any:
        del arguments
        return spelled


@cache
def source_version(patterns: tuple[str, ...]) -> str:
    """Return a digest of the package's sources that match the patterns, numba and processor.

    The disk cache sees only changes of the loop's own file; with this digest in its name it
    sees changes of the step functions, too.
    """
    package = Path(__file__).parent
    digest = hashlib.sha256(f"{numba.__version__} {get_host_cpu_name()}".encode())
    for path in sorted(path for pattern in patterns for path in package.glob(pattern)):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
