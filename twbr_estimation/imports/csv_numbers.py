"""Numbers as logs hold them: thousands apart, hexadecimal counters, signs of other fonts."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from ..recording import FloatArray

_GROUPED = re.compile(r"[+-]?\d{1,3}(?:([,'’ \u00a0\u2009\u202f])\d{3})(?:\1\d{3})*(?:\.\d*)?")
_GROUPED_BY_POINTS = re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+(?:,\d*)?")
_GROUPED_TWICE = re.compile(r"[+-]?\d{1,3}(?:,\d{3}){2,}")
_FORTRAN = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)[dD][+-]?\d+")
_HEXADECIMAL = re.compile(r"[+-]?0[xX][0-9a-fA-F]+")
_DIGITS = re.compile(r"[0-9a-fA-F]{4,16}")
_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
_POINT = re.compile(r"[+-]?\d*\.\d*(?:[eE][+-]?\d+)?")
_FEW = 200
"""Fields from which the form of a column is found."""


def few(texts: Sequence[str]) -> Sequence[str]:
    """Return fields of the whole column, enough to find its form."""
    return texts[:: max(len(texts) // _FEW, 1)]


def decimal_sign(fields: Iterable[str]) -> str:
    """Return "," where numbers have a comma before their fraction, else ".".

    Args:
        fields: Of the first rows, whose delimiter is not the comma.
    """
    commas = 0
    for field in map(str.strip, fields):
        if _GROUPED_TWICE.fullmatch(field):
            return "."
        if _GROUPED_BY_POINTS.fullmatch(field):
            commas += "," in field or field.count(".") > 1
        elif _POINT.fullmatch(field):
            return "."
        else:
            commas += _COMMA.fullmatch(field) is not None
    return "," if commas else "."


def with_points(text: str, decimal: str) -> str:
    """Return a field whose fraction begins with a point."""
    if decimal == ".":
        return text
    if _GROUPED_BY_POINTS.fullmatch(text.strip()):
        text = text.replace(".", "")
    return text.replace(decimal, ".")


def numbers(texts: Sequence[str]) -> FloatArray:
    """Return a column as numbers, NaN where a field holds none."""
    read = _hexadecimal if _is_hexadecimal(texts) else number
    return np.fromiter(map(read, texts), dtype=np.float64, count=len(texts))


def number(text: str) -> float:
    """Return a field as a number, NaN where it holds none."""
    try:
        return float(text)
    except ValueError:
        return _unusual(text.strip().replace("\u2212", "-"))


def _unusual(text: str) -> float:
    if _HEXADECIMAL.fullmatch(text):
        return float(int(text, 16))
    if _FORTRAN.fullmatch(text):
        return float(text.lower().replace("d", "e"))
    if grouped := _GROUPED.fullmatch(text):
        return float(text.replace(grouped[1], ""))
    return _or_nan(float, text)


def _hexadecimal(text: str) -> float:
    return _or_nan(lambda digits: float(int(digits, 16)), text)


def _or_nan(read: Callable[[str], float], text: str) -> float:
    try:
        return read(text)
    except ValueError:
        return math.nan


def _is_hexadecimal(texts: Sequence[str]) -> bool:
    """Whether a column is hexadecimal without a prefix: digits of one length, some of them A to F.

    A few fields that were cut off do not matter.
    """
    sample = [text.strip() for text in few(texts) if text.strip()]
    found = [text for text in sample if _DIGITS.fullmatch(text)]
    lengths = {len(text) for text in found}
    letters = any(re.search("[a-fA-F]", text) for text in found)
    plain = any(re.fullmatch(r"\d+[eE]\d+", text) is None and not text.isdigit() for text in found)
    return letters and plain and 10 * len(found) > 9 * len(sample) and len(lengths) == 1
