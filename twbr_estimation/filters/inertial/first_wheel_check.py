"""The first comparison of wheels that have not been right yet.

Wheels that are wrong from the start lead the navigation astray before `wheel_check` can condemn
them by the navigation's own attitude. This comparison takes the attitude by the vertical, which
needs no wheels, sees quick changes only, and excuses nothing by an unsure tilt. It ends once the
wheels are condemned, or have been right for a while.
"""

from __future__ import annotations

from ...samples import CorrectedSample
from .aiding import Geometry
from .navigation import InertialReading
from .strapdown import Matrix, tilt_of
from .wheel_check import (
    ACQUITTED,
    CONDEMNED,
    PROOF,
    Trust,
    WheelCheck,
    compared,
    ignoring,
    least_square,
    with_trust,
)

BAND = 0.1
"""Slower changes than this are left out, twice: no first vertical is too wrong for that
[s]."""
EVIDENCE = 5.0
"""Least fast square that condemns, in that of a velocity that counts for nothing."""
SPIN = 2.0
"""Faster turns about the vertical pull a first vertical aside: nothing is compared [rad/s]."""
PASSED = 0.3
"""So long must wheels be right to end the comparison [s]."""


def first_checked(
    check: WheelCheck,
    sample: CorrectedSample,
    now: InertialReading,
    body: Matrix,
    lever_left: float,
    geometry: Geometry,
    still: bool,
    blinded: bool,
) -> WheelCheck:
    """Return the check of wheels that have not been right yet, one sample later.

    Args:
        check: one sample ago.
        sample: the new one.
        now: what the navigation made of it.
        body: attitude of the body in axes that are level by the vertical.
        lever_left: what to add to the place of the lever arm to the left [m].
        geometry: of the robot.
        still: whether the body lies still.
        blinded: whether a sensor was clipped, or silent, at this sample.
    """
    x, y, z = now.rate
    blinded = blinded or abs(body[6] * x + body[7] * y + body[8] * z) > SPIN
    moved_on = compared(
        check,
        sample,
        body,
        tilt_of(body),
        now.rate,
        BAND,
        0.0,
        lever_left,
        geometry,
        still,
        blinded,
    )
    if moved_on.waiting > 0.0:
        return moved_on
    return _judged_first(moved_on, least_square(moved_on, sample.dt, geometry), sample.dt)


def passed_first(check: WheelCheck) -> bool:
    """Whether the first comparison has ended."""
    return check.trust.proven > PASSED or check.trust.ignored > 0.0


def _judged_first(check: WheelCheck, least: float, dt: float) -> WheelCheck:
    """Condemn or prove by the fast squares; `least` as in `_judged`."""
    fast, trust = check.fast, check.trust
    share = fast[0] / (least + max(fast[1], fast[2]))
    lasting = trust.proven
    if share > ACQUITTED:
        lasting = 0.0
    elif min(fast[1], fast[2]) > PROOF * PROOF * least:
        lasting += dt
    if share > CONDEMNED and fast[0] > EVIDENCE * least:
        return with_trust(check, 1.0, ignoring(trust, 0.0, 0.0))
    passed = Trust(lasting, 0.0, 0.0, trust.since, trust.total, trust.needed, 0.0)
    return with_trust(check, 1.0, passed)
