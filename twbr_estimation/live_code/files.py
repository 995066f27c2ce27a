"""Files of machine code: where they lie, and for what sources, library and processor they are.

A file holds the name of the function, the object code and a digest. One that is damaged, or made
of other sources, by another numba or for another processor, is not used.
"""

from __future__ import annotations

import hashlib
import os
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

SOURCES = (
    "samples.py",
    "compilation.py",
    "pipeline/calibrated.py",
    "pipeline/coefficients.py",
    "pipeline/correction.py",
    "pipeline/saturation.py",
    "pipeline/unseen.py",
    "pipeline/validity.py",
    "plants/*.py",
    "filters/**/*.py",
    "live_code/layout.py",
    "live_code/steps.py",
)
"""What the compiled steps are made of."""
_DIGEST_SIZE = 32


class ObjectCode(NamedTuple):
    """One compiled step."""

    function: str
    """Its name in the object file."""
    code: bytes


def folders() -> tuple[Path, ...]:
    """Return where files may lie: in the package, else in the user's cache."""
    found = [Path(__file__).parent / "__pycache__"]
    cache_home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    if os.path.isabs(cache_home):
        found.append(Path(cache_home) / "twbr_estimation")
    return tuple(found)


@cache
def made_for(processor: str) -> str:
    """Return a digest of the sources, the libraries and the processor; empty without numba."""
    # A node that has nothing to load starts without it.
    from importlib.metadata import PackageNotFoundError, version

    try:
        libraries = [f"{name} {version(name)}" for name in ("numba", "llvmlite")]
    except PackageNotFoundError:
        return ""
    about = " ".join((*libraries, sys.implementation.cache_tag, processor))
    digest = hashlib.sha256(about.encode())
    package = Path(__file__).parent.parent
    for path in sorted(path for pattern in SOURCES for path in package.glob(pattern)):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def saved(name: str, made: str, code: ObjectCode) -> Path | None:
    """Keep a step in the first folder that can be written; None where there is none.

    Files of the same step that are made for something else are deleted.
    """
    body = code.function.encode() + b"\n" + code.code
    for folder in folders():
        path = folder / f"{name}.{made}.step"
        partial = path.with_suffix(f".{os.getpid()}")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            partial.write_bytes(_digest(path.name, body) + body)
            partial.replace(path)
            for other in folder.glob(f"{name}.*.step"):
                if other != path:
                    other.unlink(missing_ok=True)
        except OSError:
            partial.unlink(missing_ok=True)
            continue
        return path
    return None


def exists(name: str) -> bool:
    """Return whether a step was ever kept, for whatever sources; quick."""
    return any(any(folder.glob(f"{name}.*.step")) for folder in folders())


def kept(name: str, made: str) -> ObjectCode | None:
    """Return a step that is kept; None where there is none that is sound."""
    for folder in folders():
        path = folder / f"{name}.{made}.step"
        try:
            content = path.read_bytes()
        except OSError:
            continue
        body = content[_DIGEST_SIZE:]
        if content[:_DIGEST_SIZE] == _digest(path.name, body):
            function, _, code = body.partition(b"\n")
            return ObjectCode(function.decode(), code)
    return None


def _digest(name: str, body: bytes) -> bytes:
    return hashlib.sha256(name.encode() + b"\0" + body).digest()
