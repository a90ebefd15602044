"""SPICE meta-kernels: states and attitudes, sampled when the scenario is read.

The kernels are read in a process of their own (``spice_process``). Every second sample checks the
curve through the others, so that the interpolation error is measured, not estimated.
"""

from __future__ import annotations

import importlib.util
import io
import json
import re
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import NoReturn

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import AnyArray, Array, IndexArray
from simgl.errors import ConfigError
from simgl.motion.files.text_lines import text_of
from simgl.motion.samples import Path as SampledPath
from simgl.motion.samples import SampledRotations, SampledStates
from simgl.physics.ephemeris import utc_from_tai_ns

VERSION_KEY = "KPL/MK"
# Around the epoch [s]: exposures begin before it, a day of a low orbit is 15 revolutions.
DEFAULT_SPAN = (-600.0, 86_400.0)
_PROCESS = Path(__file__).with_name("spice_process.py")
_FIRST_STEP_NS = 60_000_000_000
_MIN_STEP_NS = 500_000_000
# Aims of the step; a curve worse than the limits is refused.
_AIM_M = 1e-3
_AIM_RAD = 5e-6
_MAX_RAD = 1e-4
_MAX_SAMPLES = 1_000_000
_TIMEOUT_S = 300.0


@dataclass(frozen=True, kw_only=True)
class SpiceSource:
    """A meta-kernel, and when it is wanted.

    span_s : first and last instant, from the epoch [s]

    Raises AssetError for an unreadable file, ConfigError for one that is no meta-kernel.
    """

    path: Path
    epoch_tai_ns: int
    span_s: tuple[float, float]

    def __post_init__(self) -> None:
        if not text_of(self.path).startswith(VERSION_KEY):
            self.fail(f"is not a SPICE meta-kernel ({VERSION_KEY}); naif_id and frame require one")

    def fail(self, problem: str) -> NoReturn:
        """Raise ConfigError about the file."""
        raise ConfigError(str(self.path), "", problem)

    @property
    def span_ns(self) -> tuple[int, int]:
        """First and last instant [TAI ns]."""
        first, last = (self.epoch_tai_ns + round(s * 1e9) for s in self.span_s)
        return first, last


@dataclass(frozen=True, kw_only=True, eq=False)
class _Samples:
    """One interval without a gap.

    tai_ns : (n,) times, half a step apart but for the last
    rows : (n, 6) states or (n, 9) rotations
    """

    tai_ns: IndexArray
    rows: Array

    @property
    def nodes(self) -> IndexArray:
        """Indices of the samples that the curve runs through: every second one and the last."""
        count = len(self.tai_ns)
        return np.unique([*range(0, count, 2), count - 1])

    @property
    def checks(self) -> list[int]:
        """Indices of the others."""
        return sorted(set(range(len(self.tai_ns))) - set(self.nodes.tolist()))


def read_spice_path(source: SpiceSource, body: int, allowed_error: float) -> SampledPath:
    """The trajectory of a body about the Earth.

    body : NAIF's number
    allowed_error : largest interpolation error [m]

    Raises ConfigError that names file, body and time.
    """
    what = f"naif_id {body}"
    step = _FIRST_STEP_NS
    while True:
        samples = _samples(source, what, body, None, step)
        label = f"{source.path}: {what}"
        segments = tuple(_states(one, step, label) for one in samples)
        error = max(_position_error(s, one) for s, one in zip(segments, samples, strict=True))
        if error <= min(_AIM_M, allowed_error):
            return SampledPath(source=label, segments=segments)
        if step // 2 < _MIN_STEP_NS:
            if error <= allowed_error:
                return SampledPath(source=label, segments=segments)
            problem = f"moves {what} too unevenly for samples {step * 1e-9:g} s apart: the curve is"
            allowed = f"(interpolation_error_m allows {allowed_error:g} m)"
            source.fail(f"{problem} off by {error:.3g} m {allowed}")
        step //= 2


def read_spice_rotations(source: SpiceSource, frame: str) -> SampledRotations:
    """The attitude of a frame; raises ConfigError that names file, frame and time."""
    what = f'frame "{frame}"'
    step = _FIRST_STEP_NS
    while True:
        samples = _samples(source, what, None, frame, step)
        first = [one.tai_ns[one.nodes] for one in samples]
        rotations = SampledRotations(
            source=f"{source.path}: {what}",
            tai_ns=np.concatenate(first),
            q_reference_from_body_xyzw=np.concatenate([_quaternions(one) for one in samples]),
            longest_gap_ns=step,
        )
        gaps = [int(b[0] - a[-1]) for a, b in pairwise(first)]
        error = _angle_error(rotations, samples)
        if error <= _AIM_RAD and min(gaps, default=step + 1) > step:
            return rotations
        if step // 2 < _MIN_STEP_NS:
            if error <= _MAX_RAD:
                return rotations
            problem = f"turns {what} too unevenly for samples {step * 1e-9:g} s apart: the curve is"
            source.fail(f"{problem} off by {np.degrees(error):.2g} deg")
        step //= 2


def _states(samples: _Samples, step: int, label: str) -> SampledStates:
    nodes = samples.nodes
    times = samples.tai_ns[nodes]
    return SampledStates(
        source=label,
        tai_ns=times,
        positions=samples.rows[nodes, :3],
        velocities=samples.rows[nodes, 3:],
        longest_gap_ns=step,
        span_ns=(int(times[0]), int(times[-1])),
    )


def _position_error(states: SampledStates, samples: _Samples) -> float:
    """Largest distance between curve and kernel at the samples in between [m]."""
    off = [states.state(int(samples.tai_ns[i]))[0] - samples.rows[i, :3] for i in samples.checks]
    return max((float(np.linalg.norm(one)) for one in off), default=0.0)


def _quaternions(samples: _Samples) -> Array:
    return Rotation.from_matrix(samples.rows[samples.nodes].reshape(-1, 3, 3)).as_quat()


def _angle_error(rotations: SampledRotations, samples: list[_Samples]) -> float:
    """Largest angle between curve and kernel at the samples in between [rad]."""
    checks = [(int(one.tai_ns[i]), one.rows[i]) for one in samples for i in one.checks]
    if not checks:
        return 0.0
    curve = np.stack([rotations.matrix(when) for when, _ in checks])
    kernel = np.stack([row.reshape(3, 3) for _, row in checks])
    turns = Rotation.from_matrix(curve).inv() * Rotation.from_matrix(kernel)
    return float(np.max(turns.magnitude()))


def _samples(
    source: SpiceSource, what: str, body: int | None, frame: str | None, step: int
) -> list[_Samples]:
    first, last = source.span_ns
    if (last - first) // (step // 2) > _MAX_SAMPLES:
        seconds = (last - first) * 1e-9
        source.fail(f"must be sampled each {step * 1e-9:g} s; span_s is too long ({seconds:g} s)")
    request = {
        "meta_kernel": source.path.name,
        "body": body,
        "frame": frame,
        "first_ns": first,
        "last_ns": last,
        "step_ns": step // 2,
    }
    arrays = _asked(source, what, request)
    if not len(arrays["times"]):
        spans = [" to ".join(utc_from_tai_ns(int(t)) for t in one) for one in arrays["covered"]]
        wanted = f"{utc_from_tai_ns(first)} to {utc_from_tai_ns(last)}"
        source.fail(f"covers {what} from {', '.join(spans[:3])}, not in span_s, {wanted}")
    cuts = np.cumsum(arrays["counts"])[:-1]
    times, rows = np.split(arrays["times"], cuts), np.split(arrays["rows"], cuts)
    return [_Samples(tai_ns=t, rows=r) for t, r in zip(times, rows, strict=True)]


def _asked(source: SpiceSource, what: str, request: Mapping[str, object]) -> dict[str, AnyArray]:
    if importlib.util.find_spec("spiceypy") is None:
        source.fail('is a SPICE meta-kernel, which needs SpiceyPy: pip install "simgl[spice]"')
    try:
        # Paths in the meta-kernel start from its folder, wherever the program runs.
        done = subprocess.run(
            [sys.executable, "-P", str(_PROCESS)],
            input=json.dumps(request).encode(),
            cwd=source.path.parent,
            capture_output=True,
            timeout=_TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        source.fail(f"gave no samples of {what} within {_TIMEOUT_S:g} s; shorten span_s")
    if done.returncode == 3:
        problem = str(json.loads(done.stdout)["problem"])
        when = re.search(r"\{(-?\d+)\}", problem)
        if when:
            problem = problem.replace(when[0], f"{utc_from_tai_ns(int(when[1]))} for {what}")
        source.fail(problem)
    if done.returncode != 0:
        reason = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
        source.fail(f"could not be read by SPICE: {' '.join(reason)}")
    with np.load(io.BytesIO(done.stdout)) as arrays:
        return {name: arrays[name] for name in arrays.files}
