"""Array operations that are spelled twice give the same to the last bit in both spellings."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from inspect import getmembers, isfunction
from pkgutil import walk_packages
from typing import Any

import numpy as np
import pytest

import twbr_estimation.filters
from twbr_estimation.compilation import compiled, source_version
from twbr_estimation.filters.inertial import error_state
from twbr_estimation.filters.inertial.error_state import MOVING, SOURCES, STATES, Slopes
from twbr_estimation.filters.model_based import covariance

Random = np.random.Generator
Arguments = tuple[Any, ...]


def square(random: Random, size: int) -> np.ndarray:
    half = random.standard_normal((size, size))
    return half @ half.T + np.eye(size)


def slopes(random: Random, used: int) -> Slopes:
    at = random.choice(STATES, 4, replace=False).tolist()
    by = random.standard_normal(4) * (np.arange(4) < used)
    return Slopes(tuple(at), tuple(by.tolist()))


def inertial_covariance(random: Random) -> Iterator[Arguments]:
    weights = random.standard_normal(SOURCES.shape) * (SOURCES != error_state.LEVER_UP)
    assert weights.shape[1] == MOVING
    yield square(random, STATES), weights


def inertial_measurement(random: Random) -> Iterator[Arguments]:
    for used in (1, 2, 3, 4):
        for slow, gains in ((1.0, 1.0), (0.0, 1.0), (0.3, 0.2)):
            p, error = square(random, STATES), random.standard_normal(STATES)
            yield p, error, slopes(random, used), 0.7, 0.04, slow, gains


def independence(random: Random) -> Iterator[Arguments]:
    for index in (0, 7, STATES - 1):
        yield square(random, STATES), index, 2.5


def fading(random: Random) -> Iterator[Arguments]:
    for first, end in ((0, STATES), (16, 19), (24, 25)):
        yield square(random, STATES), first, end, 0.83


def vector(random: Random) -> Iterator[Arguments]:
    yield (random.standard_normal(STATES),)


def small_covariance(random: Random) -> Iterator[Arguments]:
    for size in (3, 6):
        f = random.standard_normal((size, size)) * (random.random((size, size)) < 0.6)
        yield square(random, size), f, random.random(size)


def small_measurement(random: Random) -> Iterator[Arguments]:
    for size in (3, 6):
        h = random.standard_normal(size) * (np.arange(size) % 2 == 0)
        yield random.standard_normal(size), square(random, size), h, 0.4, 0.1


CASES: dict[Callable[..., Any], Callable[[Random], Iterator[Arguments]]] = {
    error_state.advanced: inertial_covariance,
    error_state.observe: inertial_measurement,
    error_state.forget: independence,
    error_state.fade: fading,
    error_state.numbers_of: vector,
    covariance.advanced: small_covariance,
    covariance.observed: small_measurement,
}


def spelled_twice() -> set[Callable[..., Any]]:
    """Return the functions of all filters that have a second spelling."""
    package = twbr_estimation.filters
    modules = [
        import_module(each.name) for each in walk_packages(package.__path__, f"{package.__name__}.")
    ]
    functions = (function for module in modules for _, function in getmembers(module, isfunction))
    return {function for function in functions if hasattr(function, "compiled_as")}


def test_every_second_spelling_is_compared() -> None:
    assert spelled_twice() == set(CASES)


def everything(result: Any, arguments: Arguments) -> list[np.ndarray]:
    """Return what a call returned and what it left in its arguments."""
    returned = result if isinstance(result, tuple) else (result,)
    changed = [each for each in arguments if isinstance(each, np.ndarray)]
    return [np.asarray(each) for each in (*returned, *changed) if each is not None]


def copied(arguments: Arguments) -> Arguments:
    return tuple(each.copy() if isinstance(each, np.ndarray) else each for each in arguments)


@pytest.mark.parametrize("function", CASES, ids=lambda each: f"{each.__module__}.{each.__name__}")
def test_both_spellings_agree_to_the_last_bit(function: Callable[..., Any]) -> None:
    loops = function.compiled_as  # type: ignore[attr-defined]

    def run(*arguments: Any) -> Any:
        return loops(*arguments)

    kernel = compiled(run, source_version(("filters/**/*.py",)), loops)
    for arguments in CASES[function](np.random.default_rng(3)):
        mine, interpreted, machine = copied(arguments), copied(arguments), copied(arguments)
        expected = everything(function(*mine), mine)
        for found in (
            everything(loops(*interpreted), interpreted),
            everything(kernel(*machine), machine),
        ):
            assert len(found) == len(expected) > 0
            for one, other in zip(found, expected, strict=True):
                np.testing.assert_array_equal(one, other)
