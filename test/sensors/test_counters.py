"""Counters of the kernel, against a copy of its files, and of GPIO lines, against its events."""

from __future__ import annotations

import types
from pathlib import Path
from typing import Any

import pytest

from twbr_estimation.errors import SensorError
from twbr_estimation.sensors import gpio_counter
from twbr_estimation.sensors.gpio_counter import GpioCounter, open_gpio_counter
from twbr_estimation.sensors.sysfs_counter import WIDEST, SysfsCounter


@pytest.fixture
def count(tmp_path: Path) -> Path:
    """Return a folder with the files of a count of the kernel's counter interface."""
    for name, text in {
        "count": "42\n",
        "ceiling": "65535\n",
        "function": "increase\n",
        "enable": "0\n",
        "preset": "7\n",
        "preset_enable": "0\n",
    }.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def test_a_kernel_count_is_enabled_in_quadrature_and_read(count: Path) -> None:
    counter = SysfsCounter(str(count))
    assert counter.modulus == 65536
    assert counter.read() == 42
    (count / "count").write_text("65535\n")
    assert counter.read() == 65535
    assert (count / "function").read_text() == "quadrature x4"
    assert (count / "enable").read_text() == "1"
    assert (count / "preset_enable").read_text() == "0\n"
    counter.close()


def test_the_index_is_left_to_the_device(count: Path) -> None:
    counter = SysfsCounter(str(count), use_index=True)
    assert counter.zeroed_by_index
    assert (count / "preset").read_text() == "0"
    assert (count / "preset_enable").read_text() == "1"
    counter.close()
    (count / "preset_enable").unlink()
    with pytest.raises(SensorError, match="preset_enable"):
        SysfsCounter(str(count), use_index=True)


def test_the_modulus_can_be_given_or_is_the_widest(count: Path) -> None:
    assert SysfsCounter(str(count), modulus=100).modulus == 100
    (count / "ceiling").unlink()
    assert SysfsCounter(str(count)).modulus == WIDEST


def test_a_missing_count_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(SensorError, match=r"counter9.*No such file.*(there are|no counters)"):
        SysfsCounter(str(tmp_path / "counter9"))


class Request:
    """Behaves as `gpiod.LineRequest` with a queue of edges."""

    def __init__(self, gpiod: Any) -> None:
        self.gpiod = gpiod
        self.levels = {5: False, 6: False, 7: False}
        self.events: list[Any] = []
        self.sequence = 0
        self.released = False

    def set(self, line: int, high: bool) -> None:
        """Change a line; its edge joins the queue."""
        self.levels[line] = high
        self.sequence += 1
        kind = self.gpiod.EdgeEvent.Type
        edge = kind.RISING_EDGE if high else kind.FALLING_EDGE
        self.events.append(self.gpiod.EdgeEvent(edge, self.sequence * 1000, line, self.sequence, 0))

    def turn(self, counts: int) -> None:
        """Turn by that many counts."""
        for _ in range(abs(counts)):
            equal = self.levels[5] == self.levels[6]
            line = 5 if equal == (counts > 0) else 6
            self.set(line, not self.levels[line])

    def get_values(self, lines: list[int]) -> list[Any]:
        value = self.gpiod.line.Value
        return [value.ACTIVE if self.levels[line] else value.INACTIVE for line in lines]

    def wait_edge_events(self, timeout: float) -> bool:
        assert timeout == 0.0
        return bool(self.events)

    def read_edge_events(self, maximum: int) -> list[Any]:
        taken, self.events = self.events[:maximum], self.events[maximum:]
        return taken

    def release(self) -> None:
        self.released = True


@pytest.fixture
def request_() -> Request:
    gpiod = pytest.importorskip("gpiod", minversion="2.1")
    return Request(gpiod)


def test_gpio_edges_are_decoded_in_both_directions(request_: Request) -> None:
    counter = GpioCounter(request_, 5, 6, None)
    assert counter.read() == 0
    request_.turn(3000)
    assert counter.read() == 3000
    request_.turn(-3001)
    assert counter.read() == -1
    assert counter.errors == 0
    counter.close()
    assert request_.released


@pytest.mark.parametrize("before", [0, 1, 2, 3])
def test_gpio_decoding_starts_at_any_levels(request_: Request, before: int) -> None:
    request_.turn(before)
    request_.events.clear()
    counter = GpioCounter(request_, 5, 6, None)
    request_.turn(10)
    assert counter.read() == 10


def test_gpio_edges_that_the_kernel_dropped_are_counted(request_: Request) -> None:
    counter = GpioCounter(request_, 5, 6, None)
    request_.turn(10)
    del request_.events[4:8]
    assert counter.read() == 6
    assert counter.errors == 4


def test_the_gpio_index_latches_the_count(request_: Request) -> None:
    counter = GpioCounter(request_, 5, 6, 7)
    request_.turn(12)
    request_.set(7, True)
    request_.turn(5)
    assert counter.read() == 17
    assert counter.index() == 12


def test_the_first_generation_of_gpiod_is_refused_with_the_remedy(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    old = types.SimpleNamespace(Chip=object)
    monkeypatch.setattr(gpio_counter.importlib, "import_module", lambda name: old)
    with pytest.raises(SensorError, match=r"libgpiod 1; .*pip install 'gpiod>=2.1'"):
        open_gpio_counter("/dev/gpiochip0", 5, 6)


def test_a_missing_gpio_chip_is_one_clear_error() -> None:
    pytest.importorskip("gpiod", minversion="2.1")
    with pytest.raises(SensorError, match="/dev/gpiochip250, lines 5 and 6"):
        open_gpio_counter("/dev/gpiochip250", 5, 6, 7)
