"""What a benchmark found, as data; ``goals.results_document`` writes it, with the goals."""

from __future__ import annotations

from pathlib import Path

import msgspec

from simgl.errors import ConfigError
from simgl.input_files import read_file


class FrameTimes(msgspec.Struct, frozen=True, kw_only=True):
    """Percentiles, mean and worst of the frame time [ms].

    Tables that are recomputed now and then show in the mean and the worst, hardly in the median.
    """

    p50: float
    p95: float
    p99: float
    mean: float
    worst: float

    @property
    def steadiness(self) -> float:
        """p99 over p50: what a loop must allow for."""
        return self.p99 / self.p50


class Memory(msgspec.Struct, frozen=True, kw_only=True):
    """Resident memory of the process that renders one scene [MB]: at most, and after its frames."""

    peak: float
    steady: float


class SceneResult(msgspec.Struct, frozen=True, kw_only=True):
    """One scene, in process or through the bridge.

    captures : of each frame, all of one state
    step_s : from frame to frame in the scene's time [s]
    passes_ms : medians
    round_p50_ms, round_passes_ms : medians of consecutive rounds, whose spread is the noise of a
        comparison
    first_frame_s : from the start of the process to its first DN; None through the bridge
    """

    name: str
    width: int
    height: int
    triangles: int
    frames: int
    step_s: float
    frame_ms: FrameTimes
    through_bridge: bool
    passes_ms: dict[str, float]
    captures: int = 1
    round_p50_ms: list[float] = []
    round_passes_ms: dict[str, list[float]] = {}
    first_frame_s: float | None = None
    memory_mb: Memory | None = None


class TableResult(msgspec.Struct, frozen=True, kw_only=True):
    """A look-up table or texture of the Earth: size on the GPU, and time to compute it."""

    name: str
    bytes: int
    seconds: float


class StartUp(msgspec.Struct, frozen=True, kw_only=True):
    """Seconds from the start of a process to its end; None where that was not measured.

    help : ``simgl --help``, median
    warm : the first DN of source_600, with the caches of an earlier process, median
    cold : the same with an empty cache folder
    """

    help: float | None = None
    warm: float | None = None
    cold: float | None = None


class ImageDifference(msgspec.Struct, frozen=True, kw_only=True):
    """How another renderer's image differs from simgl's, both at the same mean and tone.

    rms : of values from 0 to 1, over the pixels of the spacecraft
    """

    rms: float
    correlation: float


class PeerResult(msgspec.Struct, frozen=True, kw_only=True):
    """Another renderer on the target of source_600 before a black sky.

    seconds : of a frame, median; of several processes the median of theirs
    process_seconds : of each process, where there were several
    difference : None at a size where simgl's image was not made
    """

    name: str
    version: str
    width: int
    height: int
    frames: int
    seconds: float
    process_seconds: list[float] = []
    difference: ImageDifference | None = None


class Results(msgspec.Struct, frozen=True, kw_only=True):
    """A run of the benchmark; ``tables`` is empty where scenes were chosen.

    failed : scenes, or kinds of start, with the reason
    absent_peers : renderers that gave no time, with the reason
    """

    machine: str
    renderer: str
    version: str
    scenes: list[SceneResult]
    tables: list[TableResult]
    start_up: StartUp = StartUp()
    peers: list[PeerResult] = []
    absent_peers: dict[str, str] = {}
    failed: dict[str, str] = {}

    def scene(
        self, name: str, step_s: float | None = None, *, bridge: bool = False
    ) -> SceneResult | None:
        """The result of a scene, at a step [s] if one is given; None if it was not timed."""
        for result in self.scenes:
            if (result.name, result.through_bridge) == (name, bridge) and (
                step_s is None or result.step_s == step_s
            ):
                return result
        return None


def read_results(path: Path) -> Results:
    """Results of an earlier run, also of a version that measured less.

    Raises ConfigError for a file that holds no such results.
    """
    try:
        return msgspec.json.decode(read_file(path), type=Results)
    except msgspec.DecodeError as error:
        raise ConfigError(str(path), "results of simgl bench", str(error)) from None
