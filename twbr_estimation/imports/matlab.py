"""Variables of MATLAB files, within limits and of the shape that a format needs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..disk.reading import open_regular
from ..errors import RecordingError
from ..recording import FloatArray

ELEMENT_LIMIT = 1 << 25
"""Most numbers in a variable; a compressed one may claim far more."""


def matlab_variables(path: Path, names: tuple[str, ...]) -> dict[str, FloatArray]:
    """Return variables of a MATLAB file (before version 7.3) as arrays of floats.

    Numbers stay numbers; all others have the same first dimension.

    Raises:
        RecordingError: not such a file, or a variable that is missing, too large, no numbers, or
            of another length than the others.
    """
    from scipy.io import loadmat, whosmat

    with open_regular(path, RecordingError) as file:
        try:
            sizes = {name: shape for name, shape, _ in whosmat(file)}
        except Exception as error:  # damage makes the reader fail in any way
            raise RecordingError(f"{path}: not a MATLAB file: {_reason(error)}") from error
        if missing := [name for name in names if name not in sizes]:
            raise RecordingError(f"{path}: has no variable {', '.join(missing)}")
        for name in names:
            _require_small(path, name, sizes[name])
        file.seek(0)
        try:
            content = loadmat(file, squeeze_me=True, variable_names=list(names))
        except Exception as error:  # neither are the failures of decompression documented
            raise RecordingError(f"{path}: not a MATLAB file: {_reason(error)}") from error
    found = {name: _numbers(path, name, content.get(name)) for name in names}
    _require_equal_lengths(path, found)
    return found


def number_of(path: Path, name: str, value: FloatArray) -> float:
    """Return a variable that must be one number.

    Raises:
        RecordingError: it is not one.
    """
    if value.size != 1 or not np.isfinite(value).all():
        raise RecordingError(f"{path}: {name} is not one finite number")
    return float(value.reshape(-1)[0])


def _require_small(path: Path, name: str, shape: tuple[int, ...]) -> None:
    size = 1
    for length in shape:
        size *= int(length)
    if not 0 <= size <= ELEMENT_LIMIT:
        raise RecordingError(f"{path}: {name} has {size} numbers; the limit is {ELEMENT_LIMIT}")


def _numbers(path: Path, name: str, value: Any) -> FloatArray:
    array = np.asarray(value)
    if array.dtype.kind not in "biuf":
        raise RecordingError(f"{path}: {name} holds no real numbers")
    return np.asarray(array, dtype=np.float64)


def _require_equal_lengths(path: Path, found: dict[str, FloatArray]) -> None:
    lengths = {name: values.shape[0] for name, values in found.items() if values.ndim}
    if len(set(lengths.values())) > 1 or any(length < 2 for length in lengths.values()):
        listed = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise RecordingError(f"{path}: the variables must have one length above 1: {listed}")


def _reason(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"[:200] if str(error) else type(error).__name__
