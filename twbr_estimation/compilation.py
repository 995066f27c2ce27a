"""Compilation of loops around step functions; the only module that imports numba.

Compiled code is cached on disk. A change of any source file that a loop is made of makes a
new entry in place of the old one.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
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
    from numba.core.caching import IndexDataCacheFile
    from numba.extending import overload

_DIGEST_SIZE = 32
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
    cache = getattr(loop, "_cache")  # noqa: B009  (numba's type leaves it out)
    cache._cache_file = _CheckedFiles.like(cache._cache_file)
    if folder := loop.stats.cache_path:
        _delete_others(Path(folder), _file_prefix(run, name), version)
    return loop


_Files: Any = IndexDataCacheFile  # its methods have no types


class _CheckedFiles(_Files):  # type: ignore[misc]
    """Files of the cache that end in a digest of their name and content.

    Machine code with a wrong bit runs, and gives wrong figures or none. What is damaged, or comes
    from elsewhere, is thrown away; the loop is then compiled again.
    """

    @classmethod
    def like(cls, files: Any) -> _CheckedFiles:
        """Return such files in place of those that numba made for a loop."""
        base = files._index_name.removesuffix(".nbi")
        return cls(files._cache_path, base, files._source_stamp)

    def load(self, key: Any) -> Any:
        """Return a compiled loop; None without a sound one."""
        try:
            return super().load(key)
        except Exception:  # of a foreign pickle anything may be raised
            self._throw_away()
            return None

    def save(self, key: Any, data: Any) -> None:
        """Keep a compiled loop; without room for it, it serves from memory."""
        try:
            super().save(key, data)
        except Exception:
            self._throw_away()
            with suppress(Exception):
                super().save(key, data)

    def _throw_away(self) -> None:
        folder, base = Path(self._cache_path), self._index_name.removesuffix(".nbi")
        with suppress(OSError):
            for path in folder.iterdir():
                if path.name.startswith(f"{base}.") and path.suffix in (".nbi", ".nbc"):
                    shutil.rmtree(path) if path.is_dir() else path.unlink()

    def _load_index(self) -> dict[Any, str]:
        path = Path(self._index_path)
        if not os.path.lexists(path):
            return {}
        version, stamp, overloads = pickle.loads(_checked(path))
        fresh = version == self._version and stamp == self._source_stamp
        return overloads if fresh else {}

    def _save_index(self, overloads: dict[Any, str]) -> None:
        self._write(self._index_path, (self._version, self._source_stamp, overloads))

    def _load_data(self, name: str) -> Any:
        return pickle.loads(_checked(Path(self._data_path(name))))

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), data)

    def _write(self, path: str, content: Any) -> None:
        body = self._dump(content)
        with self._open_for_write(path) as file:
            file.write(body + _digest(Path(path).name, body))


def _checked(path: Path) -> bytes:
    content = path.read_bytes()
    body, digest = content[:-_DIGEST_SIZE], content[-_DIGEST_SIZE:]
    if digest != _digest(path.name, body):
        raise ValueError(f"{path}: not what was written there")
    return body


def _digest(name: str, body: bytes) -> bytes:
    return hashlib.sha256(name.encode() + b"\0" + body).digest()


def object_code(
    run: Callable[..., None],
    shapes: Mapping[str, str],
    counts: Sequence[str] = (),
) -> tuple[bytes, str]:
    """Compile a function of arrays to an object file that needs no numba to be loaded.

    Args:
        run: takes whole numbers, then arrays of doubles, and changes what these hold.
        shapes: of each array, by its name; written as Python, and may use the counts.
        counts: names of the whole numbers.

    Returns:
        The object file, and the name of a function in it that takes the counts and a pointer to
        each array.
    """
    _let_compile(run)
    arrays = [f"carray({name}, ({shape},))" for name, shape in shapes.items()]
    compiler: Any = numba  # its types leave out what is needed here
    space: dict[str, Any] = {"__name__": __name__, "run": run, "carray": compiler.carray}
    exec(
        f"def entry({', '.join((*counts, *shapes))}):\n    run({', '.join((*counts, *arrays))})",
        space,
    )
    types = compiler.types
    pointers = (types.CPointer(types.float64) for _ in shapes)
    signature = types.void(*(types.int64 for _ in counts), *pointers)
    function = compiler.cfunc(signature, error_model="numpy")(space["entry"])
    return function._library.serialize_using_object_code()[2][0], function._wrapper_name


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
    """Allow compiled code to use `function`, and what it calls in turn.

    Its code stands in place of its calls: a call copies arguments and result, which for a large
    record costs as much as what is computed of it. A function marked with
    `filters.base.compiled_as` is called, in its other spelling.
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

    options: Any = {"error_model": "numpy", "forceinline": spelled is function}

    @overload(function, jit_options=options, strict=False)
    def _(*arguments: Any) -> Any:
        del arguments
        return spelled


@cache
def source_version(patterns: tuple[str, ...]) -> str:
    """Return a digest of the package's sources that match the patterns, numba and processor.

    The disk cache notices only changes of the loop's own file; with this digest in its name it
    notices changes of the step functions, too.
    """
    package = Path(__file__).parent
    digest = hashlib.sha256(f"{numba.__version__} {get_host_cpu_name()}".encode())
    for path in sorted(path for pattern in patterns for path in package.glob(pattern)):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
