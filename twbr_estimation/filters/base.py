"""Interface of a filter: one `Filter` per file, collected by name.

A filter file defines `Parameters` (the settings a user may change), `State` (kept from step
to step), `reset` and `step`, and ends with `FILTER = Filter(...)`. The very same function
runs interpreted and as machine code, live and over recordings. `step` and `reset` therefore use
scalars, tuples, `math` and small numpy arrays only.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..parameters.argument_checks import require_callable
from ..parameters.bounds import Bounds as Bounds
from ..parameters.declared import Definition, alone, collected, listed, named, require_record
from ..parameters.declared import Parameter as Parameter
from ..robot import Robot
from ..samples import CorrectedSample, TiltEstimate

_PACKAGE, _DEFINITION = __name__.rpartition(".")[0], "FILTER"
Function = TypeVar("Function", bound=Callable[..., Any])


class Matrices(NamedTuple):
    """The matrices of Laddach 2022, eq. (22), for one sampling period."""

    a: NDArray[np.float64]
    """State matrix A, (n, n)."""
    b: NDArray[np.float64]
    """Input matrix B, (n, m); m = 0 where the filter has no input."""
    c: NDArray[np.float64]
    """Output matrix C, (p, n)."""
    k: NDArray[np.float64]
    """Gain matrix K, (n, p)."""

    def error_eigenvalues(self) -> NDArray[np.complex128]:
        """Eigenvalues of A - KCA, eq. (25); the estimate converges where all are below 1."""
        return np.linalg.eigvals(self.a - self.k @ self.c @ self.a).astype(np.complex128)


def _parameters_as_coefficients(parameters: Any, robot: Robot) -> Any:
    del robot
    return parameters


def _no_remarks(state: Any) -> tuple[str, ...]:
    del state
    return ()


@dataclass(frozen=True, slots=True, eq=False)
class Filter(Definition):
    """The complete definition of a filter; everything else is derived from it."""

    state: type[Any]
    """Named tuple with the fields `tilt` and `rate`; `gyro_bias`, `tilt_variance` optional."""
    reset: Callable[[TiltEstimate, CorrectedSample, Any], Any]
    """reset(estimate, sample, coefficients): the state that continues from `estimate`."""
    step: Callable[[Any, CorrectedSample, Any], Any]
    """step(state, sample, coefficients): the state after one more sample, whose dt is above 0."""
    derive: Callable[[Any, Robot], Any] = _parameters_as_coefficients
    """derive(parameters, robot): the coefficients, computed once; the parameters by default."""
    matrices: Callable[[Any, float], Matrices] | None = None
    """matrices(parameters, dt) where the filter has the form of eq. (22)."""
    tuned_dt: float | None = None
    """Sampling period the defaults belong to [s]; None where they suit any."""
    uses_wheels: bool = False
    """True where `step` reads the wheels itself, beyond the corrected angle."""
    uses_motors: bool = False
    """True where `step` reads the motors' voltage."""
    remarks: Callable[[Any], tuple[str, ...]] = _no_remarks
    """remarks(state): sentences about what is probably wrong with the inputs now."""
    wheels_ignored: Callable[[Any], float] | None = None
    """wheels_ignored(state): time for which it ignored its wheels [s]; None where it never does."""
    limits: Mapping[str, str] = field(default_factory=dict)
    """Exceptions from the contract, by clause, with the reason."""

    def __post_init__(self) -> None:
        Definition.__post_init__(self)
        require_record("state", self.state, "tilt", "rate")
        for name in ("reset", "step", "derive"):
            require_callable(name, getattr(self, name))

    @property
    def estimates_gyro_bias(self) -> bool:
        """Whether the state carries a gyro bias."""
        return "gyro_bias" in self.state._fields

    @property
    def estimates_variance(self) -> bool:
        """Whether the state carries a variance of the tilt."""
        return "tilt_variance" in self.state._fields

    def warnings(self, parameters: Any, dt: float) -> tuple[str, ...]:
        """Return warnings about these parameters at this sampling period."""
        if self.matrices is None:
            return ()
        modulus = float(np.max(np.abs(self.matrices(parameters, dt).error_eigenvalues())))
        if modulus < 1.0:
            return ()
        warning = (
            f"{self.name}: an eigenvalue of A - KCA has modulus {modulus:.5f} at dt {dt:g} s; "
            "at 1 or above an initial error does not die out"
        )
        return (warning,)


def compiled_as(loops: Callable[..., Any]) -> Callable[[Function], Function]:
    """Spell an array operation in loops where it is compiled.

    Both spellings must do the same operations on each element in the same order. Compiled code
    calls the loops; the code of every other function stands in place of its calls.
    """

    def mark(function: Function) -> Function:
        function.compiled_as = loops  # type: ignore[attr-defined]
        return function

    return mark


def estimate_of(state: Any) -> TiltEstimate:
    """Return the tilt estimate of a filter's state."""
    return TiltEstimate(
        state.tilt,
        state.rate,
        getattr(state, "gyro_bias", 0.0),
        float(getattr(state, "tilt_variance", 0.0)),  # some filters have an element of an array
    )


def turned(state: Any, rotation: float) -> Any | None:
    """Return a state whose tilt is `rotation` [rad] further and that else goes on as it was.

    None where the state does not consist of numbers and of states with a `tilt` alone.
    """
    changes: dict[str, Any] = {"tilt": state.tilt + rotation}
    for name, value in zip(state._fields, state, strict=True):
        if isinstance(value, (float, int)):
            continue
        inner = turned(value, rotation) if "tilt" in getattr(value, "_fields", ()) else None
        if inner is None:
            return None
        changes[name] = inner
    return state._replace(**changes)


@lru_cache(maxsize=1)
def filters() -> Mapping[str, Filter]:
    """Return every filter of this folder by name, in alphabetical order."""
    return collected(_PACKAGE, _DEFINITION)


def listed_filters() -> Mapping[str, Filter]:
    """Return the filters a user chooses among: all but the historical ones."""
    return listed(filters())


def filter_named(name: str) -> Filter:
    """Return the filter of that name.

    Raises:
        ConfigurationError: no such filter; the message lists those there are.
    """
    found: Filter | None = alone(_PACKAGE, _DEFINITION, name)
    return named(filters(), name, "filter") if found is None else found


def is_filter(name: str) -> bool:
    """Return whether there is a filter of that name; the files of the others are not read."""
    return alone(_PACKAGE, _DEFINITION, name) is not None
