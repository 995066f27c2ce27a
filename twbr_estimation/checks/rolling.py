"""Whether gyro and accelerometer show the same leaning of a robot that rolls on its wheels.

A robot's own acceleration hides its leaning from the accelerometer, and a balancing robot's is
tied to its leaning. The wheels show that acceleration, whatever their radius and sign, so that the
forward force

    force = ratio (-g turn) + arm turning + radius rolling + drift

decides the ratio of the leaning to the turn that the gyro shows: 1 where all is right, -1 where
one of both has the wrong sign, 0.5 where the gyro reads twice the rate. `turn` is the gyro's angle,
`turning` and `rolling` are the second derivatives of that angle and of the wheels', and `drift` is
a straight line. All are seen through the same kernel, three blocks wide.

A gyro that is dead but noisy shows no ratio, and is not looked for: a robot that balances on a dead
gyro, as far as it does, and one that is carried upright with running wheels read the same.

What has once been right is not looked at any more: no sign and no scale changes by itself, and in
a hard push or a spin turn and acceleration are too alike to be told apart.
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..samples import STANDARD_GRAVITY, CorrectedSample
from .finding import Finding, Severity
from .units import of_gyro

if TYPE_CHECKING:  # a node that filters starts without recordings
    from ..recording import FloatArray

WINDOW = 30
"""Rows that are looked at together, one a block."""
CONFIRMED = 10
"""Looks in a row that must find the same."""
CONFIRMED_AXES = 20
"""The same where other axes or scales fit: there are more of them, and of ways to fit by chance."""
RESTORED = 30
"""The same that end what was found, a window of their own: a scale can look right for a while."""
CERTAIN = 8.0
"""A ratio counts from this many standard errors on."""
ROLLING = 5.0
"""The same for the radius of the wheels: they must explain a part of the force."""
RADII = (0.005, 0.5)
"""Believable radii of wheels [m]; beyond them the wheels show another motion."""
FITTING = 0.6
"""What is left must be below this share of what the gyro and of what the wheels explain."""
RIGHT = (0.75, 1.35)
"""Ratios that are right."""
SCALES = (0.6, 1.75)
"""Sizes of a ratio below and above which the gyro has another scale or unit; between them a
negative one is a wrong sign. Sound drives have single looks beyond."""
TOO_FAR = (4.0, 8.0, math.degrees(1.0))
"""Scales with which the turn of an upright robot looks too large for it."""
FITTING_SCALE, ROLLING_SCALE = 0.3, 10.0
"""As `FITTING` and `ROLLING`, for another scale: wheels that are late or slip disturb the ratio."""
SCALE_TOLERANCE = 0.25
"""Relative difference up to which another scale is named: full scales differ by factors of 2."""
REMEMBERED = 100
"""Latest looks with another scale whose median it is."""
OTHER_AXIS = 3.0
"""Other axes must leave this many times less than the right ones."""
WHOLE = (0.7, 1.4)
"""Sizes of their ratio."""
FITTING_AXES = 0.3
"""As `FITTING`, for other axes."""
WILD_OTHER_AXIS, WILD_FITTING_AXES = 5.0, 0.15
"""The same where the robot moves more than `CALM`."""
ARM = 0.1
"""Deviation of the arm from 0 that is expected [m]."""
NOISE = 1e-3
"""Smallest noise of the force [m/s^2]."""
TINY = 1e-12
"""What is added to a sum of squares of signals that may be nothing."""
STANDING = NOISE / (FITTING * RADII[1])
"""Acceleration of the wheels [rad/s^2], rms, up to which no fit can be clear."""
UPRIGHT, LARGEST_FORCE, LARGEST_TURN = 0.4, 1.0, 2.0
"""Up to where a sign is judged: the smallest upward and the largest forward force, as shares of
gravity, and the range of the turn in the window [rad]."""
CALM = (0.6, 0.6, 0.6)
"""The same for axes without stronger evidence."""
AXES = ((0, 0), (0, 2), (1, 1), (1, 0))
"""Other axes of force and turn than x and y that may have been taken for these."""
AXES_SWAPPED, OTHER_SCALE = "IMU axes", "gyro unit"


class _Means(NamedTuple):
    """Means of one block."""

    time: float
    force: tuple[float, float, float]
    turn: tuple[float, float, float]
    wheels: float


class Fit(NamedTuple):
    """What the force of one window shows."""

    ratio: float
    """Of the leaning that the force shows to the gyro's turn."""
    radius: float
    """Of the wheels [m]."""
    left: float
    """What is not explained, rms [m/s^2]."""
    clear: bool
    """Whether ratio and radius are known well and explain most of the force."""
    share: float
    """What is left, as a share of what the gyro and of what the wheels explain."""
    certainty: float
    """The radius, in its standard errors."""


class RollingCheck:
    """Takes samples with wheels, block by block, and looks at the latest at the end of each."""

    def __init__(self) -> None:
        """Start without a past."""
        self.wrong: Finding | None = None
        """What the latest looks have found to be wrong."""
        self.right = False
        """Whether looks have ever found that all is right; then nothing is doubted any more."""
        self._blocks: deque[_Means] = deque(maxlen=3)
        self._rows: deque[tuple[float, ...]] = deque(maxlen=WINDOW)
        self._seen, self._kind, self._doubted = 0, "", False
        self._scales: deque[float] = deque(maxlen=REMEMBERED)
        self._time = self._turn_x = self._turn_z = 0.0
        self._begin()

    def _begin(self) -> None:
        self._count = 0
        self._times = self._wheels = self._x = self._y = self._z = 0.0
        self._turned_x = self._turned_y = self._turned_z = 0.0

    def add(self, sample: CorrectedSample, turn: float) -> None:
        """Take a sample whose wheels are known, and what the gyro's y axis has turned [rad]."""
        self._count += 1
        self._time += sample.dt
        self._times += self._time
        self._turn_x += sample.gyro_x * sample.dt
        self._turn_z += sample.gyro_z * sample.dt
        self._turned_x += self._turn_x
        self._turned_y += turn
        self._turned_z += self._turn_z
        self._x += sample.accel_x
        self._y += sample.accel_y
        self._z += sample.accel_z
        self._wheels += sample.wheel_angle

    def end_block(self, count: int) -> None:
        """End a block of so many samples."""
        self.wrong = None
        if self._count < count:  # the wheels are not known in all of it
            self._blocks.clear()
            self._rows.clear()
            self._seen = 0
        else:
            self._blocks.append(self._means())
            if len(self._blocks) == 3:
                self._rows.append(_row(*self._blocks))
        self._begin()
        if len(self._rows) == WINDOW and not self.right:
            self._look(np.array(self._rows))

    def _means(self) -> _Means:
        count = self._count
        return _Means(
            self._times / count,
            (self._x / count, self._y / count, self._z / count),
            (self._turned_x / count, self._turned_y / count, self._turned_z / count),
            self._wheels / count,
        )

    def _look(self, rows: FloatArray) -> None:
        """Judge the window; believe what is found several times in a row."""
        right, found = _judged(rows)
        if not right and found is None:
            self._seen = 0
            return
        self._seen = self._seen + 1 if _kind(found) == self._kind else 1
        self._kind = _kind(found)
        if found is not None and found.ratio is not None and self._kind == OTHER_SCALE:
            self._scales.append(found.ratio)
            found = _of_scale(float(np.median(self._scales)))
        if self._seen >= self._needed():
            self.wrong, self.right, self._doubted = found, right, not right

    def _needed(self) -> int:
        """Return how many looks in a row must find the same."""
        if self._kind in (AXES_SWAPPED, OTHER_SCALE):
            return CONFIRMED_AXES
        return RESTORED if self._doubted and not self._kind else CONFIRMED


def _kind(found: Finding | None) -> str:
    return "" if found is None else f"{found.subject} {found.check}"


def _row(first: _Means, middle: _Means, last: _Means) -> tuple[float, ...]:
    """Return force x, y, z, turn x, y, z, turning x, y, z and rolling at the middle block."""

    def smooth(a: float, b: float, c: float) -> float:
        return (a + 10.0 * b + c) / 12.0  # Numerov: fits the curvature to the fourth order

    before, after = middle.time - first.time, last.time - middle.time

    def curvature(a: float, b: float, c: float) -> float:
        return 2.0 * ((c - b) / after - (b - a) / before) / (before + after)

    return (
        *map(smooth, first.force, middle.force, last.force),
        *map(smooth, first.turn, middle.turn, last.turn),
        *map(curvature, first.turn, middle.turn, last.turn),
        curvature(first.wheels, middle.wheels, last.wheels),
    )


class _Window(NamedTuple):
    """What one window of rows holds of force x, y, z, turn x, y, z, turning x, y, z and rolling."""

    moments: list[list[float]]
    """Sums of the products of each two of them, straight lines taken out, (10, 10)."""
    up: float
    """Smallest force along z, as a share of gravity."""
    forward: float
    """Largest force along x or y, as a share of gravity."""
    turned: float
    """Range of the turn about y [rad]."""
    gravity: float
    """Mean length of the force [m/s^2]."""

    def within(self, up: float, forward: float, turned: float, factor: float = 1.0) -> bool:
        """Return whether the robot stands upright and leans little, by these limits.

        Args:
            up: limit of the smallest upward force, as a share of gravity.
            forward: limit of the largest forward or sideways force, likewise.
            turned: limit of the turn [rad].
            factor: what the turn is divided by first.
        """
        return self.up > up and self.forward < forward and self.turned < turned * factor

    def left(self, radius: float) -> float:
        """Return what the right axes leave with wheels of this radius, rms [m/s^2]."""
        weights = {0: 1.0, 4: STANDARD_GRAVITY, 9: -radius}
        products = (weights[i] * weights[j] * self.moments[i][j] for i in weights for j in weights)
        return math.sqrt(max(sum(products), 0.0) / WINDOW)


def _window(rows: FloatArray) -> _Window | None:
    """Return what rows of numbers hold, (WINDOW, 10); None where one is not finite."""
    signals = _DETRENDED @ rows
    moments: list[list[float]] = (signals.T @ signals).tolist()
    if not math.isfinite(sum(map(sum, moments))):
        return None
    force, turn = rows[:, :3], rows[:, 4]
    return _Window(
        moments,
        float(force[:, 2].min()) / STANDARD_GRAVITY,
        float(np.abs(force[:, :2]).max()) / STANDARD_GRAVITY,
        float(turn.max() - turn.min()),
        float(np.sqrt((force * force).sum(axis=1)).mean()),
    )


def _straight(count: int) -> FloatArray:
    """Return the projection that takes a straight line out of `count` values."""
    line = np.column_stack([np.ones(count), np.linspace(-1.0, 1.0, count)])
    directions, _ = np.linalg.qr(line)
    projection: FloatArray = np.eye(count) - directions @ directions.T
    return projection


_DETRENDED = _straight(WINDOW)


def _fitted(window: _Window, force_axis: int, turn_axis: int, factor: float = 1.0) -> Fit:
    """Return the ratio of gyro and force about these axes, 0 to 2 for x, y, z.

    Three unknowns by least squares, written out: the interpreter is always warm, which numpy's
    small matrices between two samples are not.

    Args:
        window: what is looked at.
        force_axis: the axis of the force.
        turn_axis: the axis of the turn.
        factor: what the turn is divided by first.
    """
    turn, turning, rolling = (window.moments[i] for i in (3 + turn_axis, 6 + turn_axis, 9))
    lean = -STANDARD_GRAVITY / factor
    aa, ab, ac = (
        lean * lean * turn[3 + turn_axis],
        lean * turn[6 + turn_axis] / factor,
        lean * turn[9],
    )
    bb, bc, cc = turning[6 + turn_axis] / factor**2, turning[9] / factor, rolling[9]
    fa, fb, fc = lean * turn[force_axis], turning[force_axis] / factor, rolling[force_axis]
    ff = window.moments[force_axis][force_axis]
    a, c, variance = aa + TINY, cc + TINY, NOISE
    for _ in range(3):
        b = bb + variance / ARM**2
        inverse_a, inverse_c = b * c - bc * bc, a * b - ab * ab
        mixed_ab, mixed_ac, mixed_bc = bc * ac - ab * c, ab * bc - b * ac, ab * ac - a * bc
        size = a * inverse_a + ab * mixed_ab + ac * mixed_ac
        if not (0.0 < size < math.inf and inverse_a > 0.0 and inverse_c > 0.0):  # one signal twice
            return Fit(0.0, 0.0, math.sqrt(ff / WINDOW), False, math.inf, 0.0)
        ratio = (inverse_a * fa + mixed_ab * fb + mixed_ac * fc) / size
        arm = (mixed_ab * fa + (a * c - ac * ac) * fb + mixed_bc * fc) / size
        radius = (mixed_ac * fa + mixed_bc * fb + inverse_c * fc) / size
        explained = ratio * (2.0 * fa - aa * ratio - 2.0 * ab * arm - 2.0 * ac * radius)
        explained += arm * (2.0 * fb - bb * arm - 2.0 * bc * radius) + radius * (
            2.0 * fc - cc * radius
        )
        variance = max((ff - explained) / (WINDOW - 5), NOISE**2)
    ratio_error, radius_error = (
        math.sqrt(variance * each / size) for each in (inverse_a, inverse_c)
    )
    leaning, driving = abs(ratio) * math.sqrt(a / WINDOW), abs(radius) * math.sqrt(c / WINDOW)
    certainty = abs(radius) / radius_error
    share = math.sqrt(variance) / max(min(leaning, driving), NOISE)
    clear = (
        abs(ratio) > CERTAIN * ratio_error
        and certainty > ROLLING
        and RADII[0] < abs(radius) < RADII[1]
        and share < FITTING
    )
    return Fit(ratio, radius, math.sqrt(variance), clear, share, certainty)


def _judged(rows: FloatArray) -> tuple[bool, Finding | None]:
    """Return whether a window shows that all is right, and what it shows to be wrong."""
    window = _window(rows)
    if window is None or math.sqrt(window.moments[9][9] / WINDOW) <= STANDING:
        return False, None
    if not window.within(UPRIGHT, LARGEST_FORCE, LARGEST_TURN):
        return False, _too_far(window)
    fit = _fitted(window, 0, 1)
    if fit.clear and RIGHT[0] < fit.ratio < RIGHT[1]:
        return True, None
    calm = window.within(*CALM)
    found = _sign(fit) or _scale(window, fit)
    if found is None and not calm:
        found = _too_far(window)
    return False, found or _axes(window, calm)


def _sign(fit: Fit) -> Finding | None:
    """Return that the gyro turns as far as the accelerometer leans, but the other way."""
    if not fit.clear or not SCALES[0] < -fit.ratio < SCALES[1]:
        return None
    subject = "gyro" if fit.radius > 0.0 else "accelerometer"
    text = (
        f"while the robot rolls, the gyro's y axis turns {1.0 / fit.ratio:.3g} times as far as "
        "the accelerometer's x axis leans: one of both has the wrong sign; check robot.mounting"
    )
    return Finding(Severity.FAIL, subject, "sign", text, 1.0 / fit.ratio, "robot.mounting")


def _scale(window: _Window, fit: Fit) -> Finding | None:
    """Return that the gyro has another scale or unit, gravity being that of the accelerometer."""
    ratio = fit.ratio * STANDARD_GRAVITY / window.gravity
    known = fit.clear and fit.share < FITTING_SCALE and fit.certainty > ROLLING_SCALE
    if not known or SCALES[0] < abs(ratio) < SCALES[1]:
        return None
    return _of_scale(1.0 / ratio)


def _too_far(window: _Window) -> Finding | None:
    """Return that the gyro's turn, too large for an upright robot, fits by another scale."""
    for factor in TOO_FAR:
        if not window.within(UPRIGHT, LARGEST_FORCE, LARGEST_TURN, factor):
            continue
        fit = _fitted(window, 0, 1, factor)
        if fit.clear and WHOLE[0] < abs(fit.ratio) < WHOLE[1] and fit.share < FITTING_AXES:
            return _of_scale(factor / fit.ratio)
    return None


def _of_scale(turns: float) -> Finding:
    name = of_gyro(turns, SCALE_TOLERANCE)
    text = (
        f"while the robot rolls, its y axis turns {turns:.3g} times as far as the accelerometer's "
        f"x axis leans{f': it looks like {name}' if name else ''}; give rad/s, and check the full "
        "scale that the driver assumes and calibration.gyro_scale"
    )
    return Finding(Severity.FAIL, "gyro", "unit", text, turns, "calibration.gyro_scale")


def _axes(window: _Window, calm: bool) -> Finding | None:
    """Return that other axes than the configured ones show the leaning."""
    better, fitting = (OTHER_AXIS, FITTING_AXES) if calm else (WILD_OTHER_AXIS, WILD_FITTING_AXES)
    for force, turn in AXES:
        other = _fitted(window, force, turn)
        whole = other.clear and WHOLE[0] < abs(other.ratio) < WHOLE[1]
        if not whole or other.share > fitting:
            continue
        if better * other.left < window.left(abs(other.radius)):
            text = (
                f"while the robot rolls, the turn about {'xyz'[turn]} and the force along "
                f"{'xyz'[force]} show its leaning: the axes are swapped; x is forward, y left, z "
                "up; check robot.mounting and the driver"
            )
            return Finding(Severity.FAIL, "IMU", "axes", text, None, "robot.mounting")
    return None
