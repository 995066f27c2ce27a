"""Lever arm, wheel radius, encoder placement, mounting, gyro gain and delays from drives."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from ..checks.finding import Severity
from ..drives import Drive
from ..drives.warnings import contradictions
from ..errors import CalibrationError
from ..recording import Recording
from ..robot import EncoderPlacement, Setup
from .gyro_scale import GyroFit, fit_gyro
from .kinematics import KinematicFit, fit_kinematics
from .signals import Signals, signals_of

WIDTH = 0.05
"""Standard deviation of the smoothing [s]: longer, and less of the motion is left; shorter,
and the steps of the encoders weigh more."""
WIDER = 0.08
"""A second smoothing; what changes with it counts as error."""
GYRO_DELAY_UNCERTAINTY = 0.0003
"""Standard uncertainty of the gyro's own delay [s]."""
PLACEMENT_MARGIN = 0.4
"""How near 0 or 1 the share of the body's turn in the encoder must be."""
PLACEMENT_ERROR = 0.3
"""Largest standard error of that share."""
PLAUSIBLE_GAIN = (0.8, 1.25)
"""Scale of a gyro that is one; 3 % is usual, clones are off by 10 %."""
MOUNTING_MARGIN = 3.0
"""The mounting stays as configured unless it is this many standard errors off: held poses
determine it twenty times better than a drive."""

UNSEEN_PLACEMENT = 0.03
"""Standard uncertainty of lengths where the placement is taken as known, as a share of them."""
LENGTHS = ("wheel radius", "lever arm z")
OWN = ("gyro scale y", "reference delay", "mounting pitch")
"""Quantities that a smoothed reference cannot show."""
SMOOTHED_FACTOR = 2.0
"""How much larger the errors of the others are with it."""
LIMITS = {
    "wheel radius": 0.002,
    "lever arm x": 0.01,
    "lever arm z": 0.01,
    "mounting pitch": math.radians(0.3),
    "gyro scale y": 0.01,
    "reference delay": 0.003,
    "wheel delay": 0.003,
}
"""Largest standard error with which a quantity counts as determined, SI units."""
ESTIMATED = ("robot.wheel_radius", "robot.lever_arm", "robot.encoder_placement")
"""Parameters that this calibration corrects; wrong values of them are expected."""
UNSEEN = "motion in one plane does not show it"


@dataclass(frozen=True, slots=True)
class Estimate:
    """One quantity from a drive."""

    value: float | None
    """SI units; None where the drives do not determine it."""
    error: float | None
    """Standard error."""
    reason: str = ""
    """Why the drives do not determine it."""


@dataclass(frozen=True, slots=True)
class GeometryResult:
    """Geometry of a robot as estimated from drives."""

    setup: Setup
    """The configuration with the quantities that were determined."""
    estimates: dict[str, Estimate]
    body_turn: Estimate
    """Share of the body's turn in the encoder: 1 on the body, 0 referred to ground."""
    placement: EncoderPlacement | None
    """What that means; None where it is not clear and the configured one was taken as known."""
    share: float
    """Share of the drives in which the accelerometer was usable."""
    contradictions: tuple[str, ...] = ()
    """What of the configuration the drives contradict; the estimates replace it."""


def calibrate_geometry(
    recordings: Sequence[Recording], setup: Setup, smoothed: bool = False
) -> GeometryResult:
    """Estimate the geometry of a robot from its drives.

    Args:
        recordings: drives with a reference encoder.
        setup: calibrated as far as it is; delays are counted without its gyro's own.
        smoothed: whether the references are smoothed from the drives themselves: then the gyro's
            scale is not determined, and lengths are less certain.

    Raises:
        RecordingError: no reference, or too short.
        CalibrationError: gyro, accelerometer, wheels and reference contradict each other in
            another way than by what is estimated.
    """
    opened = [Drive(recording, setup) for recording in recordings]
    drives = [signals_of(drive) for drive in opened]
    gyro, wide = fit_gyro(drives, WIDTH), fit_gyro(drives, WIDER)
    judged = [_bare(drive) for drive in opened] if smoothed else opened
    _require_agreement(judged, gyro, smoothed)
    found = _gyro_estimates(gyro, wide, setup)
    wheeled = [drive for drive in drives if drive.wheel is not None]
    turn, placement, share = Estimate(None, None, "there is no wheel encoder"), None, 0.0
    if wheeled:
        turn, placement, share = _placement(wheeled, gyro)
    names = ("wheel radius", "lever arm x", "lever arm z", "mounting pitch", "wheel delay")
    if not wheeled:
        found.update({name: Estimate(None, None, turn.reason) for name in names})
    elif placement is None:
        taken = setup.robot.encoder_placement
        found.update(_less_certain(_kinematic_estimates(wheeled, gyro, taken, setup)))
    else:
        found.update(_kinematic_estimates(wheeled, gyro, placement, setup))
    if smoothed:
        found = {name: _by_smoothing(name, estimate) for name, estimate in found.items()}
    determined = {name: _limited(name, estimate) for name, estimate in found.items()}
    configured = _configured(setup, determined, placement)
    replaced = contradictions(judged)
    return GeometryResult(configured, determined, turn, placement, share, replaced)


def _require_agreement(drives: Sequence[Drive], fit: GyroFit, smoothed: bool) -> None:
    """Refuse drives whose data contradict each other: geometry would hide that."""
    failed = [*contradictions(drives, ESTIMATED), *_dead_wheels(drives)]
    if not failed or not smoothed:  # what contradicts each other is smoothed into nonsense
        failed += _implausible_gain(fit)
    if failed:
        raise CalibrationError("; ".join(failed))


def _bare(drive: Drive) -> Drive:
    """Return a drive without its smoothed reference, which contradicts nothing by itself."""
    return Drive(replace(drive.recording, reference=None), drive.setup)


def _dead_wheels(drives: Sequence[Drive]) -> Iterator[str]:
    """Yield the drives whose wheels seem to stand still: the lever arm would be nonsense."""
    for drive in drives:
        for each in drive.findings:
            if each.subject == "wheels" and each.check == "dead" and each.severity < Severity.FAIL:
                yield (
                    f"{drive.source}: {each.sentence}; an empty `topics.joint_states` leaves the "
                    "wheels out"
                )


def _implausible_gain(fit: GyroFit) -> Iterator[str]:
    if PLAUSIBLE_GAIN[0] < fit.gain < PLAUSIBLE_GAIN[1] or fit.gain_error > abs(fit.gain):
        return
    yield (
        f"gyro: its pitch rate times {fit.gain:.3g} is the reference's, which is no scale error: "
        f"a gyro's scale is within {PLAUSIBLE_GAIN[0]:g} and {PLAUSIBLE_GAIN[1]:g}; check signs "
        "and units of gyro and reference, and robot.mounting"
    )


def _gyro_estimates(fit: GyroFit, wide: GyroFit, setup: Setup) -> dict[str, Estimate]:
    scale = setup.calibration.gyro_scale[1]
    gain_error = math.hypot(fit.gain_error, fit.gain - wide.gain)
    delay_error = math.hypot(fit.delay_error, fit.delay - wide.delay, GYRO_DELAY_UNCERTAINTY)
    return {
        "gyro scale y": Estimate(scale * fit.gain, scale * gain_error),
        "reference delay": Estimate(fit.delay - setup.robot.gyro_delay, delay_error),
    }


def _placement(
    drives: Sequence[Signals], gyro: GyroFit
) -> tuple[Estimate, EncoderPlacement | None, float]:
    """Return the share of the body's turn in the encoder, and the placement that follows."""
    fit = fit_kinematics(drives, WIDTH, gyro.delay, None)
    wide = fit_kinematics(drives, WIDER, gyro.delay, None)
    turn, change = fit.values["body_turn"], wide.values["body_turn"]
    error = math.hypot(fit.errors["body_turn"], turn - change)
    near = round(turn)
    if near not in (0, 1) or abs(turn - near) > PLACEMENT_MARGIN or error > PLACEMENT_ERROR:
        reason = (
            f"the drives do not show the encoder's placement ({turn:.2f} +- {error:.2f} of the "
            "body's turn, neither 0 nor 1): too little motion, or readings taken in step with the "
            "controller; robot.encoder_placement is taken as known"
        )
        return Estimate(turn, error, reason), None, fit.share
    placement = EncoderPlacement.BODY if near == 1 else EncoderPlacement.GROUND
    return Estimate(turn, error), placement, fit.share


def _by_smoothing(name: str, estimate: Estimate) -> Estimate:
    """Return an estimate with the error it has when the reference comes from the same sensors."""
    if name in OWN:
        return Estimate(None, None, "the smoothed reference comes from this gyro")
    if estimate.error is None:
        return estimate
    return replace(estimate, error=SMOOTHED_FACTOR * estimate.error)


def _less_certain(estimates: dict[str, Estimate]) -> dict[str, Estimate]:
    """Return estimates for a placement that was assumed, with the error that this adds.

    Readings that hide the placement distort lengths, too: by some 3 %.
    """
    return {
        name: replace(each, error=math.hypot(each.error, UNSEEN_PLACEMENT * each.value))
        if each.value is not None and each.error is not None and name in LENGTHS
        else each
        for name, each in estimates.items()
    }


def _kinematic_estimates(
    drives: Sequence[Signals],
    gyro: GyroFit,
    placement: EncoderPlacement,
    setup: Setup,
) -> dict[str, Estimate]:
    turn = 1.0 if placement is EncoderPlacement.BODY else 0.0
    fit = fit_kinematics(drives, WIDTH, gyro.delay, turn)
    wide = fit_kinematics(drives, WIDER, gyro.delay, turn)
    pitch, delay = setup.robot.mounting[1], setup.robot.gyro_delay
    return {
        "wheel radius": _estimate(fit, wide, "radius"),
        "lever arm x": _estimate(fit, wide, "forward"),
        "lever arm z": _estimate(fit, wide, "up"),
        "mounting pitch": _estimate(fit, wide, "pitch", pitch),
        "wheel delay": _estimate(fit, wide, "wheel_delay", -delay, GYRO_DELAY_UNCERTAINTY),
    }


def _estimate(
    fit: KinematicFit, wide: KinematicFit, name: str, offset: float = 0.0, known_to: float = 0.0
) -> Estimate:
    error = math.hypot(fit.errors[name], fit.values[name] - wide.values[name], known_to)
    return Estimate(fit.values[name] + offset, error)


def _limited(name: str, estimate: Estimate) -> Estimate:
    limit = LIMITS[name]
    if estimate.value is None or estimate.error is None or estimate.error <= limit:
        return estimate
    reason = f"standard error {estimate.error:.2g} above {limit:.2g}: too little of such motion"
    return Estimate(None, estimate.error, reason)


def _configured(
    setup: Setup, determined: dict[str, Estimate], placement: EncoderPlacement | None
) -> Setup:
    """Return `setup` with the estimates that were determined."""
    robot, calibration = setup.robot, setup.calibration
    arm, scale, mounting = robot.lever_arm, calibration.gyro_scale, robot.mounting

    def value(name: str, otherwise: float, margin: float = 0.0) -> float:
        found, error = determined[name].value, determined[name].error
        if found is None or error is None or abs(found - otherwise) <= margin * error:
            return otherwise
        return found

    pitch = value("mounting pitch", mounting[1], MOUNTING_MARGIN)
    return replace(
        setup,
        robot=replace(
            robot,
            wheel_radius=value("wheel radius", robot.wheel_radius),
            encoder_placement=placement or robot.encoder_placement,
            lever_arm=(value("lever arm x", arm[0]), arm[1], value("lever arm z", arm[2])),
            mounting=(mounting[0], pitch, mounting[2]),
        ),
        calibration=replace(
            calibration, gyro_scale=(scale[0], value("gyro scale y", scale[1]), scale[2])
        ),
    )
