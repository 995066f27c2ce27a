"""Play a recording into the graph: with its timing, or as fast as the graph can take it.

Publishes every topic of the recording under its name, as it was serialised, and the recorded
time on `/clock`. The whole recording is held in memory. At rate 0 a number of messages is under
way at a time and more follow as consumers report stamps on the topics of `follow`; nothing is
lost where their subscriptions are reliable (`config/lossless.yaml`).
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.exceptions import InvalidTopicNameException
from rosgraph_msgs.msg import Clock as ClockMessage
from std_srvs.srv import Trigger

from ..errors import ConfigurationError, TwbrError
from ..parameters.bounds import Bounds, Meaning, require_bounds
from ..printing.text import counted
from ..ros_messages import set_time
from ..streams.replay.pacing import FlowWindow, Pace
from ..streams.replay.player import PlayedPart, Player, stamp_of
from .declarations import declarations_of, settings_from
from .diagnostics import Diagnostics, Level, Report
from .guard import GuardedNode
from .message_types import has_header, message_type
from .parameters import NodeParameters
from .qos import overridable, published
from .spin import run

if TYPE_CHECKING:  # only pip has what reads recordings
    from ..bags.playback import Playback

CHANGEABLE = ("rate", "loop")
"""Parameters that can change while it plays."""
FLUSH_LIMIT = 5.0
"""Longest wait for acknowledgements [s]; the middleware asks for them every 3 s."""


@dataclass(frozen=True, slots=True)
class ReplaySettings:
    """Parameters of the node."""

    bag: Annotated[
        str, Meaning("The recording: a rosbag2 directory, an .mcap or .db3 file, or a ROS 1 bag.")
    ] = ""
    rate: Annotated[
        float, Bounds(0.0, 1000.0, "", "Speed; 1 as recorded, 0 as fast as the graph can take it")
    ] = 1.0
    loop: Annotated[bool, Meaning("Begin again at the end.")] = False
    start: Annotated[float, Bounds(0.0, 1e6, "s", "Time at the beginning that is left out")] = 0.0
    duration: Annotated[
        float, Bounds(0.0, 1e6, "s", "Time that is played from there; 0 is all")
    ] = 0.0
    paused: Annotated[bool, Meaning("Wait for the service `resume` before the first message.")] = (
        False
    )
    exit_at_end: Annotated[bool, Meaning("End the process after the last message.")] = False
    clock: Annotated[bool, Meaning("Publish the recorded time on `/clock`.")] = True
    restamp: Annotated[
        bool,
        Meaning(
            "Shift header stamps and `/clock` so that each pass begins now; otherwise unchanged."
        ),
    ] = False
    exclude: Annotated[
        tuple[str, ...],
        Meaning(
            "Topics that are not played; by default those that the running nodes publish "
            "themselves."
        ),
    ] = (
        "/imu/data_corrected",
        "/imu/data",
        "/tilt",
        "/tilt_deg",
        "/tilt/compare",
        "/tilt/valid",
        "/imu/valid",
        "/diagnostics",
        "/clock",
        "/rosout",
        "/parameter_events",
    )
    wait_for: Annotated[
        tuple[str, ...],
        Meaning("Topics that need a publisher and a subscriber before the first message."),
    ] = ()
    wait_limit: Annotated[
        float, Bounds(0.0, 3600.0, "s", "Longest wait for them; then the node ends with an error")
    ] = 30.0
    delay: Annotated[
        float, Bounds(0.0, 3600.0, "s", "Pause between finding the graph and the first message")
    ] = 0.5
    follow: Annotated[
        tuple[str, ...],
        Meaning(
            "At rate 0: topics with a header whose stamps say how far their publishers have "
            "come. Those that exist at the start are followed; without any, each window of "
            "messages waits for the middleware's acknowledgement, which is slow."
        ),
    ] = ("evaluator_node/progress", "imu/data", "imu/data_corrected")
    window: Annotated[
        int,
        Bounds(1, 10000, "", "At rate 0: messages of a topic under way; below the queues' depth"),
    ] = 80

    def __post_init__(self) -> None:
        require_bounds(self)


class ReplayNode(GuardedNode):
    """Publishes from a thread; services and reports come in through the executor."""

    def __init__(self, **options: Any) -> None:
        """Read the recording and start to play it.

        Raises:
            TwbrError: a parameter or the recording cannot be used.
        """
        super().__init__("replay_node", **options)
        self._settings = self._declare_parameters()
        self._publishers_by_topic: dict[str, Any] = {}
        self._stamped: set[str] = set()
        self._sent = self._left_out = 0
        self.player = self._make_player(self._settings)
        self._clock_publisher = self.create_publisher(ClockMessage, "/clock", published())
        self.create_service(Trigger, "~/pause", self._on_pause)
        self.create_service(Trigger, "~/resume", self._on_resume)
        self._state = "waiting for the graph"
        self._error: TwbrError | None = None
        self._finished = threading.Event()
        self._stopping = threading.Event()
        self._diagnostics = Diagnostics(self, self.report, self._settings.bag)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._end_timer = self.create_timer(0.05, self._end_if_finished, clock=steady)
        self._thread = threading.Thread(target=self._play, name="player", daemon=True)
        self._thread.start()

    def _declare_parameters(self) -> ReplaySettings:
        names = {entry.name for entry in fields(ReplaySettings)}
        fixed = tuple(sorted(names - set(CHANGEABLE)))
        declared = declarations_of(ReplaySettings(), only=CHANGEABLE)
        declared += declarations_of(ReplaySettings(), read_only=True, only=fixed)
        parameters = NodeParameters(self, declared, ReplaySettings(), self._build, self._apply)
        return parameters.current

    def _build(self, former: ReplaySettings, values: Mapping[str, Any]) -> ReplaySettings:
        settings = settings_from(former, values)
        if not settings.bag:
            raise ConfigurationError("bag: name the recording to play")
        return settings

    def _apply(self, settings: ReplaySettings) -> None:
        self.player.loop = settings.loop
        self.player.set_rate(settings.rate)

    def _make_player(self, settings: ReplaySettings) -> Player:
        playback = _read(Path(settings.bag), frozenset(settings.exclude))
        for repair, count in playback.repairs.items():
            self.get_logger().warning(f"{settings.bag}: {repair}: {count}")
        for topic, kind in playback.types.items():
            self._announce(topic, kind)
        player = Player(
            playback,
            self,
            Pace(settings.rate, settings.paused),
            PlayedPart(settings.start, settings.duration, settings.restamp),
        )
        player.loop = settings.loop
        return player

    def _announce(self, topic: str, name: str) -> None:
        """Create the publisher of a recorded topic; what ROS 2 has no name for is not played."""
        try:
            kind = message_type(name)
            self._publishers_by_topic[topic] = self.create_publisher(
                kind, topic, published(), qos_overriding_options=overridable()
            )
        except (ConfigurationError, InvalidTopicNameException) as error:
            why = " ".join(str(error).split())
            self.get_logger().warning(f"{topic!r} is not played: {why}")
            return
        if has_header(kind):
            self._stamped.add(topic)

    def _play(self) -> None:
        """Body of the player's thread."""
        try:
            self._wait_for_graph()
            if not self._stopping.wait(self._settings.delay):
                window = self._follow()
                self._state = "playing"
                self.player.play(self._stamped, window, self._settings.window)
        except TwbrError as error:
            self._error = error
        except RuntimeError:
            if self.context.ok():  # else a signal shut the context down below the thread
                raise
        finally:
            self._finished.set()

    def _wait_for_graph(self) -> None:
        """Wait for publishers and subscribers of `wait_for`.

        Raises:
            ConfigurationError: they did not appear in time.
        """
        limit = self._settings.wait_limit
        end = time.monotonic() + limit
        while missing := self._missing():
            if self._stopping.wait(0.05):
                return
            if time.monotonic() > end:
                raise ConfigurationError(
                    f"wait_for: after {limit:g} s there is still no {', no '.join(missing)}"
                )

    def _missing(self) -> list[str]:
        awaited = [topic for topic in self._settings.wait_for if topic]
        return [
            f"{what} of {topic}"
            for topic in awaited
            for what, count in (
                ("publisher", self.count_publishers),
                ("subscriber", self.count_subscribers),
            )
            if not count(topic)
        ]

    def _follow(self) -> FlowWindow | None:
        """Listen to the topics of `follow` that exist; None where there are none.

        Raises:
            ConfigurationError: one of them has no header.
        """
        names = [self.resolve_topic_name(topic) for topic in self._settings.follow if topic]
        followed = [name for name in names if self.count_publishers(name)]
        types = dict(self.get_topic_names_and_types())
        for topic in followed:
            kind = message_type(types[topic][0])
            if not has_header(kind):
                raise ConfigurationError(f"follow: {topic} is a {types[topic][0]} without a header")
            take = partial(self._on_followed, topic)
            self.create_subscription(kind, topic, take, published(), raw=True)
        if followed:
            return FlowWindow(self._settings.window, followed)
        if self._settings.rate == 0.0:
            self.get_logger().warning(
                "rate 0 with nothing to follow: waiting for acknowledgements, which is slow"
            )
        return None

    def _on_followed(self, topic: str, content: bytes) -> None:
        self.player.report(topic, stamp_of(content))

    def publish(self, topic: str, content: bytes) -> None:
        """Send one message; part of `player.Sink`."""
        publisher = self._publishers_by_topic.get(topic)
        if publisher is None:
            self._left_out += 1
            return
        publisher.publish(content)
        self._sent += 1

    def publish_clock(self, now: int) -> None:
        """Send the recorded time [ns]; part of `player.Sink`."""
        if self._settings.clock:
            message = ClockMessage()
            set_time(message.clock, now)
            self._clock_publisher.publish(message)

    def flush(self) -> None:
        """Wait for acknowledgements; part of `player.Sink`."""
        for publisher in self._publishers_by_topic.values():
            publisher.wait_for_all_acked(Duration(seconds=FLUSH_LIMIT))

    def now(self) -> int:
        """Return the present time [ns]; part of `player.Sink`."""
        return self.clock_now()

    def _on_pause(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.player.pause()
        self._diagnostics.update()
        return self._answered(response)

    def _on_resume(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.player.resume()
        self._diagnostics.update()
        return self._answered(response)

    def _answered(self, response: Trigger.Response) -> Trigger.Response:
        response.success = True
        stands = self.player.paused or self._finished.is_set()
        state = self._activity() if stands else "playing"
        response.message = f"{state} at {self.player.position * 1e-9:.3f} s"
        return response

    def _activity(self) -> str:
        """Return what it does now."""
        ended = self._finished.is_set()
        return "paused" if self.player.paused and not ended else self._state

    def report(self) -> Report:
        """Return what `/diagnostics` says."""
        player = self.player
        values = {
            "position_s": round(player.position * 1e-9, 3),
            "messages": self._sent,
            "messages_of_topics_left_out": self._left_out,
            "passes": player.passes,
            "stalls": player.stalls,
        }
        if player.stalls:
            text = "a followed topic stopped reporting: messages may have been lost"
            return Report(Level.WARN, text, values)
        if player.other_clocks:
            return Report(Level.WARN, self._other_clocks(), values)
        return Report(Level.OK, self._activity(), values)

    def _other_clocks(self) -> str:
        """Return which topics are stamped by another clock than the recorder's."""
        found = ", ".join(
            f"{topic} by {gap:+.6g} s" for topic, gap in self.player.other_clocks.items()
        )
        moved = "both begin now" if self._settings.restamp else "restamp:=true lets both begin now"
        return f"stamps differ from the recorder's clock: {found}; {moved}"

    def _end_if_finished(self) -> None:
        if not self._finished.is_set():
            return
        self._end_timer.cancel()
        if self._error is not None:
            self.get_logger().fatal(str(self._error))
            raise SystemExit(1)
        self._state = "finished"
        self.get_logger().info(self._summary())
        if self._settings.exit_at_end:
            self.context.try_shutdown()

    def _summary(self) -> str:
        """Return what was played, and what was not or may have been lost."""
        text = f"played {counted(self._sent, 'message')} of {self._settings.bag}"
        if self._left_out:
            text += f"; {self._left_out} of topics that are not played"
        if stalls := self.player.stalls:
            text += (
                f"; {counted(stalls, 'time')} a followed topic stopped reporting: some may be lost"
            )
        return text

    def destroy_node(self) -> None:
        """Stop the player, then the node."""
        self._stopping.set()
        self.player.stop()
        self._thread.join(timeout=FLUSH_LIMIT)
        super().destroy_node()


def _read(path: Path, excluded: frozenset[str]) -> Playback:
    """Return the messages of a recording.

    Raises:
        TwbrError: it cannot be read, or a Python package is missing that apt does not have.
    """
    try:
        from ..bags.playback import read_playback
    except ModuleNotFoundError as error:
        missing = (error.name or "").partition(".")[0]
        raise ConfigurationError(
            f"recordings need mcap ({missing} is missing): pip install mcap zstandard lz4"
        ) from None
    return read_playback(path, excluded)


def main(arguments: list[str] | None = None) -> int:
    """Run the node until the end of the recording, or until it is asked to stop."""
    return run(ReplayNode, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
