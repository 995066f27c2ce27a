"""Description of a user's own estimator: its topic, and the conversion of its values.

The same text is used by `twbr evaluate --estimator NAME=...` and the evaluator's parameter
`estimators`: `TOPIC[:JOINT][,sign=-1][,unit=deg][,offset_deg=NUMBER]`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

from ..errors import ConfigurationError
from ..recording import FloatArray

FORM = "TOPIC[:JOINT][,sign=-1][,unit=deg][,offset_deg=NUMBER]"
UNITS = {"rad": 1.0, "deg": math.pi / 180.0}

Tilt = TypeVar("Tilt", float, FloatArray)


@dataclass(frozen=True, slots=True)
class EstimatorTopic:
    """One estimator's topic: Imu (its orientation), JointState, or Float64."""

    topic: str
    joint: str = ""
    """Joint of a JointState; the reference's where empty."""
    factor: float = 1.0
    """Sign times unit: what is published, times this, is in [rad] and positive forward."""
    offset: float = 0.0
    """Added after that [rad]."""

    def tilt(self, published: Tilt) -> Tilt:
        """Return our tilt [rad], not wrapped, of a published one or of an array of them."""
        return self.factor * published + self.offset


def estimator_topic(text: str) -> EstimatorTopic:
    """Return the topic that a text of this form describes.

    Raises:
        ConfigurationError: another form, an unknown key, or a value that is not allowed.
    """
    name, *options = (part.strip() for part in text.split(","))
    topic, _, joint = name.partition(":")
    if not topic:
        raise ConfigurationError(f"{text!r} names no topic; expected {FORM}")
    sign, unit, offset = 1.0, 1.0, 0.0
    for option in options:
        key, _, value = option.partition("=")
        if key == "sign" and value in ("1", "-1"):
            sign = float(value)
        elif key == "unit" and value in UNITS:
            unit = UNITS[value]
        elif key == "offset_deg":
            offset = math.radians(_finite(text, value))
        else:
            raise ConfigurationError(f"{text!r}: {option!r} is not understood; expected {FORM}")
    return EstimatorTopic(topic, joint, sign * unit, offset)


def _finite(text: str, value: str) -> float:
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ConfigurationError(f"{text!r}: offset_deg: {value!r} is not a finite number")
    return number
