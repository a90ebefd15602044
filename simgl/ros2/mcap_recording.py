"""``simgl record --mcap``: a run as a recording of ROS 2 messages in one MCAP file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from simgl import __version__
from simgl.errors import ConfigError
from simgl.images import Capture
from simgl.output import complete_file
from simgl.progress import ProgressCallback, silent
from simgl.ros2 import ros_messages
from simgl.ros2.ros_messages import Message, ros_time_ns
from simgl.ros2.run_messages import (
    camera_messages,
    check_names,
    clock_message,
    frame_message,
)
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator

try:
    from mcap.exceptions import McapError
    from mcap_ros2.writer import Writer
except ImportError:
    problem = 'needs MCAP: pip install "simgl[ros]"'
    raise ConfigError("command line", "--mcap", problem) from None


@dataclass(frozen=True, kw_only=True)
class Recording:
    """What to record.

    epochs : [TAI ns], in order
    depth : also depth images
    """

    scenario: Scenario
    cameras: tuple[str, ...]
    epochs: Sequence[int]
    depth: bool = False


def record(
    recording: Recording, simulator: Simulator, path: Path, progress: ProgressCallback = silent
) -> int:
    """Write the file; it gets its name when it is complete.

    progress : receives the images complete and their number
    returns : the number of messages
    Raises ConfigError for names, lenses and times that ROS 2 does not have; OutputError where the
    file cannot be written.
    """
    # Before anything is drawn.
    check_names(recording.scenario, recording.cameras, recording.epochs[0])
    ros_time_ns(max(recording.epochs))
    total = len(recording.epochs) * len(recording.cameras)
    with complete_file(path) as temporary, temporary.open("wb") as file:
        try:
            topics = _Topics(Writer(file))
            topics.describe(recording.scenario, simulator.renderer_name)
            for index, tai_ns in enumerate(recording.epochs):
                captures = []
                for count, camera in enumerate(recording.cameras):
                    progress(index * len(recording.cameras) + count, total)
                    captures.append(_capture(recording, simulator, tai_ns, camera))
                topics.write_epoch(recording.scenario, tai_ns, captures)
            progress(total, total)
            topics.finish()
        except McapError as error:
            raise ConfigError(str(path), "", f"could not be encoded: {error}") from None
    return topics.count


def _capture(recording: Recording, simulator: Simulator, tai_ns: int, camera: str) -> Capture:
    products = {Product.DN, Product.TRUTH} if recording.depth else {Product.DN}
    return simulator.capture_at(tai_ns, camera, products)


class _Topics:
    """The messages of a file, numbered by topic."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas = {
            name: writer.register_msgdef(name, text)
            for name, text in ros_messages.definitions().items()
        }
        self._sequence: dict[str, int] = {}

    @property
    def count(self) -> int:
        """Messages written."""
        return sum(self._sequence.values())

    def describe(self, scenario: Scenario, renderer: str) -> None:
        """Say in the file where it comes from."""
        about = {"version": __version__, "scenario": scenario.name, "renderer": renderer}
        self._writer.add_metadata("simgl", about)

    def write_epoch(self, scenario: Scenario, tai_ns: int, captures: Sequence[Capture]) -> None:
        """Clock, frames, and for each camera calibration and images."""
        self._write(*clock_message(tai_ns), tai_ns)
        self._write(*frame_message(tai_ns, scenario.poses(tai_ns), captures), tai_ns)
        for capture in captures:
            for topic, kind, message in camera_messages(capture):
                self._write(topic, kind, message, tai_ns)

    def _write(self, topic: str, kind: str, message: Message, tai_ns: int) -> None:
        number = self._sequence.get(topic, 0)
        self._sequence[topic] = number + 1
        when = ros_time_ns(tai_ns)
        self._writer.write_message(topic, self._schemas[kind], message, when, when, number)

    def finish(self) -> None:
        """Write the summary of the file."""
        self._writer.finish()
