"""Machine code gives the numbers of the interpreter, whatever happens between two samples."""

from __future__ import annotations

import copy
import os
import pickle
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("numba")

from twbr_estimation.errors import WorkerError
from twbr_estimation.filters.base import filter_named, listed_filters
from twbr_estimation.live_code import files, loading
from twbr_estimation.live_code.checking import check, corrected_samples, raw_samples
from twbr_estimation.live_code.files import CORRECTION
from twbr_estimation.live_code.precompile import compiled, names_of
from twbr_estimation.live_code.providing import (
    BackgroundSteps,
    compiled_correction,
    compiled_filter,
)
from twbr_estimation.live_code.running import CompiledStep
from twbr_estimation.pipeline.watched_filter import WatchedFilter
from twbr_estimation.robot import Calibration, Robot, Setup
from twbr_estimation.samples import CorrectedSample, TiltEstimate
from twbr_estimation.streams.correction import CorrectionStream
from twbr_estimation.streams.estimator import Estimator

NAME = "complementary"
DRIVE = list(corrected_samples())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with the machine code of the correction and of one filter."""
    place = tmp_path_factory.mktemp("code")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(files, "folders", lambda: (place,))
        made = files.made_for(loading.processor())
        for name in (CORRECTION, NAME):
            assert files.saved(name, made, compiled(name)) is not None
        yield place


@pytest.mark.parametrize("name", [CORRECTION, NAME])
def test_a_drive_with_slips_saturation_and_gaps(folder: Path, name: str) -> None:
    check(name)


def _pair(folder: Path) -> tuple[WatchedFilter, WatchedFilter]:
    entry = filter_named(NAME)
    interpreted, by_code = WatchedFilter(entry), WatchedFilter(entry)
    code = compiled_filter(entry)
    assert code is not None
    by_code.use(code)
    return interpreted, by_code


def test_everything_that_may_change_between_two_samples(folder: Path) -> None:
    interpreted, by_code = _pair(folder)
    for index, sample in enumerate(DRIVE):
        for each in (interpreted, by_code):
            if index == 200:
                each.configure({"time_constant": 0.4})
            if index == 300:
                each.valid_stddev = 0.01
            if index == 400:
                each.forget()
            if index == 500:
                sample = sample._replace(dt=3.0)
            if index == 600:
                sample = sample._replace(dt=0.0)
            if index == 700:
                estimate = each.estimate
                assert estimate is not None
                each.reset(estimate, sample)
        assert interpreted.step(sample) == by_code.step(sample), index
        assert (interpreted.trusted, interpreted.doubt) == (by_code.trusted, by_code.doubt)
    assert interpreted.lost == by_code.lost and interpreted.restarts == by_code.restarts
    assert interpreted.state == by_code.state


def test_a_look_at_the_state_leaves_it_with_the_code(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    handed_over: list[int] = []
    begin = CompiledStep.begin

    def counted(step: CompiledStep, *records: Any) -> bool:
        handed_over.append(index)
        return begin(step, *records)

    monkeypatch.setattr(CompiledStep, "begin", counted)
    interpreted, by_code = _pair(folder)
    for index, sample in enumerate(DRIVE[:500]):
        assert interpreted.step(sample) == by_code.step(sample), index
        if index % 7 == 0:
            assert interpreted.state == by_code.state, index
            assert interpreted.lost == by_code.lost, index
    assert handed_over == [1]


def test_other_coefficients_leave_the_state_with_the_code(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interpreted, by_code = _pair(folder)
    for sample in DRIVE[:100]:
        assert interpreted.step(sample) == by_code.step(sample)
    monkeypatch.delattr(CompiledStep, "begin")
    monkeypatch.delattr(CompiledStep, "state")
    for index, sample in enumerate(DRIVE[100:300]):
        for each in (interpreted, by_code):
            if index == 50:
                each.configure({"time_constant": 0.4})
            if index == 100:
                each.use_robot(Robot(wheel_radius=0.05))
            if index == 150:
                each.valid_stddev = 0.01
        assert interpreted.step(sample) == by_code.step(sample), index
        assert interpreted.trusted == by_code.trusted


def test_the_state_comes_back_where_other_coefficients_do_not_fit_the_code(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(CompiledStep, "change", lambda *_: False)
    interpreted, by_code = _pair(folder)
    for index, sample in enumerate(DRIVE[:300]):
        if index == 100:
            for each in (interpreted, by_code):
                each.configure({"time_constant": 0.4})
        assert interpreted.step(sample) == by_code.step(sample), index


def test_a_filter_gone_astray_is_put_right_in_both(folder: Path) -> None:
    def misled(sample: CorrectedSample, index: int) -> CorrectedSample:
        if not 800 <= index < 1000:
            return sample
        return sample._replace(gyro_y=17.4, gyro_saturated_y=1.0)

    interpreted, by_code = _pair(folder)
    for index, sample in enumerate(DRIVE):
        seen = misled(sample, index)
        assert interpreted.step(seen) == by_code.step(seen), index
    assert interpreted.restarts == by_code.restarts > 0


def test_an_estimator_steps_by_machine_code_only_where_it_is_that_of_its_filter(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps: list[object] = []
    step = CompiledStep.step

    def counted(code: CompiledStep, sample: tuple[float, ...]) -> tuple[float, ...]:
        steps.append(code)
        return step(code, sample)

    monkeypatch.setattr(CompiledStep, "step", counted)
    filter_ = filter_named(NAME)
    own = replace(filter_, step=lambda state, sample, c: filter_.step(state, sample, c))
    given: dict[int, TiltEstimate] = {}
    doors = [Estimator(NAME), Estimator(NAME, machine_code=False), Estimator(own)]
    by_code = []
    for each in doors:
        steps.clear()
        for index, raw in enumerate(raw_samples()):
            estimate = each.step(raw.dt, raw[1:4], raw[4:7], raw.wheel_angle)
            given.setdefault(index, estimate)
            assert estimate == given[index], index
        by_code.append(len(set(steps)))
    assert by_code == [2, 0, 1]  # correction and filter, none, correction


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))])
def test_a_copy_of_an_estimator_goes_on_as_the_original(
    folder: Path, copied: Callable[[Estimator], Estimator]
) -> None:
    original = Estimator(NAME)
    for raw in islice(raw_samples(), 300):
        original.step(raw.dt, raw[1:4], raw[4:7], raw.wheel_angle)
    other = copied(original)
    for raw in islice(raw_samples(), 300, 600):
        one, two = (
            each.step(raw.dt, raw[1:4], raw[4:7], raw.wheel_angle) for each in (original, other)
        )
        assert one == two and original.trusted == other.trusted


def test_a_successor_takes_the_estimate_over(folder: Path) -> None:
    interpreted, by_code = _pair(folder)
    for sample in DRIVE[:300]:
        interpreted.step(sample)
        by_code.step(sample)
    successors = WatchedFilter(filter_named("kalman")), WatchedFilter(filter_named("kalman"))
    for before, successor in zip((interpreted, by_code), successors, strict=True):
        successor.succeed(before, DRIVE[300])
    first, second = successors
    assert first.estimate is not None and first.estimate == second.estimate
    assert (first.trusted, first.doubt) == (second.trusted, second.doubt)
    for sample in DRIVE[300:600]:
        assert first.step(sample) == second.step(sample)
        assert (first.trusted, first.doubt) == (second.trusted, second.doubt)


def test_coefficients_of_another_shape_are_interpreted(folder: Path) -> None:
    long = Setup(calibration=Calibration(accel_scale_x=(0.0,) * 8 + (1e-9,)))
    streams = CorrectionStream(long), CorrectionStream(long)
    streams[1].use(compiled_correction())
    for index in range(20):
        values = 0.0, 0.1, 0.0, 0.5, 0.0, 9.8
        first, second = (each.add_imu(10**9 + index * 10**7, values) for each in streams)
        assert first == second


def test_code_for_a_processor_that_is_named_is_not_that_of_this_computer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    own = loading.processor.__wrapped__()
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    plain = loading.processor.__wrapped__()
    assert plain.endswith(" generic ")
    monkeypatch.setenv("NUMBA_CPU_FEATURES", "+sse4.2")
    assert len({own, plain, loading.processor.__wrapped__()}) == 3


def test_what_is_damaged_or_of_other_sources_is_not_used(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (path,) = folder.glob(f"{NAME}.*.step")
    other = tmp_path / path.name
    monkeypatch.setattr(files, "folders", lambda: (tmp_path,))
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    other.write_bytes(content)
    assert NAME in files.kept_names() and loading.loaded(NAME) is None
    other.write_bytes(path.read_bytes())
    other.rename(tmp_path / f"{NAME}.0123456789abcdef.step")
    assert loading.loaded(NAME) is None
    with pytest.raises(WorkerError, match="no machine code"):
        check(NAME)


@pytest.mark.parametrize(
    ("what", "mode", "owner"),
    [("file", 0o664, 0), ("file", 0o646, 0), ("folder", 0o777, 0), ("file", 0o644, 1)],
    ids=["group", "others", "folder", "owner"],
)
def test_what_another_user_may_have_written_is_not_loaded(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str, mode: int, owner: int
) -> None:
    (path,) = folder.glob(f"{NAME}.*.step")
    (tmp_path / path.name).write_bytes(path.read_bytes())
    monkeypatch.setattr(files, "folders", lambda: (tmp_path,))
    assert loading.loaded(NAME) is not None and not files.refused(NAME)
    (tmp_path / path.name if what == "file" else tmp_path).chmod(mode)
    if owner:
        another = os.geteuid() + owner
        monkeypatch.setattr(os, "geteuid", lambda: another)
        if os.getuid() == 0:  # what root has written may be loaded by all
            os.chown(tmp_path / path.name, another + 1, -1)
    assert loading.loaded(NAME) is None
    steps = BackgroundSteps()
    while not steps.ready:
        time.sleep(0.01)
    assert steps.names == () and str(tmp_path) in steps.refusal and "not loaded" in steps.refusal


def test_nothing_is_kept_where_others_can_write(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (path,) = folder.glob(f"{NAME}.*.step")
    code = files.kept(NAME, path.name.split(".")[1])
    assert code is not None
    opened, own = tmp_path / "opened", tmp_path / "own"
    opened.mkdir()
    opened.chmod(0o777)
    monkeypatch.setattr(files, "folders", lambda: (opened, own))
    kept = files.saved(NAME, "made", code)
    assert kept is not None and kept.parent == own and not any(opened.iterdir())
    assert files.kept(NAME, "made") == code


def test_a_process_without_any_is_ready_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(files, "folders", lambda: (tmp_path,))
    steps = BackgroundSteps()
    assert steps.ready and not steps.names and steps.correction() is None


def test_all_stands_for_every_filter_that_a_user_chooses_among() -> None:
    assert names_of(["all", "kalman"]) == list(listed_filters())
    assert names_of([]) == ["ins_odometer"]
