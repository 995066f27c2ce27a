"""Prepare machine code for the live path: `python -m twbr_estimation.live_code.precompile`.

Compiles the correction's step and those of the filters named, by default of `ins_odometer`, checks
them against the interpreted ones sample by sample, and keeps them where nodes look. `all` stands
for all filters, for a node that compares them. To be run once after each installation or update;
nodes interpret where it has not been.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Sequence

from ..errors import TwbrError, WorkerError
from ..filters.base import filter_named, listed_filters
from ..pipeline.watched_filter import SELF_JUDGED
from . import files
from .checking import check
from .files import CORRECTION
from .loading import processor
from .steps import correction_layouts, correction_step, filter_layouts, filter_step

DEFAULT = ("ins_odometer",)


def compiled(name: str) -> files.ObjectCode:
    """Return the machine code of a step.

    Raises:
        ConfigurationError: no filter of that name.
        LayoutError: its records cannot be laid out as numbers.
    """
    from ..compilation import object_code

    if name == CORRECTION:
        run, layouts = correction_step(), correction_layouts()
    else:
        entry = filter_named(name)
        run, layouts = filter_step(entry, name in SELF_JUDGED), filter_layouts(entry)
    shapes = {name: str(each.size) for name, each in layouts._asdict().items()}
    code, function = object_code(run, shapes)
    return files.ObjectCode(function, code)


def prepare(name: str) -> None:
    """Compile a step, check it in a process of its own, and keep it.

    Raises:
        WorkerError: it does not do what the interpreted one does, or cannot be kept.
    """
    made = files.made_for(processor())
    if files.kept(name, made) is not None:
        return
    path = files.saved(name, made, compiled(name))
    if path is None:
        raise WorkerError(f"{name}: none of {', '.join(map(str, files.folders()))} can be written")
    # In another process: code that calls what is not there ends the one that loads it.
    command = [sys.executable, "-m", __spec__.name, "--check", name]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode:
        path.unlink(missing_ok=True)
        raise WorkerError(f"{name}: the compiled step cannot be used: {result.stderr[-500:]}")


def names_of(names: Sequence[str]) -> list[str]:
    """Return the filters of these names; `all` stands for those a user chooses among."""
    found = [listed_filters() if name == "all" else (name,) for name in names or DEFAULT]
    return list(dict.fromkeys(name for each in found for name in each))


def main(arguments: Sequence[str] | None = None) -> int:
    """Prepare what is asked for; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[2])
    parser.add_argument("names", nargs="*", metavar="FILTER", help=f"or all; default: {DEFAULT[0]}")
    parser.add_argument("--check", metavar="STEP", help=argparse.SUPPRESS)
    chosen = parser.parse_args(arguments)
    try:
        if chosen.check:
            check(chosen.check)
            return 0
        for name in (CORRECTION, *names_of(chosen.names)):
            print(f"{name} ...", end=" ", flush=True)
            prepare(name)
            print("ready", flush=True)
    except (TwbrError, ImportError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
