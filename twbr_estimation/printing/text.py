"""Text of recordings, files and messages, made safe for a terminal.

A topic, a column or a file may be named with escape codes, which would colour, move or erase
what a terminal shows. Everything that this package prints passes through here.
"""

from __future__ import annotations

import sys

_LAYOUT = "\n\t"
"""Control characters that our own tables and pages hold."""
_UNSAFE_KINDS = ("Cc", "Cs", "Zl", "Zp")
_REORDERING = "\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"
"""Marks that change the direction of what follows them."""


def safe(text: str) -> str:
    r"""Return a text with control characters spelled, such as \x1b; line ends and tabs stay."""
    return text if text.isascii() and text.isprintable() else "".join(map(_spelled, text))


def literal(text: str) -> str:
    """Return a text that matplotlib draws as it is: no control characters, no formulas."""
    return safe(text).replace("$", r"\$")


def counted(count: int, one: str) -> str:
    """Return a number with its noun, `1 gap` or `2 gaps`; the plural of `one` ends with s."""
    return f"{count} {one}" if count == 1 else f"{count} {one}s"


def say(text: str, error: bool = False, end: str = "\n", flush: bool = False) -> None:
    """Print a text to stdout, or to stderr where it is an `error`."""
    print(safe(text), file=sys.stderr if error else sys.stdout, end=end, flush=flush)


def _spelled(character: str) -> str:
    import unicodedata  # most texts are plain

    if character in _LAYOUT:
        return character
    if unicodedata.category(character) in _UNSAFE_KINDS or character in _REORDERING:
        code = ord(character)
        return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"
    return character
