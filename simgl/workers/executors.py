"""Who renders the frames of a job: this process, or workers."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from simgl.errors import ConfigError
from simgl.simulator import Simulator
from simgl.workers.frame_job import Execute, Executor, Job, T


@contextmanager
def run_serial(job: Job[T], simulator: Simulator) -> Iterator[Execute[T]]:
    """Frames one after the other in this process."""
    yield lambda frames: (job.render(simulator, frame) for frame in frames)


def select_executor(
    job: Job[T], simulator: Simulator, workers: int | None, scheduler: str | None
) -> Executor[T]:
    """The executor that options of the command line ask for.

    simulator : of this process, open in any case: workers on this machine find in the disk cache
        what it prepares for a model or an atmosphere
    workers : processes on this machine; one is this process, and needs no Dask
    scheduler : address of a Dask scheduler
    Raises ConfigError where both are given, or Dask is needed and missing.
    """
    if workers is not None and scheduler is not None:
        raise ConfigError("command line", "--scheduler", "brings its own workers; leave --workers")
    if scheduler is None and workers in (None, 1):
        return run_serial(job, simulator)
    try:
        from simgl.workers.dask_executor import run_on_scheduler, run_on_this_machine
    except ImportError:
        option = "--workers" if scheduler is None else "--scheduler"
        problem = 'needs Dask: pip install "simgl[campaign]"'
        raise ConfigError("command line", option, problem) from None
    if scheduler is None:
        return run_on_this_machine(job, workers or 1)
    return run_on_scheduler(job, scheduler)
