"""Compare live estimates with the reference encoder: running figures, table and JSON at the end.

Scores `tilt/compare`, `imu/data` and the topics of any further estimators, Imu, JointState or
Float64, against `reference/joint_states` with the association and the figures of
`twbr evaluate`. Each estimator has its figures on
topics of their own, `~/NAME/mse_deg2`, `rmse_deg`, `bias_deg` and `max_abs_deg`
(std_msgs/Float64), from the moment on when it has been compared; `~/progress` carries the stamp
up to which everything has arrived. Where the reference jumps back, as in a looped recording, a
new recording begins in table and JSON.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Annotated, Any

from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Header
from std_srvs.srv import Trigger

from ..errors import ConfigurationError, TwbrError
from ..parameters.bounds import Bounds, Meaning, require_bounds
from ..ros_messages import set_time
from ..scoring.estimator_topics import EstimatorTopic, estimator_topic
from ..scoring.figure_table import FIGURES
from ..scoring.live import LiveEvaluation
from ..scoring.score import RecordingScore, ScoringOptions
from ..streams.messages import JointStateDecoder
from . import memory
from .diagnostics import Diagnostics, Level, Report
from .estimator_inputs import estimator_inputs
from .guard import GuardedNode
from .parameters import declare_settings
from .qos import listen, overridable, published
from .spin import run

FIGURE_TOPICS = tuple(each.name for each in FIGURES if each.name != "delay_s")
"""Figures with a topic each, below the estimator's name; the delay is searched for at the end."""
PROGRESS_EVERY = 20
"""Estimates between two messages on `~/progress`."""
PROGRESS_PERIOD = 0.05
"""Time after which a smaller step of progress is reported, too [s]."""
SILENCE = 1_000_000_000
"""A source whose last stamp is older than this [ns] does not hold up `~/progress`."""
REFERENCE = "reference"
MOST_ESTIMATORS = 64
"""Estimators that are compared; names beyond are counted."""
_NO_TOKEN = re.compile(r"[^A-Za-z0-9_]+|__+")


@dataclass(frozen=True, slots=True)
class EvaluatorSettings:
    """Parameters of the node."""

    estimators: Annotated[
        tuple[str, ...],
        Meaning(
            "Estimators to compare, as "
            "`NAME=TOPIC[:JOINT][,sign=-1][,unit=deg][,offset_deg=NUMBER]`; the topic's "
            "type, Imu, JointState or Float64, shows by itself. All of `tilt/compare` comes "
            "on top."
        ),
    ] = ("active=imu/data",)
    reference_joint: Annotated[
        str, Meaning("Joint of `reference/joint_states` that is the tilt.")
    ] = "tilt"
    reference_delay: Annotated[
        float, Bounds(-10.0, 10.0, "s", "An estimate at t is compared with the reference at t - it")
    ] = 0.0
    reference_offset_deg: Annotated[
        float, Bounds(-180.0, 180.0, "deg", "Added to the reference")
    ] = 0.0
    skip: Annotated[float, Bounds(0.0, 1e6, "s", "Time at the start that is not scored")] = 0.0
    period: Annotated[float, Bounds(0.05, 3600.0, "s", "Time between two sets of figures")] = 1.0
    source: Annotated[str, Meaning("What to call the data in table and JSON.")] = "live"
    json_file: Annotated[
        str, Meaning("Where the figures are written at the end; nowhere if empty.")
    ] = ""
    table: Annotated[bool, Meaning("Print the table at the end.")] = True

    def __post_init__(self) -> None:
        require_bounds(self)
        self.topics()

    def topics(self) -> dict[str, EstimatorTopic]:
        """Return the topics by the estimators' names.

        Raises:
            ConfigurationError: an entry that is not NAME=TOPIC, or a name that is given twice.
        """
        found: dict[str, EstimatorTopic] = {}
        for entry in filter(None, self.estimators):
            name, _, topic = entry.partition("=")
            if not (name.isidentifier() and topic):
                raise ConfigurationError(
                    f"estimators: {entry!r} is not NAME=TOPIC, the name of letters, digits and _"
                )
            if name in found:
                raise ConfigurationError(f"estimators: {entry!r}: {name} stands twice")
            try:
                found[name] = estimator_topic(topic)
            except ConfigurationError as error:
                raise ConfigurationError(f"estimators: {error}") from None
        return found

    def options(self) -> ScoringOptions:
        """Return how estimates are compared."""
        return ScoringOptions(
            self.reference_delay, math.radians(self.reference_offset_deg), self.skip
        )


class EvaluatorNode(GuardedNode):
    """Subscribes, collects, and asks a `LiveEvaluation` for the figures."""

    def __init__(self, **options: Any) -> None:
        """Create the node.

        Raises:
            ConfigurationError: a parameter that cannot be used.
        """
        super().__init__("evaluator_node", **options)
        self._settings = declare_settings(self, EvaluatorSettings())
        self._live = self._begin()
        self._finished: list[RecordingScore] = []
        self._ended = False
        self._received = self._told = 0
        self._names = set(self._settings.topics())
        self._left_out = 0
        self._last_stamps: dict[str, int] = {}
        self._figures: dict[tuple[str, str], Any] = {}
        self._subscribe()
        self._progress = self.create_publisher(
            Header, "~/progress", published(), qos_overriding_options=overridable()
        )
        self.create_service(Trigger, "~/reset", self._on_reset)
        self._diagnostics = Diagnostics(self, self.report)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(self._settings.period, self.publish_figures, clock=steady)
        self.create_timer(PROGRESS_PERIOD, self._tell_progress, clock=steady)
        self.create_timer(memory.PERIOD, memory.give_back, clock=steady)

    def _begin(self) -> LiveEvaluation:
        return LiveEvaluation(self._settings.options(), self._settings.source)

    def _subscribe(self) -> None:
        joint_topics = {
            "reference/joint_states": self._on_reference,
            "tilt/compare": self._on_compare,
        }
        for topic, take in joint_topics.items():
            listen(self, JointState, topic, self._joint_callback(take))
        settings = self._settings
        self._inputs = estimator_inputs(
            self, settings.topics(), settings.reference_joint, self._on_estimate
        )

    def _joint_callback(self, take: Any) -> Any:
        decoder = JointStateDecoder()
        return lambda data: take(*decoder.decode(data))

    def _on_estimate(self, name: str, stamp: int, tilt: float) -> None:
        self._live.add_estimate(name, stamp, tilt)
        self._note(f"{name} on its topic", stamp)

    def _on_compare(self, stamp: int, names: tuple[str, ...], tilts: tuple[float, ...]) -> None:
        for name, tilt in zip(names, tilts, strict=True):
            if name in self._names or len(self._names) < MOST_ESTIMATORS:
                self._names.add(name)
                self._live.add_estimate(name, stamp, tilt)
            else:
                self._left_out += 1
        self._note("tilt/compare", stamp)

    def _on_reference(self, stamp: int, names: tuple[str, ...], tilts: tuple[float, ...]) -> None:
        if self._settings.reference_joint not in names:
            return
        if self._live.ends_before(stamp):
            self._end_recording()
        self._live.add_reference(stamp, tilts[names.index(self._settings.reference_joint)])
        self._note(REFERENCE, stamp)

    def _note(self, source: str, stamp: int) -> None:
        """Note how far a source is, and publish it from time to time."""
        last = self._last_stamps
        if stamp < last.get(source, 0) - SILENCE:
            last.clear()
        last[source] = stamp
        self._received += 1
        if self._received % PROGRESS_EVERY == 0:
            self._tell_progress()

    def _tell_progress(self) -> None:
        """Say how far the slowest source is, unless nothing came since the last time."""
        if self._received == self._told:
            return
        self._told = self._received
        newest = max(self._last_stamps.values())
        slowest = min(each for each in self._last_stamps.values() if newest - each <= SILENCE)
        message = Header()
        set_time(message.stamp, slowest)
        self._progress.publish(message)

    def _end_recording(self) -> None:
        """Close the figures of one pass and begin the next."""
        try:
            self._finished.append(self._live.result())
        except TwbrError as error:
            self.get_logger().warning(str(error))
        self._live = self._begin()

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._live, self._finished = self._begin(), []
        response.success, response.message = True, "the figures start afresh"
        return response

    def publish_figures(self) -> None:
        """Score what has come, and publish each figure of each estimator."""
        for each in self._inputs:
            each.look()
        self._live.update()
        for name, score in self._live.scores(delays=False).items():
            for figure in FIGURE_TOPICS:
                self._figure(name, figure).publish(Float64(data=getattr(score, figure)))

    def _figure(self, name: str, figure: str) -> Any:
        publisher = self._figures.get((name, figure))
        if publisher is None:
            publisher = self.create_publisher(Float64, f"~/{_token(name)}/{figure}", published())
            self._figures[name, figure] = publisher
        return publisher

    def report(self) -> Report:
        """Return what `/diagnostics` says."""
        scores = self._live.scores(delays=False)
        values: dict[str, object] = {
            "recordings_finished": len(self._finished),
            "unreadable_messages": self.unreadable,
            "estimators_left_out": self._left_out,
            **{f"{name}.not_used": count for name, count in self._live.refused.items()},
        }
        for name, score in scores.items():
            values |= {f"{name}.{figure}": getattr(score, figure) for figure in FIGURE_TOPICS}
            values |= {f"{name}.samples": score.samples, f"{name}.left_out": score.left_out}
        if REFERENCE not in self._last_stamps:
            return Report(Level.WARN, "waiting for reference/joint_states", values)
        problems = [each.problem for each in self._inputs if each.problem]
        if problems := [*problems, *self._live.problems()]:
            return Report(Level.WARN, "; ".join(problems), values)
        if not scores:
            return Report(Level.WARN, "no estimate has been compared yet", values)
        best = min(scores, key=lambda name: scores[name].mse_deg2)
        return Report(Level.OK, f"best: {best}, {scores[best].mse_deg2:.4g} deg^2", values)

    def finish(self) -> list[RecordingScore]:
        """End the recording; print the table and write the JSON where asked; return the scores."""
        if self._ended:
            return self._finished
        self._ended = True
        self._end_recording()
        if self._finished and self._settings.table:
            self._print()
        if self._finished and self._settings.json_file:
            self._write()
        return self._finished

    def _print(self) -> None:
        from ..printing.console import SafeConsole
        from ..scoring.table import print_scores

        print_scores(SafeConsole(), self._finished)

    def _write(self) -> None:
        from ..scoring.table import write_scores

        try:
            write_scores(self._settings.json_file, self._finished)
        except ConfigurationError as error:
            self.get_logger().error(f"json_file: {error}")

    def destroy_node(self) -> None:
        """Finish, then destroy the node."""
        self.finish()
        super().destroy_node()


def _token(name: str) -> str:
    """Return an estimator's name as a part of a topic's: letters, digits and _."""
    token = _NO_TOKEN.sub("_", name)[:80].strip("_") or "unnamed"
    return f"n{token}" if token[0].isdigit() else token


def main(arguments: list[str] | None = None) -> int:
    """Run the node until it is asked to stop; then print the table."""
    return run(EvaluatorNode, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
