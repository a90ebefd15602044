"""The shipped benchmark scenes, what a frame of each captures, and named sets of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from simgl import assets
from simgl.errors import ConfigError, did_you_mean

# Names of a scenario's cameras and a frame's number -> the cameras that capture its state.
CaptureCameras = Callable[[Sequence[str], int], Sequence[str]]


def _first(cameras: Sequence[str], frame: int) -> Sequence[str]:  # noqa: ARG001
    return cameras[:1]


def _every(cameras: Sequence[str], frame: int) -> Sequence[str]:  # noqa: ARG001
    return cameras


def _second(cameras: Sequence[str], frame: int) -> Sequence[str]:  # noqa: ARG001
    return cameras[1:2]


def _in_turn(cameras: Sequence[str], frame: int) -> Sequence[str]:
    return [cameras[frame % len(cameras)]]


@dataclass(frozen=True, kw_only=True)
class BenchScene:
    """A scenario file, and which of its cameras capture each state."""

    name: str
    path: Path
    cameras: CaptureCameras = _first

    @property
    def linked(self) -> bool:
        """Whether links, which know one camera, can time it."""
        return self.cameras is _first


@dataclass(frozen=True, kw_only=True)
class TimedScene:
    """A scene of a set.

    step_s : from frame to frame in the scene's time [s]
    linked : also through the bridge
    """

    scene: str
    step_s: float
    linked: bool = True


@dataclass(frozen=True, kw_only=True)
class BenchSet:
    """What ``simgl bench --set NAME`` measures.

    starts : kinds of start, of the fields of ``StartUp``
    """

    scenes: tuple[TimedScene, ...]
    starts: tuple[str, ...] = ()
    earth_tables: bool = False
    peers: bool = False

    def with_step(self, step_s: float) -> BenchSet:
        """The same with so many seconds from frame to frame in every scene."""
        scenes = tuple(replace(timed, step_s=step_s) for timed in self.scenes)
        return replace(self, scenes=scenes)


def scene_files() -> dict[str, Path]:
    """The shipped scenario files by name."""
    return {p.stem: p for p in sorted((assets.data() / "bench").glob("*.toml"))}


def bench_scenes() -> dict[str, BenchScene]:
    """The shipped scenes by name: one of each file, captured by its first camera.

    ``four_cameras`` captures each state by all of them, ``one_of_four`` by the next in turn;
    ``visible_640`` is ``thermal_640`` by its other camera, for visible light.
    """
    files = scene_files()
    scenes = {name: BenchScene(name=name, path=path) for name, path in files.items()}
    for name, cameras in {"four_cameras": _every, "one_of_four": _in_turn}.items():
        scenes[name] = BenchScene(name=name, path=files["four_cameras"], cameras=cameras)
    path = files["thermal_640"]
    scenes["visible_640"] = BenchScene(name="visible_640", path=path, cameras=_second)
    return scenes


def _at(step_s: float, *names: str, linked: bool = True) -> tuple[TimedScene, ...]:
    return tuple(TimedScene(scene=name, step_s=step_s, linked=linked) for name in names)


# Steps: an orbit sampled every second, in which light and shadow change, and a loop of 10 Hz.
SETS = {
    "short": BenchSet(
        scenes=_at(1.0, "source_600", "earth_1280", "camera_1280", "bay_1280", "docking_20m"),
        starts=("help", "warm"),
        earth_tables=True,
    ),
    "goals": BenchSet(
        scenes=(
            *_at(0.1, "source_600"),
            *_at(1.0, "source_600", linked=False),
            *_at(0.1, "earth_1280", "camera_1280", "colour_1280", "bay_1280", linked=False),
            *_at(0.1, "docking_20m", "docking_3m", "arm_800", linked=False),
            *_at(0.1, "one_of_four", "four_cameras", "stars_600", linked=False),
        ),
        starts=("help", "warm", "cold"),
        peers=True,
    ),
    "gpu": BenchSet(
        scenes=(
            *_at(0.1, "source_600"),
            *_at(0.1, "earth_1280", "camera_1280", "bay_1280", linked=False),
            *_at(0.1, "square_2048", "reference_1280", "four_cameras", linked=False),
            *_at(0.1, "docking_20m", "docking_3m", linked=False),
        ),
        starts=("help", "warm", "cold"),
    ),
    "peers": BenchSet(scenes=_at(0.1, "source_600", linked=False), peers=True),
    "full": BenchSet(
        scenes=_at(0.1, *sorted({*scene_files(), "one_of_four", "visible_640"})),
        starts=("help", "warm", "cold"),
        earth_tables=True,
        peers=True,
    ),
}
DEFAULT_SET = "short"


def chosen_set(name: str) -> BenchSet:
    """A set by name; raises ConfigError for another name."""
    if name not in SETS:
        problem = f'names no set: "{name}"; {did_you_mean(name, SETS)}'
        raise ConfigError("command line", "--set", problem)
    return SETS[name]


def set_of_scenes(names: Sequence[str]) -> BenchSet:
    """Only these scenes, 1 s from frame to frame; raises ConfigError for an unknown one."""
    scenes = bench_scenes()
    for name in names:
        if name not in scenes:
            problem = f'names no scene: "{name}"; {did_you_mean(name, scenes)}'
            raise ConfigError("command line", "--scene", problem)
    return BenchSet(scenes=_at(1.0, *names))
