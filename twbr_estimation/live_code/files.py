"""Files of machine code: where they lie, and for what sources, library and processor they are.

A file holds the name of the function, the object code and a digest. One that is damaged, or made
of other sources, by another numba or for another processor, is not used; neither is one that
another user may have written. `NUMBA_CACHE_DIR` names another folder for them.
"""

import hashlib
import importlib.util
import os
import stat
import sys
from contextlib import suppress
from functools import cache
from itertools import starmap
from pathlib import Path
from typing import NamedTuple

from ..errors import WritingError

SOURCES = (
    "samples.py",
    "compilation.py",
    "pipeline/calibrated.py",
    "pipeline/coefficients.py",
    "pipeline/correction.py",
    "pipeline/resting.py",
    "pipeline/saturation.py",
    "pipeline/spinning.py",
    "pipeline/unseen.py",
    "pipeline/validity.py",
    "plants/*.py",
    "filters/**/*.py",
    "live_code/layout.py",
    "live_code/steps.py",
)
"""What the compiled steps are made of."""
STEP = "step"
"""Ending of the files of steps."""
CORRECTION = "correction"
"""Name of the correction's step among those of the filters."""
_DIGEST_SIZE = 32
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


class ObjectCode(NamedTuple):
    """One compiled function."""

    function: str
    """Its name in the object file."""
    code: bytes


def folders() -> tuple[Path, ...]:
    """Return where files may lie: in the package, else in the user's cache."""
    if own := os.environ.get("NUMBA_CACHE_DIR"):
        return (Path(own),)
    found = [Path(__file__).parent / "__pycache__"]
    cache_home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    if os.path.isabs(cache_home):
        found.append(Path(cache_home) / "twbr_estimation")
    return tuple(found)


@cache
def made_for(processor: str, sources: tuple[str, ...] = SOURCES) -> str:
    """Return a digest of the sources, the libraries and the processor; empty without numba."""
    digest = hashlib.sha256(f"{sys.implementation.cache_tag} {processor}".encode())
    for name in ("numba", "llvmlite"):
        package = importlib.util.find_spec(name)
        if package is None or package.origin is None:
            return ""
        try:
            digest.update(Path(package.origin).with_name("_version.py").read_bytes())
        except OSError:
            return ""
    package_folder = Path(__file__).parent.parent
    for path in sorted(path for pattern in sources for path in package_folder.glob(pattern)):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def refusal(path: Path, state: os.stat_result) -> str:
    """Return in one sentence why code at a path is not loaded; empty where it may be.

    Machine code does whatever its writer wants: only this user and root may be that.

    Args:
        path: A file or a folder.
        state: Its owner and permissions.
    """
    if state.st_uid not in (0, os.geteuid()):
        return f"machine code in {path} is not loaded: its owner is user {state.st_uid}"
    if state.st_mode & _OTHERS_WRITE:
        return f"machine code in {path} is not loaded: others can write to it; chmod go-w {path}"
    return ""


def refused(name: str) -> str:
    """Return why a step that was kept is not loaded, from whatever folder; empty without reason."""
    for folder in folders():
        for path in folder.glob(f"{name}.*.step"):
            for each in (folder, path):
                if why := refusal(each, each.stat()):
                    return why
    return ""


def saved(name: str, made: str, code: ObjectCode, ending: str = STEP) -> Path | None:
    """Keep a function in the first folder that can be written; None where there is none.

    Files of the same function that are made for something else are deleted.
    """
    body = code.function.encode() + b"\n" + code.code
    for folder in folders():
        path = folder / f"{name}.{made}.{ending}"
        try:
            folder.mkdir(mode=0o755, parents=True, exist_ok=True)
            if refusal(folder, folder.stat()):
                continue
            _write(path, _digest(path.name, body) + body)
            for other in folder.glob(f"{name}.*.{ending}"):
                if not other.name.startswith(f"{name}.{made.partition('-')[0]}"):
                    other.unlink(missing_ok=True)
        except (OSError, WritingError):
            continue
        return path
    return None


def _write(path: Path, content: bytes) -> None:
    """Write a file whole or not at all, for its owner to write and for all to read."""
    from ..disk.writing import whole_file  # a node that only reads starts without it

    with whole_file(path, len(content)) as temporary:
        temporary.write_bytes(content)
        temporary.chmod(0o644)


def kept_names(ending: str = STEP) -> frozenset[str]:
    """Return the names of the functions that were ever kept, for whatever sources; quick."""
    found: set[str] = set()
    for folder in folders():
        with suppress(OSError):
            files = (name for name in os.listdir(folder) if name.endswith(f".{ending}"))
            found.update(name.partition(".")[0] for name in files)
    return frozenset(found)


def kept(name: str, made: str, ending: str = STEP) -> ObjectCode | None:
    """Return a function that is kept; None without a sound one."""
    for folder in folders():
        path = folder / f"{name}.{made}.{ending}"
        try:
            with path.open("rb") as file:
                states = (folder, folder.stat()), (path, os.fstat(file.fileno()))
                content = b"" if any(starmap(refusal, states)) else file.read()
        except OSError:
            continue
        body = content[_DIGEST_SIZE:]
        if content[:_DIGEST_SIZE] == _digest(path.name, body):
            function, _, code = body.partition(b"\n")
            return ObjectCode(function.decode(), code)
    return None


def _digest(name: str, body: bytes) -> bytes:
    return hashlib.sha256(name.encode() + b"\0" + body).digest()
