"""`twbr VERB ...`: finds the verbs of this folder and runs one.

A verb is a module with `add_parser(subparsers)`, which sets `run` as the parser's default,
and `run(arguments)`, which returns the exit status. The first line of its docstring, after the
colon, is its line in the list of verbs: no module is imported for that. A trailing underscore
in the file's name (`import_.py`) is dropped. The modules in `_NO_VERBS` are no verbs.
"""

from __future__ import annotations

import argparse
import atexit
import gc
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import NoReturn

from .. import __version__
from ..errors import TwbrError
from ..printing.text import safe, say
from ..starting import start_quickly
from .terminal import make_printable

INTERRUPTED = 130
"""Exit status after Ctrl-C: 128 + SIGINT."""
BROKEN_PIPE = 141
"""Exit status when the reader of our output went away: 128 + SIGPIPE."""
PACKAGE = "twbr_estimation"
REPAIR = "install it, or all that recordings need: pip install mcap rosbags zstandard lz4"
_NO_VERBS = ("arguments", "frames", "main", "many", "progress_lines", "terminal")


class _Parser(argparse.ArgumentParser):
    """A parser, and the class of the verbs' parsers; repeats arguments without escape codes."""

    def error(self, message: str) -> NoReturn:
        super().error(safe(message))


def verbs() -> dict[str, str]:
    """Return the module of every verb by the verb's name."""
    modules = (entry.name for entry in iter_modules([str(Path(__file__).parent)]))
    return {name.rstrip("_"): f"{__package__}.{name}" for name in modules if name not in _NO_VERBS}


def parser(arguments: Sequence[str] = ()) -> argparse.ArgumentParser:
    """Return the parser; only the verb that `arguments` start with is imported, else none."""
    top = _Parser(prog="twbr", description="Tilt estimation for two-wheeled balancing robots.")
    top.add_argument("--version", action="version", version=f"twbr {__version__}")
    known = verbs()
    subparsers = top.add_subparsers(title="verbs", metavar="VERB", required=True)
    if arguments and arguments[0] in known:
        import_module(known[arguments[0]]).add_parser(subparsers)
        return top
    for verb in sorted(known):
        subparsers.add_parser(verb, help=_summary(known[verb]))
    return top


def _summary(module: str) -> str:
    """Return the description in the first line of a verb's file."""
    file = Path(__file__).with_name(f"{module.rpartition('.')[2]}.py")
    with file.open(encoding="utf-8") as source:
        return source.readline().partition("`: ")[2].strip().strip('"').rstrip(".")


def command() -> int:
    """Run the verb of this process's command line, which is the command `twbr`."""
    start_quickly()
    atexit.register(gc.freeze)  # the search for garbage at the very end would take 0.1 s
    return main()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb and return its exit status; programs may call it as well."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    _replace_closed_streams()
    make_printable(sys.stdout, sys.stderr)
    try:
        chosen = parser(given).parse_args(given)
        status = int(chosen.run(chosen))
        sys.stdout.flush()
    except TwbrError as error:
        from .arguments import in_flags

        say(f"twbr: error: {in_flags(str(error))}", error=True)
        return 1
    except ModuleNotFoundError as error:
        missing = (error.name or "").partition(".")[0]
        if missing == PACKAGE:
            raise
        say(f"twbr: error: the Python package {missing} is missing: {REPAIR}", error=True)
        return 1
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        # What is still buffered must not fail again when the interpreter closes stdout.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except OSError as error:
        where = "" if error.filename is None else f"{error.filename}: "
        say(f"twbr: error: {where}{(error.strerror or str(error)).lower()}", error=True)
        return 1
    except MemoryError:
        say("twbr: error: there is not enough memory for this", error=True)
        return 1
    return status


def _replace_closed_streams() -> None:
    """Give a process that was started without stdout or stderr one that goes nowhere."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115


if __name__ == "__main__":
    sys.exit(command())
