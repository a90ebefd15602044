"""The scene and its images at one instant, and the newest of these, shared by threads; no queue."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from simgl.figures.displays import CameraImages
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.web.scene_description import scene_description

# Commands that wait for a session which is busy; of one kind only the last counts.
_MAX_COMMANDS = 32


@dataclass(frozen=True, kw_only=True, eq=False)
class Snapshot:
    """One instant as it is shown.

    state : whose ``scene_description`` a page shows; a stream of images needs none
    images : by camera, as far as there are any
    status : what else the page shows, as JSON: settings, times of passes, counters, a message
    """

    state: SceneState
    images: Mapping[str, CameraImages]
    status: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def scene_json(self) -> str:
        """The description of the state, encoded once for all viewers."""
        return json.dumps(scene_description(self.state))


class NewestSnapshot:
    """The newest snapshot of a scenario, and what viewers want. Safe to use on any thread.

    follows : None where viewers control the scene, else what they follow, in words
    """

    def __init__(self, scenario: Scenario, follows: str | None = None) -> None:
        self.scenario, self.follows = scenario, follows
        self._condition = threading.Condition()
        self._snapshot: Snapshot | None = None
        self._number = 0
        self._watched: dict[object, tuple[str, str]] = {}
        self._commands: dict[str, Mapping[str, Any]] = {}
        self._watch_changed = False
        self._taken = 0
        self._notify: Callable[[], None] = lambda: None

    def on_news(self, notify: Callable[[], None]) -> None:
        """Call a function, on any thread, whenever there is something new to show."""
        self._notify = notify

    def publish(self, snapshot: Snapshot) -> None:
        """Replace the newest snapshot."""
        with self._condition:
            self._number += 1
            self._snapshot = snapshot
        self._notify()

    def newest(self) -> tuple[int, Snapshot | None]:
        """The newest snapshot and its number, from 1; it counts as taken."""
        with self._condition:
            if self._taken != self._number:
                self._taken = self._number
                self._condition.notify_all()
            return self._number, self._snapshot

    # What viewers want

    def watch(self, viewer: object, camera: str, shown: str) -> None:
        """A viewer looks at a plane of a camera."""
        with self._condition:
            self._watched[viewer] = camera, shown
            self._watch_changed = True
            self._condition.notify_all()

    def forget(self, viewer: object) -> None:
        """A viewer left."""
        with self._condition:
            self._watched.pop(viewer, None)

    @property
    def watched(self) -> frozenset[tuple[str, str]]:
        """Cameras and planes that viewers look at."""
        with self._condition:
            return frozenset(self._watched.values())

    def command(self, kind: str, values: Mapping[str, Any]) -> None:
        """Something that a viewer changes; it replaces a waiting command of its kind."""
        with self._condition:
            if kind in self._commands or len(self._commands) < _MAX_COMMANDS:
                self._commands[kind] = values
            self._condition.notify_all()

    def take_commands(self, timeout: float) -> tuple[list[tuple[str, Mapping[str, Any]]], bool]:
        """Waiting commands, and whether viewers look at something else; waits for either.

        timeout : longest wait [s]
        """
        with self._condition:
            if not self._commands and not self._watch_changed:
                self._condition.wait(timeout)
            commands, changed = list(self._commands.items()), self._watch_changed
            self._commands, self._watch_changed = {}, False
            return commands, changed

    def wait_until_wanted(self, timeout: float) -> bool:
        """Whether a viewer is there, and the newest snapshot taken; waits for it.

        timeout : longest wait [s]
        """
        with self._condition:
            return self._condition.wait_for(
                lambda: bool(self._watched) and self._taken == self._number, timeout
            )
