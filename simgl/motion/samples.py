"""Interpolation between samples: positions by polynomials, attitudes by slerp, angles linearly.

Gaps in the samples are not bridged. The interpolation error is estimated from the samples.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy
from scipy.spatial.transform import Rotation, Slerp

from simgl.arrays import Array, IndexArray
from simgl.errors import ConfigError
from simgl.physics.ephemeris import utc_from_tai_ns

# Conditions of one polynomial: degree 7, as CCSDS messages advise.
_CONDITIONS = 8
# A step longer than this many median steps is a gap by default.
GAP_STEPS = 5.0
# Largest number of samples that are left out in turn to estimate the error.
_ERROR_SAMPLES = 200


def default_gap_ns(tai_ns: IndexArray) -> int:
    """Default of the longest step that is not a gap [ns].

    tai_ns : (n,) times of the samples
    """
    return int(GAP_STEPS * float(np.median(np.diff(tai_ns)))) if len(tai_ns) > 1 else 0


def check_span(span_ns: tuple[int, int], when: int, source: str) -> None:
    """Raise ConfigError for an instant outside a time span."""
    if not span_ns[0] <= when <= span_ns[1]:
        first, last = (utc_from_tai_ns(end) for end in span_ns)
        raise ConfigError(source, "", f"covers {first} to {last}, not {utc_from_tai_ns(when)}")


def bracket(tai_ns: IndexArray, when: int, longest_gap_ns: int, source: str) -> int:
    """Index of the last sample at or before an instant.

    Raises ConfigError outside the samples and in a gap.
    """
    check_span((int(tai_ns[0]), int(tai_ns[-1])), when, source)
    index = int(np.searchsorted(tai_ns, when, side="right")) - 1
    if tai_ns[index] != when:
        step = int(tai_ns[index + 1] - tai_ns[index])
        if step > longest_gap_ns:
            ends = " to ".join(utc_from_tai_ns(int(t)) for t in tai_ns[index : index + 2])
            allowed = f"longest_gap_s allows {longest_gap_ns * 1e-9:g} s"
            raise ConfigError(source, "", f"has a gap from {ends} ({step * 1e-9:g} s; {allowed})")
    return index


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledStates:
    """A trajectory through samples.

    source : file and object, for error messages
    tai_ns : (n,) increasing
    positions : (n, 3) [m]
    velocities : (n, 3) [m s-1], or None
    longest_gap_ns : a longer step between samples is a gap
    span_ns : first and last instant for which the samples are valid
    """

    source: str = field(compare=False)
    tai_ns: IndexArray
    positions: Array
    velocities: Array | None
    longest_gap_ns: int
    span_ns: tuple[int, int]

    def state(self, tai_ns: int) -> tuple[Array, Array]:
        """Position [m] and velocity [m s-1], (3,); ConfigError outside the samples and in gaps."""
        check_span(self.span_ns, tai_ns, self.source)
        index = bracket(self.tai_ns, tai_ns, self.longest_gap_ns, self.source)
        return self._through(self._neighbours(index), tai_ns)

    @property
    def _reach(self) -> int:
        """Number of samples on either side of the instant."""
        return _CONDITIONS // (2 if self.velocities is None else 4)

    def _neighbours(self, index: int) -> IndexArray:
        """Indices of the samples around the step after ``index``, none from beyond a gap."""
        count, last = 2 * self._reach, len(self.tai_ns) - 1
        # At an end of the data, more samples are taken from the other side.
        first = max(min(index - self._reach + 1, last - count + 1), 0)
        return self._without_gaps(first, min(first + count - 1, last), index)

    def _without_gaps(self, first: int, last: int, index: int) -> IndexArray:
        gaps = np.flatnonzero(np.diff(self.tai_ns[first : last + 1]) > self.longest_gap_ns) + first
        first = max([first, *(int(gap) + 1 for gap in gaps if gap < index)])
        last = min([last, *(int(gap) for gap in gaps if gap >= index)])
        return np.arange(first, last + 1)

    def _through(self, nodes: IndexArray, tai_ns: int) -> tuple[Array, Array]:
        seconds = (self.tai_ns[nodes] - tai_ns) * 1e-9
        scale = max(float(np.ptp(seconds)), 1e-9)
        values = self.positions[nodes]
        if self.velocities is None:
            curve = scipy.interpolate.KroghInterpolator(seconds / scale, values)
        else:
            # The second value of a repeated node is the derivative.
            both = np.stack([values, self.velocities[nodes] * scale], axis=1)
            curve = scipy.interpolate.KroghInterpolator(
                np.repeat(seconds / scale, 2), both.reshape(-1, 3)
            )
        value, slope = curve.derivatives(0.0, 2) if len(curve.xi) > 1 else (values[0], np.zeros(3))
        return value, slope / scale

    @cached_property
    def interpolation_error(self) -> float:
        """Upper estimate of the interpolation error for smooth motion [m].

        The largest error at samples that are left out in turn. The error of a polynomial is
        proportional to the product of the distances to its nodes. With velocities (four double
        nodes) that product is at least 18 times larger at the sample left out than anywhere between
        samples; without velocities (eight nodes) it may be equal near the ends.
        """
        inner = np.arange(1, len(self.tai_ns) - 1)
        worst = 0.0
        for index in inner[:: max(len(inner) // _ERROR_SAMPLES, 1)].tolist():
            ends = max(index - self._reach, 0), min(index + self._reach, len(self.tai_ns) - 1)
            nodes = self._without_gaps(*ends, index)
            nodes = nodes[nodes != index]
            if len(nodes) < 2 or not nodes[0] < index < nodes[-1]:
                continue
            position, _ = self._through(nodes, int(self.tai_ns[index]))
            worst = max(worst, float(np.linalg.norm(position - self.positions[index])))
        return worst / (1.0 if self.velocities is None else 18.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Path:
    """A trajectory of separately interpolated segments; of two that overlap, the later one counts.

    segments : in order of their start
    """

    source: str = field(compare=False)
    segments: tuple[SampledStates, ...]

    def state(self, tai_ns: int) -> tuple[Array, Array]:
        """Position [m] and velocity [m s-1], (3,); ConfigError outside the samples and in gaps."""
        for segment in reversed(self.segments):
            if segment.span_ns[0] <= tai_ns <= segment.span_ns[1]:
                return segment.state(tai_ns)
        spans = (self.segments[0].span_ns[0], max(s.span_ns[1] for s in self.segments))
        check_span(spans, tai_ns, self.source)
        problem = f"has a gap between its segments at {utc_from_tai_ns(tai_ns)}"
        raise ConfigError(self.source, "", problem)

    @property
    def interpolation_error(self) -> float:
        """The largest of the segments [m]."""
        return max(segment.interpolation_error for segment in self.segments)


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledAngles:
    """Joint values through samples, linear in between.

    source : file, for error messages
    tai_ns : (n,) increasing
    names : of the joints
    angles : (n, joints) angles of hinges [rad], travels of rails [m]
    slides : names of the rails
    longest_gap_ns : a longer step between samples is a gap
    """

    source: str = field(compare=False)
    tai_ns: IndexArray
    names: tuple[str, ...]
    angles: Array
    slides: frozenset[str]
    longest_gap_ns: int

    def at(self, tai_ns: int) -> dict[str, float]:
        """Name to angle [rad] or travel [m]; ConfigError outside the samples and in gaps."""
        index = bracket(self.tai_ns, tai_ns, self.longest_gap_ns, self.source)
        after = min(index + 1, len(self.tai_ns) - 1)
        step = max(int(self.tai_ns[after] - self.tai_ns[index]), 1)
        share = (tai_ns - int(self.tai_ns[index])) / step
        values = self.angles[index] + share * (self.angles[after] - self.angles[index])
        return dict(zip(self.names, values.tolist(), strict=True))


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledRotations:
    """An attitude through samples, with a constant rate between two of them (slerp).

    source : file and object, for error messages
    tai_ns : (n,) increasing
    q_reference_from_body_xyzw : (n, 4) unit quaternions
    longest_gap_ns : a longer step between samples is a gap
    """

    source: str = field(compare=False)
    tai_ns: IndexArray
    q_reference_from_body_xyzw: Array
    longest_gap_ns: int

    def matrix(self, tai_ns: int) -> Array:
        """R_reference_from_body; ConfigError outside the samples and in gaps."""
        index = bracket(self.tai_ns, tai_ns, self.longest_gap_ns, self.source)
        pair = slice(index, index + 2)
        turns = Rotation.from_quat(self.q_reference_from_body_xyzw[pair])
        if len(turns) == 1:
            return turns[0].as_matrix()
        seconds = (self.tai_ns[pair] - self.tai_ns[index]) * 1e-9
        slerp = Slerp(seconds, turns)
        return slerp((tai_ns - int(self.tai_ns[index])) * 1e-9).as_matrix()

    def check_turns(self, largest: float) -> None:
        """Raise ConfigError if two neighbours differ by more than an angle [rad]."""
        turns = Rotation.from_quat(self.q_reference_from_body_xyzw)
        angles = (turns[:-1].inv() * turns[1:]).magnitude() if len(turns) > 1 else np.zeros(0)
        within = np.diff(self.tai_ns) <= self.longest_gap_ns
        for index in np.flatnonzero((angles > largest) & within)[:1]:
            when = utc_from_tai_ns(int(self.tai_ns[index]))
            problem = (
                f"turns by {np.degrees(angles[index]):.0f} deg in the step after {when}; "
                f"at most {np.degrees(largest):.0f} deg has one clear way"
            )
            raise ConfigError(self.source, "", problem)
