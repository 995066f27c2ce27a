"""Map compiled steps into this process: needs llvmlite and two libraries of numba's, not numba.

Importing numba takes a Raspberry Pi several seconds and a hundred megabytes; what its machine code
calls lies in two small libraries that can be loaded without it.
"""

from __future__ import annotations

import ctypes
import importlib.util
import os
from collections.abc import Callable
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader
from pathlib import Path
from types import ModuleType
from typing import Any, cast

from . import files

Function = Callable[..., None]
"""Takes the addresses of the rows of a step."""
_STEP = ctypes.PYFUNCTYPE(None, *(ctypes.c_void_p,) * 4)
_SUPPORT = (("_helperlib", "numba_"), ("core/runtime/_nrt_python", "NRT_"))
"""Libraries, and how the names of their functions begin in machine code."""


def loaded(name: str) -> Function | None:
    """Return the compiled step of that name; None where it has not been prepared for this computer.

    It may be called from any thread, once for each step.
    """
    if name not in files.kept_names():
        return None
    try:
        made = files.made_for(processor())
        found = files.kept(name, made) if made else None
        return None if found is None else function_of(found, _STEP)
    except (ImportError, OSError, RuntimeError, AttributeError):
        return None  # llvmlite or numba are not there, or of another form


@cache
def function_of(found: files.ObjectCode, kind: Any) -> Function:
    """Return the function in an object file, which is loaded at the first call only.

    Args:
        found: the object file.
        kind: what ctypes is to make of the function's address.

    Raises:
        ImportError: llvmlite or a library of numba's is missing.
    """
    import llvmlite.binding as llvm

    engine = _engine()
    engine.add_object_file(llvm.ObjectFileRef.from_data(found.code))
    engine.finalize_object()
    address = engine.get_function_address(found.function)
    return cast("Function", kind(address))


@cache
def processor() -> str:
    """Return the processor that code is made for, with what it can do.

    That is this computer's, or the one that `NUMBA_CPU_NAME` and `NUMBA_CPU_FEATURES` name: numba
    compiles for it.

    Raises:
        ImportError: llvmlite is not installed.
    """
    import llvmlite.binding as llvm

    name = os.environ.get("NUMBA_CPU_NAME") or llvm.get_host_cpu_name()
    features = os.environ.get("NUMBA_CPU_FEATURES")
    if features is None:
        features = "" if name == "generic" else llvm.get_host_cpu_features().flatten()
    return f"{llvm.get_default_triple()} {name} {features}"


def _engine() -> Any:
    """Return a new place for machine code; it lasts as long as the process."""
    import llvmlite.binding as llvm

    _prepare()
    machine = llvm.Target.from_default_triple().create_target_machine()
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    _engines.append(engine)
    return engine


_engines: list[Any] = []


@cache
def _prepare() -> None:
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    for library, prefix in _SUPPORT:
        for name, address in _library(library).c_helpers.items():
            llvm.add_symbol(name if name.startswith("_") else prefix + name, address)


def _library(place: str) -> ModuleType:
    """Return a library of numba's, loaded by itself.

    Raises:
        ImportError: there is none.
    """
    package = importlib.util.find_spec("numba")
    folder = Path(package.origin).parent if package and package.origin else None
    if folder is None:
        raise ImportError("numba is not installed")
    name = place.rpartition("/")[2]
    for suffix in EXTENSION_SUFFIXES:
        path = folder / f"{place}{suffix}"
        if path.exists():
            loader = ExtensionFileLoader(name, str(path))
            spec = importlib.util.spec_from_file_location(name, path, loader=loader)
            assert spec is not None
            module = importlib.util.module_from_spec(spec)
            loader.exec_module(module)
            return module
    raise ImportError(f"{folder / place}: no such library")
