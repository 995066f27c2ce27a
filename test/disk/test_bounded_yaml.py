"""No YAML of any origin takes much memory or time, or gets through as a traceback."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest

from twbr_estimation.disk.bounded_yaml import load_yaml
from twbr_estimation.errors import ConfigurationError

PIECES = [b"\xff", b"\x00", b"[", b"{", b"&a ", b"*a", b"!!int ", b": ", b"\n", b"9" * 400]
ALIASES = "a0: &a0 {x: 1, y: 2}\n" + "".join(
    f"a{i}: &a{i} {{{', '.join(f'k{j}: *a{i - 1}' for j in range(10))}}}\n" for i in range(1, 8)
)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("[" * 100_000, "nest"),
        ("[" * 1000 + "]" * 1000, "nested deeper than 32"),
        ("".join("\n" + " " * i + "a:" for i in range(900)), "nested deeper than 32"),
        (ALIASES, "more than 100000 values at line 6"),
        ("&a {b: *a}", "'a' repeats itself"),
        ("\n".join(f"k{i}: {i}" for i in range(60_000)), "more than 100000 values"),
        ("a: " + "9" * 5000, "is no int at line 1"),
        ("a: " + "9" * 400, "beyond 64 bits"),
        ("a: !!int 0b" + "1" * 80, "beyond 64 bits"),
        ("a: 1\nb: 2024-13-45", "'2024-13-45' is no timestamp at line 2"),
        ("a: !!bool maybe", "'maybe' is no bool"),
        ("a: !!float 'abc'", "'abc' is no float"),
        ("a: !!int ''", "'' is no int"),
        ("a: !!python/object:os.system x", "could not determine a constructor"),
        ("a: 1\na: 2", "key 'a' twice at line 2"),
        ("? [a]\n: b", "a key is no name"),
        ("a: \x00", "control characters"),
        ("a" * (1 << 20) + ": 1", "larger than 1.0 MB"),
    ],
)
def test_what_is_beyond_a_limit_is_named_with_its_place(
    tmp_path: Path, text: str, what: str
) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(text)
    with pytest.raises(ConfigurationError, match=what) as error:
        load_yaml(path, ConfigurationError)
    assert str(error.value).startswith(f"{path}: ") and len(str(error.value)) < 400


def test_pipes_devices_and_folders_are_refused_at_once(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    kinds = {pipe: "a named pipe", Path("/dev/zero"): "a device", tmp_path: "a folder"}
    for path, kind in kinds.items():
        with pytest.raises(ConfigurationError, match=f"{path}: cannot be read: it is {kind}"):
            load_yaml(path, ConfigurationError)
    with pytest.raises(ConfigurationError, match="no such file"):
        load_yaml(tmp_path / "absent", ConfigurationError)
    (tmp_path / "latin").write_bytes("a: 1\nb: \xb5".encode("latin-1"))
    with pytest.raises(ConfigurationError, match="line 2 is not UTF-8"):
        load_yaml(tmp_path / "latin", ConfigurationError)


def test_shared_values_within_the_limits_are_read(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("a: &x {k: [1, 2e-3]}\nb: *x\nc: 1e-5\n")
    content = load_yaml(tmp_path / "a.yaml", ConfigurationError)
    assert content == {"a": {"k": [1, 0.002]}, "b": {"k": [1, 0.002]}, "c": 1e-5}


def test_changed_bytes_are_read_or_refused(tmp_path: Path) -> None:
    chance = random.Random(5)
    good = b"/**:\n  ros__parameters:\n    robot: {wheel_radius: 0.03, on: true, list: [1.0, 2]}\n"
    path, refused = tmp_path / "a.yaml", 0
    for _ in range(400):
        changed = bytearray(good)
        for _ in range(chance.randint(1, 4)):
            place = chance.randrange(len(changed))
            new = chance.choice(PIECES)
            changed[place : place + chance.randint(0, 3)] = new
        path.write_bytes(bytes(changed))
        try:
            load_yaml(path, ConfigurationError)
        except ConfigurationError:
            refused += 1
    assert 50 < refused < 400
