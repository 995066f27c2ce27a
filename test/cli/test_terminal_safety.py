"""Names from files reach a terminal without the escape codes they hold."""

from __future__ import annotations

import re
from io import StringIO
from pathlib import Path

import pytest
from mcap.writer import Writer
from rich.table import Table
from rich.text import Text

from twbr_estimation.cli import main as command_line
from twbr_estimation.cli.main import main
from twbr_estimation.printing.console import SafeConsole
from twbr_estimation.printing.text import safe, say

HOSTILE = "a\x1b[31mb\x07c\x9bd\rе\u202ef"
SPELLED = r"a\x1b[31mb\x07c\x9bd\x0dе\u202ef"
RECORDING_VERBS = ("check", "evaluate", "noise", "peers", "report", "tune", "view")


@pytest.fixture
def recording(tmp_path: Path) -> str:
    """A recording whose own name and that of its only topic and type hold escape codes."""
    path = tmp_path / "of\x1b[2J.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema("std_msgs/msg/\x1b]0;Float64\x07", "ros2msg", b"")
        channel = writer.register_channel("/x\x1b[31m", "cdr", schema)
        writer.add_message(channel, 1, b"\0\1\0\0" + b"\0" * 8, 1)
        writer.finish()
    return str(path)


def test_control_characters_are_spelled_and_layout_stays() -> None:
    assert safe(HOSTILE) == SPELLED
    assert safe("deg² ± 1\n\t→ é") == "deg² ± 1\n\t→ é"
    assert safe("\udcff") == r"\udcff", "half a character cannot be written"


def test_lines_go_where_they_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    say(HOSTILE)
    say(HOSTILE, error=True)
    captured = capsys.readouterr()
    assert captured.out == captured.err == SPELLED + "\n"


def test_a_coloured_table_writes_only_its_own_codes_and_stays_aligned() -> None:
    console = SafeConsole(file=StringIO(), force_terminal=True, width=60, color_system="standard")
    table = Table(title=HOSTILE)
    table.add_column(HOSTILE)
    table.add_row(Text(HOSTILE))
    table.add_row("[red]plain[/red]")
    with console.capture() as captured:
        console.print(table)
        console.print(HOSTILE, highlight=False)
    text = captured.get()
    assert "\x1b[31mplain" in text  # a style of ours
    bare = re.sub(r"\x1b\[[0-9;]*m", "", text)
    assert not set(bare) & set("\x1b\x07\x9b\r\u202e")
    assert bare.count(r"a\x1b[31mb") == 4 and "\x1b[31mb" not in text
    assert len({len(line) for line in bare.splitlines() if line[0] in "┃│"}) == 1


@pytest.mark.parametrize("verb", RECORDING_VERBS)
def test_no_verb_prints_a_code_of_a_recording(
    recording: str, verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = ("-o", str(tmp_path / "made")) if verb == "report" else ()
    assert main([verb, recording, *output]) == 1
    captured = capsys.readouterr()
    printed = captured.out + captured.err
    assert r"of\x1b[2J.mcap" in printed and r"/x\x1b[31m" in printed
    assert not set(printed) & set("\x1b\x07")


def test_arguments_are_repeated_without_codes(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["check", "bag", "--no-such\x1b[31m"])
    assert r"--no-such\x1b[31m" in capsys.readouterr().err


def test_everything_is_printed_through_the_safe_functions() -> None:
    package = Path(command_line.__file__).parents[1]
    bare = re.compile(r"(?<![\w.`])(?:print|(?<!Safe)Console)\(")
    found = [
        f"{path.parent.name}/{path.name}"
        for folder in ("checks", "cli", "nodes", "scoring")
        for path in (package / folder).glob("*.py")
        if bare.search(path.read_text(encoding="utf-8"))
    ]
    assert not found
