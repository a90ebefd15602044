"""Worker processes that take frames, by Dask distributed.

Each worker process has one simulator with one OpenGL context, used by one thread. A frame that was
with a worker which is lost goes to another one; the job itself goes to each worker when it joins,
so that nothing need be shared between machines but the version of simgl.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, cast

from distributed import Client, LocalCluster, WorkerPlugin, as_completed, get_worker
from distributed.scheduler import KilledWorker

from simgl import __version__
from simgl.errors import ConfigError, SimglError
from simgl.simulator import Simulator
from simgl.workers.frame_job import Job, T, Taking

# Frames that wait at each worker, so that none idles while one is fetched.
_QUEUED = 3
_STAGE = "simgl"
_CONNECT_S = 20.0


@dataclass(frozen=True)
class _Refused:
    """What stands against a frame; exceptions of several arguments do not travel."""

    problem: str


class _Stage(WorkerPlugin):
    """What a worker has of a job: the simulator that its first frame opens."""

    name = _STAGE

    def __init__(self, job: Job[object]) -> None:
        self._job, self._version = job, __version__
        self._simulator: Simulator | None = None
        self._thread: ThreadPoolExecutor | None = None

    def setup(self, worker: object) -> None:  # noqa: ARG002 - asked for by Dask
        """Make the thread that all of the worker's OpenGL happens in."""
        if self._version != __version__:
            raise RuntimeError(f"a worker has simgl {__version__}, not {self._version}")
        self._thread = ThreadPoolExecutor(max_workers=1)

    def teardown(self, worker: object) -> None:  # noqa: ARG002 - asked for by Dask
        """Free the simulator before another job comes to the same worker."""
        assert self._thread is not None
        self._thread.submit(self._close)
        self._thread.shutdown(wait=False)

    def _close(self) -> None:
        if self._simulator is not None:
            self._simulator.close()
            self._simulator = None

    def take(self, frame: int) -> object:
        """A frame, or what stands against it."""
        assert self._thread is not None
        return self._thread.submit(self._take, frame).result()

    def _take(self, frame: int) -> object:
        try:
            if self._simulator is None:
                self._simulator = Simulator(self._job.scenario)
            return self._job.take(self._simulator, frame)
        except SimglError as error:
            return _Refused(str(error))


def _taken(frame: int) -> object:
    """Runs on a worker."""
    stage = get_worker().plugins[_STAGE]
    assert isinstance(stage, _Stage)
    return stage.take(frame)


@contextmanager
def local_crew(job: Job[T], workers: int) -> Iterator[Taking[T]]:
    """So many worker processes on this machine, reached by its loopback address only."""
    # A CPU renderer draws with a thread a core in each process, unless it is told otherwise.
    threads = max((os.cpu_count() or 1) // workers, 1)
    environment = {"LP_NUM_THREADS": os.environ.get("LP_NUM_THREADS", str(threads))}
    logging.getLogger("distributed").setLevel(logging.ERROR)
    with (
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address=None,
            memory_limit=None,
            silence_logs=logging.ERROR,
            env=environment,
        ) as cluster,
        Client(cluster) as client,
    ):
        yield lambda frames: _by(client, job, frames)


@contextmanager
def distant_crew(job: Job[T], scheduler: str) -> Iterator[Taking[T]]:
    """The workers of a scheduler, such as ``tcp://10.0.0.1:8786``, and all that join it meanwhile.

    Raises ConfigError where no scheduler answers.
    """
    try:
        client = Client(scheduler, timeout=_CONNECT_S)
    except (OSError, ValueError) as error:
        problem = f"is no scheduler that answers: {scheduler} ({_line(error)})"
        raise ConfigError("command line", "--scheduler", problem) from None
    with client:
        yield lambda frames: _by(client, job, frames)


def _by(client: Any, job: Job[T], frames: Sequence[int]) -> Iterator[T]:
    try:
        client.register_plugin(_Stage(job))
    except RuntimeError as error:
        raise ConfigError("command line", "--scheduler", _line(error)) from None
    waiting = iter(frames)

    def submit() -> Any:
        frame = next(waiting, None)
        if frame is None:
            return None
        # A name of its own: results that another run left at the scheduler are not taken for it.
        return client.submit(_taken, frame, pure=False, key=f"frame-{id(waiting)}-{frame}")

    workers = max(len(client.scheduler_info(n_workers=-1)["workers"]), 1)
    first = [future for _ in range(_QUEUED * workers) if (future := submit()) is not None]
    arriving = as_completed(first)
    for future in arriving:
        try:
            found = future.result()
        except KilledWorker as error:
            raise SimglError(f"workers: {_line(error)}") from None
        # What the client no longer holds leaves the worker's memory.
        future.release()
        if (further := submit()) is not None:
            arriving.add(further)
        if isinstance(found, _Refused):
            raise SimglError(found.problem)
        yield cast(T, found)


def _line(error: BaseException) -> str:
    return " ".join(str(error).split())
