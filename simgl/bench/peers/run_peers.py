"""Each renderer in a process of its own, and how its image differs from simgl's."""

from __future__ import annotations

import statistics
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from simgl.arrays import Array
from simgl.bench.child_process import ChildError, seconds_of
from simgl.bench.results import ImageDifference, PeerResult
from simgl.decoded_files import arrays_in
from simgl.errors import AssetError
from simgl.input_files import read_file
from simgl.progress import ProgressCallback, begin_stage

# Of one renderer with all its frames [s].
_LIMIT_S = 600.0
# Processes of pyrender at simgl's size, whose time is f: frames agree within one of them, and
# differ by 30 % from one process to the next.
_BEFORE_SCENES, _AFTER_SCENES = 2, 3
_GAMMA = 2.2


@dataclass(frozen=True, kw_only=True)
class Peer:
    """A renderer; its program is ``NAME_frames.py``.

    package : what ``pip install`` calls it
    module : what it is imported as
    frames : so many that the median is steady, so few that the slowest takes a minute
    sizes : of the images; the first is simgl's
    """

    name: str
    package: str
    module: str
    frames: int
    sizes: tuple[tuple[int, int], ...] = ((600, 600),)


PEERS = (
    Peer(
        name="pyrender",
        package="pyrender",
        module="pyrender",
        frames=20,
        sizes=((600, 600), (1280, 960)),
    ),
    Peer(name="mitsuba", package="mitsuba", module="mitsuba", frames=3),
    Peer(name="cycles", package="bpy", module="bpy", frames=1),
)


def time_before_scenes(python: str, progress: ProgressCallback) -> list[float]:
    """Medians of the first processes of pyrender [s]; none where it fails, as ``time_peers`` will
    tell."""
    pyrender = PEERS[0]
    with tempfile.TemporaryDirectory(prefix="simgl-bench-") as folder:
        scene = Path(folder, "scene.npz")
        begin_stage(progress, "f, before the scenes")
        try:
            seconds_of(_scene_command(scene), _LIMIT_S)
            return [
                _result(python, pyrender, pyrender.sizes[0], scene).seconds
                for _ in range(_BEFORE_SCENES)
            ]
        except (ChildError, AssetError, ValueError):
            return []


def time_peers(
    python: str, progress: ProgressCallback, before_s: Sequence[float] = ()
) -> tuple[list[PeerResult], dict[str, str]]:
    """Results of the renderers that an interpreter has, and of the others why there is none.

    before_s : ``time_before_scenes``
    """
    results: list[PeerResult] = []
    absent: dict[str, str] = {}
    with tempfile.TemporaryDirectory(prefix="simgl-bench-") as folder:
        scene = Path(folder, "scene.npz")
        begin_stage(progress, "the scene of other renderers")
        try:
            seconds_of(_scene_command(scene), _LIMIT_S)
        except ChildError as error:
            return [], {peer.name: f"no scene for it: {error}" for peer in PEERS}
        for peer in PEERS:
            if not _installed(python, peer.module):
                absent[peer.name] = f"{python} -m pip install {peer.package}"
                continue
            try:
                for size in peer.sizes:
                    begin_stage(progress, f"{peer.name}, {size[0]} x {size[1]}")
                    result = _result(python, peer, size, scene)
                    if peer is PEERS[0] and size == peer.sizes[0]:
                        result = _over_processes(python, result, scene, before_s)
                    results.append(result)
            except (ChildError, AssetError, ValueError) as error:
                absent[peer.name] = str(error)
    return results, absent


def _scene_command(scene: Path) -> list[str]:
    return [sys.executable, "-m", "simgl.bench.peers.peer_scene", str(scene)]


def _over_processes(
    python: str, first: PeerResult, scene: Path, before_s: Sequence[float]
) -> PeerResult:
    """pyrender's result with the times of further processes."""
    size = first.width, first.height
    later = [_result(python, PEERS[0], size, scene).seconds for _ in range(1, _AFTER_SCENES)]
    seconds = [*before_s, first.seconds, *later]
    return msgspec.structs.replace(
        first, seconds=round(statistics.median(seconds), 4), process_seconds=seconds
    )


def _installed(python: str, module: str) -> bool:
    """Looked up, not imported: bpy takes a second and pyrender wants a display at its import."""
    code = f"import importlib.util, sys; sys.exit(importlib.util.find_spec({module!r}) is None)"
    try:
        seconds_of([python, "-c", code], _LIMIT_S)
    except ChildError:
        return False
    return True


def _result(python: str, peer: Peer, size: tuple[int, int], scene: Path) -> PeerResult:
    out = scene.with_name(f"{peer.name}.npz")
    program = Path(__file__).with_name(f"{peer.name}_frames.py")
    words = (str(scene), str(out), *(str(n) for n in (*size, peer.frames)))
    seconds_of([python, str(program), *words], _LIMIT_S)
    frames, simgl = arrays_in(read_file(out)), arrays_in(read_file(scene))["simgl"]
    width, height = size
    image = frames["image"]
    return PeerResult(
        name=peer.name,
        version=str(frames["version"]),
        width=width,
        height=height,
        frames=peer.frames,
        seconds=round(statistics.median(frames["seconds"].tolist()), 4),
        difference=image_difference(image, simgl) if image.shape == simgl.shape else None,
    )


def image_difference(image: Array, simgl: Array) -> ImageDifference:
    """Two linear images compared as they look: at the same mean, each value through one curve.

    Only pixels that simgl's image shows count; a black sky agrees in any renderer.
    """
    seen = simgl > 0.0
    first, second = (_tone(a[seen] / a[seen].mean()) for a in (image, simgl))
    return ImageDifference(
        rms=round(float(np.sqrt(np.mean((first - second) ** 2))), 4),
        correlation=round(float(np.corrcoef(first, second)[0, 1]), 5),
    )


def _tone(relative: Array) -> Array:
    """From light relative to the mean to 0 to 1, as a display shows it: white is three means."""
    return np.clip(relative / 3.0, 0.0, 1.0) ** (1.0 / _GAMMA)
