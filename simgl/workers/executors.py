"""The crew that a command line asks for: this process alone, or workers."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from simgl.errors import ConfigError
from simgl.simulator import Simulator
from simgl.workers.frame_job import Crew, Job, T, Taking


@contextmanager
def alone(job: Job[T], simulator: Simulator) -> Iterator[Taking[T]]:
    """This process takes frames one after the other."""
    yield lambda frames: (job.take(simulator, frame) for frame in frames)


def hired(job: Job[T], simulator: Simulator, workers: int | None, scheduler: str | None) -> Crew[T]:
    """The crew that options of the command line ask for.

    simulator : of this process. It is opened in any case: what it prepares once for a model or an
        air, workers on this machine find ready
    workers : processes on this machine; one is this one, and needs no Dask
    scheduler : address of a Dask scheduler
    Raises ConfigError where both are given, or Dask is needed and missing.
    """
    if workers is not None and scheduler is not None:
        raise ConfigError("command line", "--scheduler", "brings its own workers; leave --workers")
    if scheduler is None and workers in (None, 1):
        return alone(job, simulator)
    try:
        from simgl.workers.dask_workers import distant_crew, local_crew
    except ImportError:
        option = "--workers" if scheduler is None else "--scheduler"
        problem = 'needs Dask: pip install "simgl[campaign]"'
        raise ConfigError("command line", option, problem) from None
    if scheduler is None:
        return local_crew(job, workers or 1)
    return distant_crew(job, scheduler)
