"""From the options of ``simgl sequence`` to its epochs."""

from __future__ import annotations

from dataclasses import dataclass

from simgl.errors import ConfigError, did_you_mean
from simgl.physics.ephemeris import tai_ns_from_utc
from simgl.scenario.scenario import Scenario
from simgl.sequence.epochs import MOST_FRAMES, at_random, events, regular, spread
from simgl.sequence.events import Event
from simgl.sequence.run_sequence import Output

_WHERE = "command line"


@dataclass(frozen=True, kw_only=True)
class EpochOptions:
    """Which epochs, as asked for; exactly one of step, count, random and event says how.

    start, stop : UTC; the scenario's epoch if no start is given
    duration_s : instead of a stop
    step_s : [s] between frames
    count : frames spread over the span
    random : frames at random in the span, by ``seed``
    event : frames where something begins, looked for in steps of ``search_step_s``
    """

    start: str | None = None
    stop: str | None = None
    duration_s: float | None = None
    step_s: float | None = None
    count: int | None = None
    random: int | None = None
    seed: int = 0
    event: Event | None = None
    search_step_s: float = 10.0

    def span(self, scenario: Scenario) -> tuple[int, int]:
        """First and last instant [TAI ns]."""
        start = scenario.epoch_tai_ns if self.start is None else _time("--from", self.start)
        if (self.stop is None) == (self.duration_s is None):
            raise ConfigError(_WHERE, "--to", "or --duration is needed, and not both")
        if self.stop is not None:
            stop = _time("--to", self.stop)
        else:
            assert self.duration_s is not None
            stop = start + round(self.duration_s * 1e9)
        if stop < start:
            raise ConfigError(_WHERE, "--to", "must not be earlier than the start")
        return start, stop

    def epochs(self, scenario: Scenario, camera: str, target: str | None) -> list[int]:
        """The epochs [TAI ns], in order.

        camera, target : whose view an event is about
        Raises ConfigError where the options contradict each other, or nothing is found.
        """
        ways = {
            "--step": self.step_s,
            "--count": self.count,
            "--random": self.random,
            "--event": self.event,
        }
        given = [name for name, value in ways.items() if value is not None]
        if len(given) != 1:
            found = " and ".join(given) if given else "none of them"
            problem = f"needs exactly one of {', '.join(ways)}; got {found}"
            raise ConfigError(_WHERE, "sequence", problem)
        start, stop = self.span(scenario)
        for name, value in (("--count", self.count), ("--random", self.random)):
            if value is not None and not 1 <= value <= MOST_FRAMES:
                raise ConfigError(_WHERE, name, f"must lie in 1..{MOST_FRAMES}, got {value}")
        if self.count is not None:
            return spread(start, stop, self.count)
        if self.random is not None:
            return at_random(start, stop, self.random, self.seed)
        if self.step_s is not None:
            return regular(start, stop, _nanoseconds("--step", self.step_s))
        assert self.event is not None
        step = _nanoseconds("--search-step", self.search_step_s)
        seen = _target(scenario, target)
        found_events = events(scenario, self.event, camera, seen, start, stop, step)
        if not found_events:
            problem = f"begins nowhere in the span: {self.event.value}"
            raise ConfigError(_WHERE, "--event", problem)
        return found_events


def _time(option: str, text: str) -> int:
    try:
        return tai_ns_from_utc(text)
    except ValueError as error:
        raise ConfigError(_WHERE, option, str(error)) from None


def _nanoseconds(option: str, seconds: float) -> int:
    if not seconds >= 1e-6:
        raise ConfigError(_WHERE, option, f"must be at least 1e-6 s, got {seconds:g}")
    return round(seconds * 1e9)


def _target(scenario: Scenario, target: str | None) -> str:
    names = list(scenario.models)
    if target is None:
        if not names:
            raise ConfigError(str(scenario.source), "spacecraft", "is missing; an event needs one")
        return names[0]
    if target not in names:
        raise ConfigError(_WHERE, "--target", f'"{target}": {did_you_mean(target, names)}')
    return target


def epoch_at(scenario: Scenario, at: str | None) -> int:
    """TAI ns of the option ``--at``, or the scenario's own epoch; ConfigError for one that is none.

    at : UTC
    """
    try:
        return scenario.epoch_tai_ns if at is None else tai_ns_from_utc(at)
    except ValueError as error:
        raise ConfigError(_WHERE, "--at", str(error)) from None


def camera_names(scenario: Scenario, wanted: list[str] | None) -> tuple[str, ...]:
    """The cameras asked for, all of the scenario if none is; ConfigError for one not there."""
    if not scenario.cameras:
        problem = "is missing; a picture needs a [camera.NAME]"
        raise ConfigError(str(scenario.source or scenario.name), "camera", problem)
    for name in wanted or []:
        if name not in scenario.cameras:
            problem = f'"{name}" is not in {scenario.source or scenario.name}; '
            problem += did_you_mean(name, scenario.cameras)
            raise ConfigError(_WHERE, "--camera", problem)
    return tuple(dict.fromkeys(wanted)) if wanted else tuple(scenario.cameras)


def outputs_named(text: str) -> frozenset[Output]:
    """What ``dn,view`` asks for; ConfigError for a name that is none."""
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in set(Output):
            problem = f'has no "{name}"; {did_you_mean(name, [str(o) for o in Output])}'
            raise ConfigError(_WHERE, "--write", problem)
    return frozenset(Output(name) for name in names)
