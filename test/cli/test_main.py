from __future__ import annotations

import argparse
import gc
import json
import os
import re
import subprocess
import sys
from types import SimpleNamespace

import pytest

from twbr_estimation import __version__
from twbr_estimation.cli import main as cli
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.filters import filters, listed_filters


def run_twbr(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "twbr_estimation.cli.main", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


@pytest.fixture
def failing_verb(monkeypatch: pytest.MonkeyPatch):
    """Add a verb `fail` whose `run` raises what the test asks for."""

    def install(error: BaseException) -> None:
        def run(arguments: argparse.Namespace) -> int:
            raise error

        def add_parser(subparsers) -> None:
            subparsers.add_parser("fail").set_defaults(run=run)

        monkeypatch.setattr(cli, "verbs", lambda: {"fail": "fail"})
        monkeypatch.setattr(cli, "import_module", lambda _: SimpleNamespace(add_parser=add_parser))

    return install


def test_version_is_the_package_version(capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out == f"twbr {__version__}\n"


def test_every_file_of_the_folder_is_a_verb(capsys):
    with pytest.raises(SystemExit):
        cli.main(["--help"])
    printed = capsys.readouterr().out
    assert "filters" in cli.verbs()
    for verb in cli.verbs():
        assert re.search(rf"^    {verb}\s+\w", printed, re.MULTILINE), f"{verb} has no summary"


def test_a_package_that_is_missing_is_named(failing_verb, capsys):
    failing_verb(ModuleNotFoundError("No module named 'mcap'", name="mcap"))
    assert cli.main(["fail"]) == 1
    error = capsys.readouterr().err
    assert "mcap is missing" in error and "pip install" in error
    failing_verb(ModuleNotFoundError("No module named ...", name="twbr_estimation.missing"))
    with pytest.raises(ModuleNotFoundError):
        cli.main(["fail"])


def test_a_program_that_runs_a_verb_stays_as_it_is():
    program = (
        "import atexit, gc, os\n"
        "from twbr_estimation.cli.main import main\n"
        "def state(): return gc.get_threshold(), dict(os.environ), atexit._ncallbacks()\n"
        "main(['filters'])\n"  # what it imports may register itself, once
        "once = state()\n"
        "main(['filters'])\n"
        "assert state() == once and gc.get_threshold()[0] < 200000, (state(), once)\n"
        "assert 'OPENBLAS_NUM_THREADS' not in os.environ\n"
    )
    kept = {key: value for key, value in os.environ.items() if key != "OPENBLAS_NUM_THREADS"}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=kept, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def test_the_command_itself_starts_quickly(monkeypatch: pytest.MonkeyPatch):
    called = []
    monkeypatch.setattr(cli, "start_quickly", lambda: called.append("start_quickly"))
    monkeypatch.setattr(cli.atexit, "register", lambda function: called.append(function))
    monkeypatch.setattr(cli, "main", lambda: called.append("main") or 3)
    assert cli.command() == 3 and called == ["start_quickly", gc.freeze, "main"]


def test_help_imports_no_verb():
    program = "import sys; from twbr_estimation.cli.main import parser; parser().format_help(); "
    program += "print(*{name.partition('.')[0] for name in sys.modules})"
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert not {"numpy", "rich", "yaml"} & set(result.stdout.split())


def test_usage_errors_exit_with_2(capsys):
    for arguments in ([], ["no_such_verb"], ["filters", "--no-such-option"]):
        with pytest.raises(SystemExit) as stop:
            cli.main(arguments)
        assert stop.value.code == 2
        assert "usage: twbr" in capsys.readouterr().err


def test_our_errors_go_to_stderr_and_exit_with_1(failing_verb, capsys):
    failing_verb(ConfigurationError("robot.yaml: wheel_radius: -1 is below 0"))
    assert cli.main(["fail"]) == 1
    printed = capsys.readouterr()
    assert printed.err == "twbr: error: robot.yaml: wheel_radius: -1 is below 0\n"
    assert printed.out == ""


def test_control_c_exits_with_130(failing_verb, capsys):
    failing_verb(KeyboardInterrupt())
    assert cli.main(["fail"]) == 130
    assert capsys.readouterr().err == ""


def test_other_errors_keep_their_traceback(failing_verb):
    failing_verb(ZeroDivisionError())
    with pytest.raises(ZeroDivisionError):
        cli.main(["fail"])


def test_a_reader_that_goes_away_is_no_error():
    command = [sys.executable, "-m", "twbr_estimation.cli.main", "filters", "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.close()
    _, error = process.communicate(timeout=60)
    assert error == b""
    assert process.returncode == 141


@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-"])
def test_a_closed_stream_is_no_error(closed: str):
    command = f'exec "{sys.executable}" -m twbr_estimation.cli.main filters {closed}'
    done = subprocess.run(
        ["/bin/sh", "-c", command], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_filters_as_json_lists_every_filter_with_its_parameters():
    result = run_twbr("filters", "--json")
    assert result.returncode == 0, result.stderr
    listed = {entry["name"]: entry for entry in json.loads(result.stdout)["filters"]}
    assert set(listed) == set(filters())
    time_constant = listed["complementary"]["parameters"][0]
    assert time_constant["name"] == "time_constant"
    assert time_constant["unit"] == "s"
    assert time_constant["minimum"] < time_constant["default"] < time_constant["maximum"]


def test_filters_as_a_list_name_every_filter_on_80_columns():
    printed = run_twbr("filters").stdout
    for entry in listed_filters().values():
        assert entry.name in printed
    assert max(map(len, printed.splitlines())) <= 80


def test_filters_in_full_name_every_parameter():
    printed = run_twbr("filters", "all").stdout
    for entry in listed_filters().values():
        assert entry.source in " ".join(printed.split())
        assert all(parameter.name in printed for parameter in entry.declared())


def test_filters_in_full_keep_every_word_on_80_columns():
    printed = run_twbr("filters", "all").stdout
    words = " ".join(printed.split())
    assert max(map(len, printed.splitlines())) <= 80
    for entry in listed_filters().values():
        for parameter in entry.declared():
            assert " ".join(parameter.bounds.description.split()) in words
            assert f"{parameter.name} = {parameter.default:g} [{parameter.bounds.unit}]" in words
