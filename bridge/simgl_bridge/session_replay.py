"""Recorded sessions rendered again: the same bytes, or what differs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from simgl.arrays import AnyArray
from simgl.errors import AssetError, ConfigError, SimglError
from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator
from simgl_bridge.hashes import plane_hash, scene_hash, shown_state_hash
from simgl_bridge.message_parts import CameraImage
from simgl_bridge.render_request import RenderedImages, reach_temperatures, render_images
from simgl_bridge.render_session import RenderSession
from simgl_bridge.session_recording import SUFFIX, Answered, Configured, SessionFile

Say = Callable[[str], None]


@dataclass
class Replayed:
    """How many replies were rendered again, and how many of them differ."""

    frames: int = 0
    different: int = 0


def session_files(path: Path) -> list[Path]:
    """The recorded sessions in a folder, the oldest first; of a file that file."""
    if not path.is_dir():
        return [path]
    sessions = sorted(path.glob(f"*{SUFFIX}"))
    if not sessions:
        raise AssetError(f"{path}: holds no recorded session (*{SUFFIX})")
    return sessions


def replay_session(
    path: Path,
    *,
    scenario: Path | None = None,
    root: Path | None = None,
    changed: bool = False,
    every: int = 1,
    open_simulator: Callable[[Scenario], Simulator] = Simulator,
    say: Say = print,
) -> Replayed:
    """Render the requests of a session again and compare each image with the recorded one.

    scenario, root : where they have moved; None takes the recorded places
    changed : replay also where the content of the scenario is another one
    every : render only every n-th reply
    say : gets a line for each difference

    Raises ConfigError for a scenario of other content, and AssetError where the recording is
    damaged or files are missing.
    """
    session = SessionFile(path)
    opened = session.opened
    if scenario is None and opened.scenario_file is None:
        raise ConfigError("simgl replay", "SCENARIO", "is missing; the recording names no file")
    source = Path(opened.scenario_file or "") if scenario is None else scenario
    if root is None and opened.root is not None:
        root = Path(opened.root)
    loaded = replace(load_scenario(source, root=root), seed=opened.seed)
    result = Replayed()
    with RenderSession(loaded, root=root, open_simulator=open_simulator) as renderer:
        if renderer.renderer_name != opened.renderer:
            say(f"{path}: was recorded on {opened.renderer}, now on {renderer.renderer_name}")

        def check(recorded: str, name: str) -> None:
            now = scene_hash(renderer.scenario)
            if not changed and now != recorded:
                raise _changed(name, now, recorded)

        check(opened.scene_hash, str(source))
        chosen: str | None = None
        answered = 0
        for record, planes in session.records():
            if isinstance(record, Configured):
                name = record.scenario if record.scenario != chosen else None
                renderer.configure(name, record.seed)
                chosen = record.scenario
                check(record.scene_hash, chosen or str(source))
            elif isinstance(record, Answered):
                answered += 1
                if (answered - 1) % every:
                    # Later requests may go on from its temperatures.
                    reach_temperatures(renderer, record.request)
                    continue
                differences = list(_differences(renderer, record, planes))
                result.frames += 1
                result.different += bool(differences)
                for difference in differences:
                    say(f"frame {answered}, state {record.state_hash}: {difference}")
    if session.ignored:
        say(f"{path}: the last {session.ignored} bytes are not a complete record and are ignored")
    return result


def _changed(name: str, now: str, recorded: str) -> ConfigError:
    problem = f"has changed since: its content had the hash {recorded}, and has {now} now"
    return ConfigError(name, "", f"{problem}; --changed replays it all the same")


def _differences(renderer: RenderSession, record: Answered, planes: bytes) -> Iterator[str]:
    """What a reply holds now that it did not hold then, a line for each."""
    try:
        rendered = render_images(renderer, record.request)
    except SimglError as error:
        yield f"cannot be rendered: {error}"
        return
    state = shown_state_hash(record.request, rendered.images, renderer.scenario.seed)
    if state != record.state_hash:
        yield f"the state has the hash {state}"
    if rendered.bodies != record.bodies:
        names = [n for n, pose in rendered.bodies.items() if pose != record.bodies.get(n)]
        yield f"other poses of {', '.join(names) or 'missing spacecraft'}"
    for now, then in zip(rendered.images, record.images, strict=True):
        fields = [f for f in CameraImage.__struct_fields__ if f not in ("render_us", "planes")]
        for field in fields:
            new, old = getattr(now, field), getattr(then, field)
            if new != old:
                yield f'camera "{now.camera}" {field} is {new}, recorded {old}'
    yield from _plane_differences(rendered, record, planes)


def _plane_differences(rendered: RenderedImages, record: Answered, planes: bytes) -> Iterator[str]:
    offset = 0
    names = [(i.camera, plane.product) for i in rendered.images for plane in i.planes]
    for (camera, product), pixels, recorded in zip(
        names, rendered.pixels, record.plane_hashes, strict=True
    ):
        now = plane_hash(memoryview(pixels.data).cast("B"))
        if now != recorded:
            difference = f'camera "{camera}" {product} has the hash {now}, recorded {recorded}'
            then = planes[offset : offset + pixels.nbytes]
            yield f"{difference}{_by_how_much(pixels, then)}"
        offset += pixels.nbytes


def _by_how_much(now: AnyArray, planes: bytes) -> str:
    """How many values differ and by how much, where the planes were recorded."""
    if len(planes) != now.nbytes:
        return ""
    then = np.frombuffer(planes, dtype=now.dtype).reshape(now.shape)
    differing = now != then
    # Background has an infinite depth.
    with np.errstate(invalid="ignore"):
        largest = np.nanmax(np.abs(now[differing].astype(np.float64) - then[differing]))
    return f" ({np.count_nonzero(differing)} of {now.size} values, by up to {largest:g})"
