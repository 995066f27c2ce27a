"""Compilation of loops around step functions; the only module that imports numba.

Compiled code is cached on disk. A change of any source file that a loop is made of makes a
new entry.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
from numba.extending import overload


def compiled(run: Callable[..., Any], version: str, *called: Callable[..., Any]) -> Any:
    """Compile the loop `run`.

    Args:
        run: a closure over the plain functions it calls.
        version: `source_version(...)` of everything the loop is made of.
        called: those functions; what they call in turn is found by itself.

    Returns:
        The compiled loop, which takes the same arguments.
    """
    for function in called:
        _let_compile(function)
    # The cache's index is a file named after the function. It names classes of the package, so
    # one that older sources wrote must never be read: it may name what is gone.
    run.__qualname__ = f"{run.__qualname__}.{version}"
    try:
        return numba.njit(cache=True, nogil=True, error_model="numpy")(run)
    except RuntimeError:  # neither the package's folder nor the user's cache can be written
        return numba.njit(error_model="numpy")(run)


_COMPILABLE: set[FunctionType] = set()


def _let_compile(function: Any) -> None:
    """Allow compiled code to call `function` and the plain functions it calls in turn.

    A function marked with `filters.base.compiled_as` is compiled in its other spelling.
    """
    if function in _COMPILABLE:
        return
    _COMPILABLE.add(function)
    spelled = getattr(function, "compiled_as", function)
    for name in spelled.__code__.co_names:
        called = spelled.__globals__.get(name)
        if isinstance(called, FunctionType):
            _let_compile(called)

    @overload(function, jit_options={"error_model": "numpy"}, strict=False)
    def _(*arguments: Any) -> Any:
        del arguments
        return spelled


@cache
def source_version(patterns: tuple[str, ...]) -> str:
    """Return a digest of the package's sources that match the patterns.

    The disk cache sees only changes of the loop's own file; with this digest in its name it
    sees changes of the step functions, too.
    """
    package = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted(path for pattern in patterns for path in package.glob(pattern)):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
