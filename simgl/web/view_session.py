"""Renders a scenario as its viewers ask for: what they watch, when it changes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from simgl.errors import ConfigError
from simgl.figures.displays import CameraImages, images_of
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator
from simgl.web.snapshots import NewestSnapshot, Snapshot
from simgl.web.web_settings import WebSettings, changed, chosen_state

# Planes that need no further rendering; any other name is a layer.
_PLANES = ("dn", "electrons", "radiance", "depth")
_ALWAYS = frozenset({Product.DN, Product.ELECTRONS, Product.RADIANCE, Product.TRUTH})
# Longest wait for a command [s]; short enough for Ctrl-C to be felt.
_IDLE = 0.25


class ViewSession:
    """Renders on the thread that calls ``run``; viewers reach it through ``newest``."""

    def __init__(self, simulator: Simulator, newest: NewestSnapshot) -> None:
        self._simulator, self._newest = simulator, newest
        self._settings = WebSettings()
        self._passes: dict[str, float] = {}
        self._frames = 0
        simulator.timer.enabled = True

    def run(self, stop: Callable[[], bool] = lambda: False) -> None:
        """Until ``stop`` says so; the first snapshot comes before any viewer."""
        self._show(self._state(), "")
        before = time.monotonic()
        while not stop():
            playing = self._settings.playing
            commands, must_draw = self._newest.take_commands(0.0 if playing else _IDLE)
            wanted, message = self._settings, ""
            now = time.monotonic()
            if playing:
                wanted = replace(wanted, time=wanted.time + wanted.speed * (now - before))
            before = now
            for kind, values in commands:
                try:
                    wanted = changed(wanted, self._newest.scenario, kind, values)
                except ConfigError as error:
                    message = str(error)
            if must_draw or message or wanted != self._settings:
                self._draw(wanted, message)
            if playing and not self._newest.watched:
                time.sleep(_IDLE)

    def _draw(self, wanted: WebSettings, message: str) -> None:
        """Show the settings; where they cannot be shown, stay with the last ones and say why."""
        last, self._settings = self._settings, wanted
        try:
            state = self._state()
        except ConfigError as error:
            self._settings, message = replace(last, playing=False), str(error)
            state = self._state()
        self._show(state, message)

    def _state(self) -> SceneState:
        return chosen_state(self._newest.scenario, self._settings)

    def _show(self, state: SceneState, message: str) -> None:
        images = {}
        for camera, products in self._wanted_products().items():
            try:
                images[camera] = self._captured(state, camera, products)
            except ConfigError as error:
                message = str(error)
        statistics = [["Images drawn", str(self._frames)]]
        status = {
            "settings": self._settings.as_json(),
            "passes_ms": {name: 1e3 * seconds for name, seconds in self._passes.items()},
            "statistics": statistics,
            "message": message,
        }
        self._newest.publish(Snapshot(state=state, images=images, status=status))

    def _wanted_products(self) -> dict[str, frozenset[Product]]:
        """Products of the cameras that viewers watch; of the first one before anybody does."""
        watched = self._newest.watched
        cameras = self._newest.scenario.cameras
        if not watched:
            return dict.fromkeys(list(cameras)[:1], _ALWAYS)
        products = {}
        for name in sorted({camera for camera, _ in watched if camera in cameras}):
            layers = any(c == name and shown not in _PLANES for c, shown in watched)
            products[name] = _ALWAYS | {Product.LAYERS} if layers else _ALWAYS
        return products

    def _captured(
        self, state: SceneState, camera: str, products: frozenset[Product]
    ) -> CameraImages:
        self._simulator.timer.seconds.clear()
        start = time.perf_counter()
        capture = self._simulator.capture(state, camera, products)
        seconds = time.perf_counter() - start
        self._passes = dict(self._simulator.timer.seconds)
        self._frames += 1
        return images_of(capture, seconds)
