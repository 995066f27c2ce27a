"""The rows of a comma-separated log: its encoding, its delimiter, and lines that are damaged."""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from ..disk.reading import read_bytes
from ..errors import RecordingError
from .csv_description import Description
from .csv_header import header_row
from .csv_numbers import decimal_sign

SIZE_LIMIT = 1 << 30
"""Largest log [bytes]."""
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_PACKED = {
    b"\x1f\x8b": "is packed with gzip; unpack it first",
    b"PK\x03\x04": "is a workbook or an archive; save the table as CSV first",
    b"\xd0\xcf\x11\xe0": "is a workbook; save the table as CSV first",
}
"""What is no text, by its first bytes."""
_DELIMITERS = ";\t|,"
"""The comma comes last: it may belong to the numbers."""
_MOST = 0.8
"""Share of the lines that have a delimiter equally often."""
_SAMPLE = 1 << 14
"""Bytes or characters from which encoding and delimiter are found."""
_USUAL_SHARE = 0.2
"""Shorter rows that are at least this share of a log are meant so."""
COMMENTS = ("#", "%", "//")
"""What a line begins with that is no row."""
_FEW = 200  # rows from which the decimal sign is found
_NUMBER = re.compile(r"\s*[\"']?[+-]?\d")
_MONITOR_TIME = re.compile(r"^\s*(\d{1,2}:\d{2}:\d{2}(?:\.\d+)?)\s*->\s*")
"""The time that a serial monitor puts before each line."""

_GROUPS = re.compile(r"\s*[+-]?\d{1,3}(?:,\d{3})+(?:\.\d*)?\s*")
_LABELLED = re.compile(r"[\s{\"']*([A-Za-z]\w*)[\s\"']*[:=]\s*(.*?)[\s}]*")
"""A field with its name before the number, `gx: 0.1`."""

Rows = list[list[str]]


@dataclass(slots=True)
class Text:
    """Rows of fields, and what was done to get them."""

    names: list[str]
    """Fields of the header row; none without one."""
    rows: Rows
    arrivals: list[str]
    """Time that a serial monitor put before each row; none without such times."""
    dropped: int
    """Rows with another number of fields than the rest."""
    decimal: str = "."
    """Sign between a number's whole part and its fraction."""


def read_rows(path: Path, description: Description) -> Text:
    """Return the rows of a log.

    Raises:
        RecordingError: it cannot be read, is too large, or holds no rows.
    """
    content = read_bytes(path, SIZE_LIMIT, RecordingError)
    for mark, said in _PACKED.items():
        if content.startswith(mark):
            raise RecordingError(f"{path}: {said}")
    text = _decoded(path, content, description.encoding)
    text = text.replace("\0", "").replace("\ufeff", "")
    lines = [line for line in text.splitlines() if line.strip(" \t,;")]
    lines, declared = _without_separator_line(lines[description.skip_rows :])
    lines = _without_comments(lines, description.has_header)
    lines, arrivals = _without_monitor(lines)
    delimiter = description.delimiter or declared or _delimiter(lines, description.decimal or ".")
    try:
        rows = _split(lines, delimiter)
    except csv.Error as error:
        raise RecordingError(f"{path}: cannot be read: {error}") from error
    names, rows = _without_labels(rows)
    header = None if names else _header(rows, description)
    if header is not None:
        names = [name.strip() for name in rows[header]] if rows else []
        rows, arrivals = rows[header + 1 :], arrivals[header + 1 :]
    if not rows:
        raise RecordingError(f"{path}: holds no rows")
    fields = len(names) or description.fields
    if arrivals and 2 * sum(len(row) == fields - 1 for row in rows) > len(rows):
        rows = [[arrival, *row] for arrival, row in zip(arrivals, rows, strict=True)]
    if description.names:
        _require_names_enough(path, names, rows)
    return _of_one_length(names, rows, arrivals, description.decimal or _decimal(rows, delimiter))


def _header(rows: Rows, description: Description) -> int | None:
    return header_row(rows, description.names) if description.has_header else None


def _without_labels(rows: Rows) -> tuple[list[str], Rows]:
    """Return the names that stand before each number, and the rows without them.

    So serial plotters have it, `gx:0.1,gy:0.2`, and lines of JSON. Values go where their name
    stands; what a row lacks is blank, and a row without any is empty. There are no names, and
    the rows are as they were, where most rows are of another form.
    """
    names = _labels(rows[:: max(len(rows) // _FEW, 1)])
    if not names:
        return [], rows
    bare: Rows = []
    for row in rows:
        given = {match[1]: match[2] for field in row if (match := _LABELLED.fullmatch(field))}
        found = [given.get(name, "") for name in names]
        bare.append(found if any(found) else [])
    return names, bare


def _labels(rows: Rows) -> list[str]:
    """Return the names that rows usually have; none where most have a field without one."""
    found = [[_LABELLED.fullmatch(field) for field in row] for row in rows]
    whole = Counter(tuple(match[1] for match in row if match) for row in found if all(row))
    if 2 * whole.total() <= len(rows):
        return []
    numbers = Counter(name for names, number in whole.items() for name in names * number)
    usual = {name for name, number in numbers.items() if number >= _USUAL_SHARE * len(rows)}
    first = whole.most_common(1)[0][0]
    return [name for name in dict.fromkeys((*first, *numbers)) if name in usual]


def _without_separator_line(lines: list[str]) -> tuple[list[str], str | None]:
    """Return the lines without the `sep=;` of spreadsheets, and the sign it names."""
    found = re.fullmatch(r"sep=(.)", lines[0].strip("\r\n")) if lines else None
    return (lines[1:], found[1]) if found else (lines, None)


def _without_comments(lines: list[str], has_header: bool) -> list[str]:
    """Return the lines without comments; one that stands for the header keeps its names."""
    marked = [line.lstrip().startswith(COMMENTS) for line in lines]
    kept = [line for line, comment in zip(lines, marked, strict=True) if not comment]
    if has_header and kept and marked[0] and _NUMBER.match(kept[0]):
        last = lines[marked.index(False) - 1]
        return [last.lstrip().lstrip("#%/ "), *kept]
    return kept


def _decimal(rows: Rows, delimiter: str) -> str:
    """Return the sign before a fraction.

    Where the comma is the delimiter, only quoted numbers can have one; `5,000` is 5000 then.
    """
    fields = [field for row in rows[:_FEW] for field in row]
    if delimiter == "," and all(map(_GROUPS.fullmatch, filter(_has_comma, fields))):
        return "."
    return decimal_sign(fields)


def _has_comma(field: str) -> bool:
    return "," in field


def _decoded(path: Path, content: bytes, encoding: str | None) -> str:
    found = encoding or _encoding(content)
    try:
        return content.decode(found, "replace")
    except (UnicodeError, LookupError) as error:
        raise RecordingError(f"{path}: cannot be read as {found}: {error}") from error


def _encoding(content: bytes) -> str:
    """Return the encoding by the byte order mark, or by where the zeros of plain letters are."""
    for mark, name in _MARKS:
        if content.startswith(mark):
            return name
    sample = content[:_SAMPLE]
    if 3 * sample[1::2].count(0) > len(sample):
        return "utf-16-le"
    if 3 * sample[::2].count(0) > len(sample):
        return "utf-16-be"
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


def _without_monitor(lines: list[str]) -> tuple[list[str], list[str]]:
    """Return the lines without a serial monitor's times, and these; most lines must have one."""
    found = [_MONITOR_TIME.match(line) for line in lines]
    if 2 * sum(match is not None for match in found) <= len(lines):
        return lines, []
    pairs = zip(lines, found, strict=True)
    bare = [line[match.end() :] if match else line for line, match in pairs]
    return bare, [match.group(1) if match else "" for match in found]


def _delimiter(lines: list[str], decimal: str) -> str:
    """Return the sign that most of the first lines have equally often, else the most frequent."""
    if not lines:
        return ","
    sample = lines[: 1 + _SAMPLE // max(len(lines[0]), 1)]
    sample = [line.rstrip(" \t,;|") for line in sample]
    signs = _DELIMITERS.replace(decimal, "")
    for sign in signs:
        number, times = Counter(line.count(sign) for line in sample).most_common(1)[0]
        if number and times >= _MOST * len(sample):
            return sign
    counts = {sign: sum(line.count(sign) for line in sample) for sign in signs}
    best = max(counts, key=lambda sign: counts[sign])
    return best if counts[best] or decimal == "," else " " if " " in "".join(sample) else ","


def _split(lines: list[str], delimiter: str) -> Rows:
    if delimiter == " ":
        return [line.split() for line in lines]
    return list(csv.reader(lines, delimiter=delimiter, skipinitialspace=True))


def _require_names_enough(path: Path, names: list[str], rows: Rows) -> None:
    """Refuse rows whose fields the header does not name all: the names may be others'."""
    longer = Counter(len(row) for row in rows if any(map(str.strip, row[len(names) :])))
    if 2 * longer.total() > len(rows):
        length = longer.most_common(1)[0][0]
        raise RecordingError(
            f"{path}: its header names {len(names)} columns, and its rows have {length}: where "
            "the comma stands both between and in the numbers, save it with another "
            "`delimiter`; else give the columns by number, from 0"
        )


def _of_one_length(names: list[str], rows: Rows, arrivals: list[str], decimal: str) -> Text:
    """Drop rows that lost or gained fields; empty ones at the end do not count."""
    lengths = [len(row) for row in rows]
    counts = Counter(lengths)
    expected = len(names) or counts.most_common(1)[0][0]
    usual = {length for length, number in counts.items() if number >= _USUAL_SHARE * len(rows)}
    usual.add(expected)
    good = [
        length in usual or (length > expected and not any(map(str.strip, row[expected:])))
        for length, row in zip(lengths, rows, strict=True)
    ]
    return Text(
        names,
        [row for row, keep in zip(rows, good, strict=True) if keep],
        [each for each, keep in zip(arrivals, good, strict=True) if keep] if arrivals else [],
        good.count(False),
        decimal,
    )
