"""Counters of the kernel, against a copy of its files, and of GPIO lines, against its events."""

from __future__ import annotations

import errno
import os
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar
from unittest.mock import MagicMock

import pytest

from twbr_estimation.errors import SensorError
from twbr_estimation.sensors import gpio_counter
from twbr_estimation.sensors.encoder import WIDEST, Encoder, EncoderSettings
from twbr_estimation.sensors.gpio_counter import (
    EVENTS_PER_READ,
    Bias,
    GpioCounter,
    open_gpio_counter,
)
from twbr_estimation.sensors.joint_encoders import JointEncoderSettings, open_encoders
from twbr_estimation.sensors.simulated_counter import SimulatedCounter
from twbr_estimation.sensors.sysfs_counter import SysfsCounter


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


@pytest.mark.parametrize(("name", "modulus"), [("ftm-quaddec", 2**16), ("other", WIDEST)])
def test_a_counter_without_ceiling_is_known_or_remarked(
    count: Path, name: str, modulus: int
) -> None:
    folder = count / "count0"
    folder.mkdir()
    for file in ("count", "function"):
        (count / file).rename(folder / file)
    (count / "name").write_text(f"{name}\n")
    counter = SysfsCounter(str(folder))
    assert counter.modulus == modulus
    assert ("modulus" in counter.remark) == (modulus == WIDEST)


@pytest.mark.parametrize(("driver", "modulus"), [("ftm-quaddec", 2**16), ("i8254", WIDEST)])
def test_the_driver_of_a_counter_is_not_its_name(tmp_path: Path, driver: str, modulus: int) -> None:
    """In sysfs, `name` is that of the device; the driver is a link beside it."""
    count = tmp_path / "devices" / "29d0000.counter" / "counter0" / "count0"
    count.mkdir(parents=True)
    (count / "count").write_text("0\n")
    (count.parent / "name").write_text("29d0000.counter\n")
    (tmp_path / "drivers" / driver).mkdir(parents=True)
    (count.parent.parent / "driver").symlink_to(tmp_path / "drivers" / driver)
    (tmp_path / "counter0").symlink_to(count.parent)
    counter = SysfsCounter(str(tmp_path / "counter0" / "count0"))
    assert counter.modulus == modulus
    assert (driver in counter.remark) == (modulus == WIDEST)


@pytest.mark.parametrize("ceiling", ["1", "14"])
def test_a_count_that_wraps_at_once_is_refused(count: Path, ceiling: str) -> None:
    (count / "ceiling").write_text(ceiling)
    with pytest.raises(SensorError, match=f"wraps at {int(ceiling) + 1}, too early"):
        SysfsCounter(str(count))
    with pytest.raises(SensorError, match="wraps at 2, too early"):
        SysfsCounter(str(count), modulus=2)
    assert SysfsCounter(str(count), modulus=16).modulus == 16


@pytest.mark.parametrize("ceiling", [999, 65534, 2**24 - 1, 2**64 - 1])
@pytest.mark.parametrize("step", [7, -7])
def test_counts_are_followed_at_any_ceiling(count: Path, ceiling: int, step: int) -> None:
    (count / "ceiling").write_text(f"{ceiling}\n")
    (count / "count").write_text("3\n")
    counter = SysfsCounter(str(count))
    encoder = Encoder(counter, EncoderSettings(counts_per_turn=1000))
    for index in range(1, 500):
        (count / "count").write_text(f"{(3 + step * index) % (ceiling + 1)}\n")
        position = encoder.read(index).position
    assert position == pytest.approx(step * 499 * EncoderSettings(1000).angle_per_count)


@pytest.mark.parametrize("text", [b"", b"off\n", b"\xff\xfe"])
def test_a_file_without_a_number_is_one_clear_error(count: Path, text: bytes) -> None:
    counter = SysfsCounter(str(count))
    (count / "count").write_bytes(text)
    with pytest.raises(OSError, match=r"/count: .* is no count"):
        counter.read()
    settings = JointEncoderSettings(joint_names=("wheel",), counters=(str(count),))
    with pytest.raises(SensorError, match=r"wheel: .*/count: .* is no count"):
        open_encoders(settings, lambda: 0)
    (count / "ceiling").write_bytes(text)
    with pytest.raises(SensorError, match="/ceiling: "):
        SysfsCounter(str(count))


def test_a_ceiling_of_zero_is_raised(count: Path) -> None:
    (count / "ceiling").write_text("0\n")
    counter = SysfsCounter(str(count))
    assert (count / "ceiling").read_text() == str(2**32 - 1)
    assert counter.modulus == 2**32
    (count / "count").write_text("4294966296\n")
    assert Encoder(counter, EncoderSettings()).read(0).position == 0.0


class Device:
    """Attributes of a count that refuses some writes, as the drivers of the kernel do."""

    def __init__(self, folder: Path, refuse: Callable[[Device, str, str], int]) -> None:
        self.folder, self.refuse = folder, refuse
        self.writes: list[tuple[str, str]] = []

    def __getitem__(self, name: str) -> str:
        return (self.folder / name).read_text().strip()

    def write(self, path: Path, text: str) -> int:
        self.writes.append((path.name, text))
        if number := self.refuse(self, path.name, text):
            raise OSError(number, os.strerror(number))
        with path.open("w") as file:
            return file.write(text)


def _intel_qep(device: Device, name: str, text: str) -> int:
    """Refuse what intel-qep refuses while it counts."""
    busy = device["enable"] == "1" and name in ("ceiling", "preset", "preset_enable", "function")
    return errno.EBUSY if busy else 0


@pytest.mark.parametrize("enabled", ["0", "1"])
def test_a_counter_is_set_up_in_the_order_of_intel_qep(
    count: Path, monkeypatch: pytest.MonkeyPatch, enabled: str
) -> None:
    device = Device(count, _intel_qep)
    monkeypatch.setattr(Path, "write_text", lambda path, text: device.write(path, text))
    with (count / "enable").open("w") as file:
        file.write(enabled)
    with (count / "ceiling").open("w") as file:
        file.write("0")
    SysfsCounter(str(count), use_index=True).close()
    assert [name for name, _ in device.writes if name != "enable"] == [
        "function",
        "ceiling",
        "preset",
        "preset_enable",
    ]
    assert device.writes[-1] == ("enable", "1")
    device.writes.clear()
    SysfsCounter(str(count), use_index=True).close()
    assert device.writes == [], "one that counts as wanted is left alone"


@pytest.mark.parametrize(
    ("number", "mode", "words"),
    [
        (errno.EBUSY, 0o644, "in use; disable it"),
        (errno.EACCES, 0o644, "a udev rule can give the permission"),
        (errno.EACCES, 0o444, "does not let it be changed from 'increase'"),
        (errno.EINVAL, 0o644, "cannot do that"),
    ],
)
def test_a_refused_attribute_is_explained(
    count: Path, monkeypatch: pytest.MonkeyPatch, number: int, mode: int, words: str
) -> None:
    (count / "function").chmod(mode)
    device = Device(count, lambda _, name, __: number if name == "function" else 0)
    monkeypatch.setattr(Path, "write_text", lambda path, text: device.write(path, text))
    with pytest.raises(SensorError, match=f"function: cannot be set to 'quadrature x4'.*{words}"):
        SysfsCounter(str(count))


@pytest.mark.parametrize("number", [errno.EACCES, 0])
def test_a_ceiling_that_stays_zero_is_refused(
    count: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    (count / "ceiling").write_text("0")
    device = Device(count, lambda _, name, __: number if name == "ceiling" else 0)
    write = device.write
    monkeypatch.setattr(
        Path, "write_text", lambda path, text: write(path, "0" if path.name == "ceiling" else text)
    )
    with pytest.raises(SensorError, match="ceiling: 0, so that the count can never leave 0"):
        SysfsCounter(str(count))


@pytest.mark.parametrize("width", [16, 32])
@pytest.mark.parametrize("step", [300, -300])
def test_a_wrap_shows_the_width_of_a_counter_that_does_not(width: int, step: int) -> None:
    counter = SimulatedCounter(lambda: 0, lambda _: 0.0, EncoderSettings(), WIDEST)
    counts = iter([0, *(step * index % 2**width for index in range(1, 700))])
    counter.read = lambda: next(counts)  # type: ignore[method-assign]
    encoder = Encoder(counter, EncoderSettings(counts_per_turn=1000))
    for _ in range(699):
        reading = encoder.read(0)
    assert reading.position == pytest.approx(step * 699 * EncoderSettings(1000).angle_per_count)


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
        self.time, self.spacing = 0, 50_000

    def set(self, line: int, high: bool) -> None:
        """Change a line; its edge joins the queue."""
        self.levels[line] = high
        self.sequence += 1
        kind = self.gpiod.EdgeEvent.Type
        edge = kind.RISING_EDGE if high else kind.FALLING_EDGE
        self.time += self.spacing
        number = self.sequence % 2**32
        self.events.append(self.gpiod.EdgeEvent(edge, self.time, line, number, 0))

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


@pytest.mark.parametrize("lost", [1, 2, 3, 6, 12])
def test_gpio_edges_lost_before_the_first_read_are_counted(request_: Request, lost: int) -> None:
    counter = GpioCounter(request_, 5, 6, None)
    request_.turn(20)
    del request_.events[:lost]
    assert counter.read() == pytest.approx(20 - lost, abs=2)
    assert counter.errors == lost, "each once"
    request_.turn(20)
    assert counter.read() == pytest.approx(40 - lost, abs=2)
    assert counter.errors == lost


def test_one_read_of_gpio_edges_ends(request_: Request) -> None:
    counter = GpioCounter(request_, 5, 6, None)
    request_.turn(10_000)
    assert counter.read() == EVENTS_PER_READ
    assert counter.behind == 1
    assert counter.read() == 2 * EVENTS_PER_READ
    assert counter.read() == 10_000
    assert (counter.behind, counter.errors) == (2, 0)


@pytest.mark.parametrize("turn", [1000, -1000])
def test_edges_that_one_interrupt_served_are_ambiguous(request_: Request, turn: int) -> None:
    counter = GpioCounter(request_, 5, 6, None)
    request_.turn(turn)
    assert counter.read() == turn
    assert counter.ambiguous == 0
    request_.turn(turn)
    for pair in range(0, len(request_.events), 2):  # served in ascending order of the lines
        request_.events[pair : pair + 2] = sorted(
            request_.events[pair : pair + 2], key=lambda event: event.line_offset
        )
    request_.events = [
        request_.gpiod.EdgeEvent(
            event.event_type,
            index // 2 * 100_000 + request_.time + index % 2 * 3_000,
            event.line_offset,
            1000 + index + 1,
            0,
        )
        for index, event in enumerate(request_.events)
    ]
    counter.read()
    assert counter.ambiguous == 500


def test_the_numbers_of_gpio_edges_may_wrap(request_: Request) -> None:
    counter = GpioCounter(request_, 5, 6, None)
    counter._sequence = request_.sequence = 2**32 - 5
    request_.turn(10)
    assert counter.read() == 10
    assert counter.errors == 0


def test_gpio_edges_queued_in_the_wrong_order_are_not_missed(request_: Request) -> None:
    counter = GpioCounter(request_, 5, 6, 7)
    request_.turn(4)
    request_.set(7, True)
    request_.turn(4)
    request_.events[4], request_.events[5] = request_.events[5], request_.events[4]
    assert counter.read() == 8
    assert counter.errors == 0


class FakeGpiod:
    """The parts of `gpiod` that open a chip, with two chips."""

    LABELS: ClassVar = {"/dev/gpiochip0": "brcmvirt-gpio", "/dev/gpiochip4": "pinctrl-rp1"}

    def __init__(self, gpiod: Any, error: int = 0) -> None:
        self.LineSettings, self.line, self.error = gpiod.LineSettings, gpiod.line, error
        self.asked: list[tuple[str, Any]] = []
        self.labels = dict(self.LABELS)
        self.denied: list[str] = []

    def Chip(self, path: str) -> Any:  # noqa: N802
        if path in self.denied:
            raise PermissionError(errno.EACCES, "Permission denied")
        chip = MagicMock()
        chip.__enter__.return_value.get_info.return_value.label = self.labels[path]
        return chip

    def request_lines(self, path: str, config: Any, **_: Any) -> Any:
        self.asked.append((path, config))
        if self.error:
            raise OSError(self.error, os.strerror(self.error))
        request = MagicMock()
        request.get_values.return_value = [self.line.Value.INACTIVE] * 2
        return request


@pytest.fixture
def fake_gpiod(monkeypatch: pytest.MonkeyPatch) -> FakeGpiod:
    fake = FakeGpiod(pytest.importorskip("gpiod", minversion="2.1"))
    monkeypatch.setattr(gpio_counter, "_bindings", lambda: fake)
    monkeypatch.setattr(gpio_counter, "glob", lambda _: list(fake.labels))
    return fake


def test_a_gpio_chip_is_found_by_its_label(fake_gpiod: FakeGpiod) -> None:
    open_gpio_counter("pinctrl-rp1", 5, 6, 7, Bias.PULL_UP)
    ((path, config),) = fake_gpiod.asked
    assert path == "/dev/gpiochip4"
    assert {each.bias for each in config.values()} == {fake_gpiod.line.Bias.PULL_UP}
    with pytest.raises(SensorError, match=r"'pinctrl-x'; there are: .*gpiochip4 \(pinctrl-rp1\)"):
        open_gpio_counter("pinctrl-x", 5, 6)


def test_a_gpio_chip_is_found_by_its_name(fake_gpiod: FakeGpiod) -> None:
    open_gpio_counter("gpiochip4", 5, 6)
    assert fake_gpiod.asked[0][0] == "/dev/gpiochip4"


def test_a_gpio_label_of_two_chips_is_refused(fake_gpiod: FakeGpiod) -> None:
    fake_gpiod.labels["/dev/gpiochip7"] = "pinctrl-rp1"
    with pytest.raises(SensorError, match=r"4 and /dev/gpiochip7 are labelled 'pinctrl-rp1'"):
        open_gpio_counter("pinctrl-rp1", 5, 6)


def test_a_second_name_of_a_gpio_chip_is_no_second_chip(
    fake_gpiod: FakeGpiod, tmp_path: Path
) -> None:
    (tmp_path / "gpiochip4").symlink_to("gpiochip0")  # as Raspberry Pi OS has it
    fake_gpiod.labels = {str(tmp_path / "gpiochip0"): "pinctrl-rp1"}
    fake_gpiod.labels[str(tmp_path / "gpiochip4")] = "pinctrl-rp1"
    open_gpio_counter("pinctrl-rp1", 5, 6)
    assert fake_gpiod.asked[0][0] == str(tmp_path / "gpiochip0")


def test_a_gpio_chip_without_a_label_is_listed_but_not_meant(fake_gpiod: FakeGpiod) -> None:
    fake_gpiod.labels["/dev/gpiochip7"] = ""
    with pytest.raises(SensorError, match=r"'';.*gpiochip7 \(no label\)"):
        open_gpio_counter("", 5, 6)


def test_gpio_chips_that_must_not_be_opened_are_listed(fake_gpiod: FakeGpiod) -> None:
    fake_gpiod.denied = list(fake_gpiod.labels)
    with pytest.raises(SensorError, match=r"gpiochip4 \(Permission denied\); is the user in the"):
        open_gpio_counter("pinctrl-rp1", 5, 6)


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (errno.EACCES, "group"),
        (errno.EBUSY, "gpioinfo"),
        (errno.ENOENT, r"gpiochip4 \(pinctrl-rp1\)"),
        (errno.ENXIO, "no interrupts for these lines"),
    ],
)
def test_what_keeps_gpio_lines_away_is_advised_on(
    fake_gpiod: FakeGpiod, error: int, words: str
) -> None:
    fake_gpiod.error = error
    with pytest.raises(SensorError, match=f"/dev/gpiochip0, lines 5 and 6: .*{words}"):
        open_gpio_counter("/dev/gpiochip0", 5, 6)


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
