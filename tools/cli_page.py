"""Every verb of `twbr` with its arguments, as Markdown; `make docs` puts it into the site.

The parsers are asked; nothing is listed by hand.

    python tools/cli_page.py
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from twbr_estimation.cli.main import parser, verbs

MARK = "<!-- python tools/cli_page.py -->"
SHARED = 4
"""Arguments of a group that as many verbs have are listed once."""


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Return the page docs/cli.md with the arguments in place of its mark (a hook of mkdocs)."""
    return markdown.replace(MARK, sections()) if page.file.src_uri == "cli.md" else markdown


def sections() -> str:
    """Return the sections of all verbs, then the arguments that they share."""
    found = {verb: dict(parsers_of(verb)) for verb in sorted(verbs())}
    groups = shared_groups([each for of_verb in found.values() for each in of_verb.values()])
    lines = []
    for verb, of_verb in found.items():
        lines.append(f"## twbr {verb}\n")
        for name, each in of_verb.items():
            if name != verb:
                lines.append(f"### twbr {name}\n")
            lines += section(each, groups)
    lines.append("## Shared arguments\n")
    for title, rows in groups.items():
        lines += [f"### {title.capitalize()}\n", *table(rows)]
    return "\n".join(lines)


def parsers_of(verb: str) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Yield name and parser of a verb, and of each kind of it (`calibrate still`)."""
    for name, each in choices_of(parser([verb])).items():
        kinds = choices_of(each)
        yield name, each
        yield from ((f"{name} {kind}", of_kind) for kind, of_kind in kinds.items())


def choices_of(each: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Return the parsers below a parser by name; empty where there are none."""
    for action in each._actions:
        if isinstance(action, argparse._SubParsersAction):
            return dict(action.choices)
    return {}


def shared_groups(parsers: list[argparse.ArgumentParser]) -> dict[str, list[tuple[str, str]]]:
    """Return the rows of each titled group that several verbs have alike, by title."""
    seen: dict[str, list[list[tuple[str, str]]]] = {}
    for each in parsers:
        for group in each._action_groups:
            if group.title not in ("positional arguments", "options") and group._group_actions:
                seen.setdefault(str(group.title), []).append(rows_of(group))
    return {
        title: rows[0]
        for title, rows in seen.items()
        if len(rows) >= SHARED and all(each == rows[0] for each in rows)
    }


def section(
    each: argparse.ArgumentParser, shared: dict[str, list[tuple[str, str]]]
) -> Iterator[str]:
    """Yield the lines about one parser."""
    if each.description:
        yield f"{escaped(each.description)}\n"
    rows, others = [], []
    for group in each._action_groups:
        if str(group.title) in shared:
            others.append(f"[{group.title}](#{str(group.title).replace(' ', '-')})")
        else:
            rows += rows_of(group)
    yield from table(rows)
    if others:
        yield f"And the shared arguments {', '.join(others)}.\n"


def rows_of(group: argparse._ArgumentGroup) -> list[tuple[str, str]]:
    """Return name and meaning of every argument of a group."""
    return [
        (named(action), escaped(meaning(action)))
        for action in group._group_actions
        if not isinstance(action, (argparse._HelpAction, argparse._SubParsersAction))
    ]


def meaning(action: argparse.Action) -> str:
    """Return the help of an argument with its values filled in; empty where it has none."""
    return argparse.HelpFormatter("twbr")._expand_help(action) if action.help else ""


def named(action: argparse.Action) -> str:
    """Return an argument as it is written: flags with their value, or the name of its place."""
    value = str(action.metavar or action.dest.upper())
    if action.choices and not action.metavar:
        value = "{" + ",".join(str(each) for each in action.choices) + "}"
    if not action.option_strings:
        return f"`{value}`"
    shown = "" if action.nargs == 0 else f" {value}"
    return ", ".join(f"`{flag}{shown}`" for flag in action.option_strings)


def table(rows: list[tuple[str, str]]) -> Iterator[str]:
    """Yield a Markdown table, or nothing where there are no rows."""
    if rows:
        yield "| argument | meaning |"
        yield "|---|---|"
        yield from (f"| {name.replace('|', chr(92) + '|')} | {meaning} |" for name, meaning in rows)
        yield ""


def escaped(text: str) -> str:
    """Return a help text for a table: one line, what Markdown would read as markup escaped."""
    parts = " ".join(text.split()).replace("|", "\\|").split("`")
    parts[::2] = [re.sub(r"([\[\]<*_])", r"\\\1", each) for each in parts[::2]]
    return "`".join(parts)


if __name__ == "__main__":
    print(sections(), end="")
