"""Variables of MATLAB files, within limits and of the shape that a format needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..disk.reading import open_regular
from ..errors import RecordingError
from ..recording import FloatArray

ELEMENT_LIMIT = 1 << 25
"""Most numbers in a variable; a compressed one may claim far more."""
LARGEST = 1e6
"""No reading of a sensor is as large, in any unit."""
_LISTED = 20
_HDF5 = b"\x89HDF\r\n\x1a\n"
_VERSION_7_3 = b"MATLAB 7.3"
_CLASSES = {
    "cell": "a cell array; cell2mat makes numbers of it",
    "char": "text; datenum or str2double makes numbers of it",
    "struct": "a struct; save with '-struct' makes variables of its fields",
    "object": "an object; save its numbers as double",
    "opaque": "an object (datetime, table or string); save its numbers as double",
    "sparse": "a sparse matrix; full makes numbers of it",
    "function": "a function",
}
"""What a variable is that holds no numbers, and what makes numbers of it."""


def matlab_variables(path: Path, names: tuple[str, ...]) -> dict[str, FloatArray]:
    """Return variables of a MATLAB file (before version 7.3) as arrays of floats.

    Numbers stay numbers; all others have the same first dimension.

    Raises:
        RecordingError: not such a file, or a variable that is missing, too large, no numbers, or
            of another length than the others.
    """
    from scipy.io import loadmat

    with open_regular(path, RecordingError) as file:
        _require_readable(path, file)
        try:
            _require_variables(path, _listing(file), names)
            file.seek(0)
            content = loadmat(file, squeeze_me=True, variable_names=list(names))
        except RecordingError:
            raise
        except Exception as error:  # damage makes the reader fail in any way
            raise RecordingError(f"{path}: not a MATLAB file: {_reason(error)}") from error
    found = {name: _numbers(path, name, content.get(name)) for name in names}
    _require_equal_lengths(path, found)
    return found


def require_readings(path: Path, name: str, values: FloatArray) -> None:
    """Raise unless all values are finite and of a size that a sensor can have.

    Raises:
        RecordingError: they are not; the message names the first that is wrong.
    """
    wrong = ~(np.abs(values) <= LARGEST)
    if wrong.any():
        first = tuple(int(index[0]) for index in np.nonzero(wrong))
        raise RecordingError(
            f"{path}: {name} holds {int(wrong.sum())} values that are no readings, the first is "
            f"{values[first]:g} in row {first[0] + 1}"
        )


def number_of(path: Path, name: str, value: FloatArray) -> float:
    """Return a variable that must be one number.

    Raises:
        RecordingError: it is not one.
    """
    if value.size != 1 or not np.isfinite(value).all():
        raise RecordingError(f"{path}: {name} is not one finite number")
    return float(value.reshape(-1)[0])


def _require_readable(path: Path, file: BinaryIO) -> None:
    """Raise if the file is in the format 7.3, which is HDF5."""
    head = file.read(len(_VERSION_7_3))
    file.seek(0)
    if head == _VERSION_7_3 or head.startswith(_HDF5):
        raise RecordingError(
            f"{path}: a MATLAB file of version 7.3 (HDF5), which is not read; save it with "
            "save(..., '-v7')"
        )


def _listing(file: BinaryIO) -> dict[str, tuple[tuple[int, ...], str]]:
    """Return shape and class of each variable by name."""
    from scipy.io import whosmat

    return {name: (shape, kind) for name, shape, kind in whosmat(file)}


def _require_variables(
    path: Path, there: Mapping[str, tuple[tuple[int, ...], str]], names: Sequence[str]
) -> None:
    """Raise unless all `names` are variables that hold numbers, and not too many."""
    if missing := [name for name in names if name not in there]:
        listed = ", ".join(f"{name} ({kind})" for name, (_, kind) in list(there.items())[:_LISTED])
        raise RecordingError(
            f"{path}: has no variable {', '.join(missing)}; it has {listed or 'none'}; a "
            "file that was cut off has lost its last ones, and fields of a struct are none"
        )
    for name in names:
        shape, kind = there[name]
        if kind in _CLASSES:
            raise RecordingError(f"{path}: {name} is {_CLASSES[kind]}")
        _require_small(path, name, shape)


def _require_small(path: Path, name: str, shape: tuple[int, ...]) -> None:
    size = 1
    for length in shape:
        size *= int(length)
    if not 0 <= size <= ELEMENT_LIMIT:
        raise RecordingError(f"{path}: {name} has {size} numbers; the limit is {ELEMENT_LIMIT}")


def _numbers(path: Path, name: str, value: Any) -> FloatArray:
    array = np.asarray(value)
    if array.dtype.kind not in "biuf":
        what = "complex numbers" if array.dtype.kind == "c" else "no numbers"
        raise RecordingError(f"{path}: {name} holds {what}; real ones are needed")
    return np.asarray(array, dtype=np.float64)


def _require_equal_lengths(path: Path, found: dict[str, FloatArray]) -> None:
    lengths = {name: values.shape[0] for name, values in found.items() if values.ndim}
    if len(set(lengths.values())) > 1 or any(length < 2 for length in lengths.values()):
        longest = max(lengths.values())
        turned = [name for name, each in found.items() if each.shape[1:] == (longest,)]
        if turned and longest > 1:
            raise RecordingError(
                f"{path}: {', '.join(turned)}: a row for each axis; transpose them: a row for each "
                "sample is needed"
            )
        listed = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise RecordingError(f"{path}: the variables must have one length above 1: {listed}")


def _reason(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"[:200] if str(error) else type(error).__name__
