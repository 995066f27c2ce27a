"""Text for terminals and logs that lack some characters."""

from __future__ import annotations

import codecs
import io
from typing import Any

_SPELLED = {
    "²": "^2",
    "³": "^3",
    "√": "sqrt ",
    "°": " deg",
    "±": "+-",
    "µ": "u",
    "μ": "u",
    "σ": "sigma",
    "→": "->",
    "–": "-",
    "—": "-",
    "−": "-",
    "×": "x",
    "·": "*",
    "…": "...",
    "≤": "<=",
    "≥": ">=",
    "’": "'",
}
"""Replacement for a character that the output's encoding lacks."""
_HANDLER = "twbr_spelled"


def make_printable(*streams: Any) -> None:
    """Let a stream spell what its encoding lacks: deg^2 for the sign, an escape for other bytes."""
    codecs.register_error(_HANDLER, _spelled)
    for stream in streams:
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=_HANDLER)


def _spelled(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    return "".join(map(_spelling, text)), error.end


def _spelling(character: str) -> str:
    code = ord(character)
    if 0xDC80 <= code <= 0xDCFF:  # a byte of a file name that is no text
        return f"\\x{code - 0xDC00:02x}"
    return _SPELLED.get(character, "?")
