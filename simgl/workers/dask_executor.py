"""Worker processes by Dask distributed.

Each worker process has one simulator per job, with one OpenGL context, used by one thread. The job
goes to every worker as a plugin, also to those that join later, so that machines need share nothing
but the version of simgl. A frame that was with a lost worker goes to another one.

Several clients may use one scheduler: the plugin's name, every task and every key carry the digest
of the job and a token of the run, and a worker refuses a task whose job it does not hold.
"""

from __future__ import annotations

import asyncio
import hashlib
import logging
import os
import pickle
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any, cast
from uuid import uuid4

import dask.config
from distributed import Client, LocalCluster, WorkerPlugin, as_completed, get_worker
from distributed.scheduler import KilledWorker

from simgl import __version__, assets
from simgl.errors import ConfigError, SimglError
from simgl.interruption import block_interrupts, exit_at_once, report_faults
from simgl.simulator import Simulator
from simgl.workers.frame_job import Execute, Job, T

# Frames that wait at each worker, so that none idles while a result is fetched.
_QUEUED = 3
_CONNECT_S = 20.0
# For two processes of this machine to find each other; a machine with other work on it takes
# longer than Dask's own 30 s.
_LOCAL_CONNECT_S = 300


@dataclass(frozen=True)
class _Failure:
    """Why a frame failed; exceptions of several arguments cannot be pickled."""

    problem: str


class _JobPlugin(WorkerPlugin):
    """A job at a worker, with the simulator that its first frame opens."""

    def __init__(self, name: str, pickled_job: bytes) -> None:
        self.name = name
        self._pickled_job, self._version = pickled_job, __version__
        self._assets = assets.digests()
        self._job: Job[object] | None = None
        self._simulator: Simulator | None = None
        self._thread: ThreadPoolExecutor | None = None

    def setup(self, worker: object) -> None:  # noqa: ARG002 - Dask's signature
        """Start the thread that all of the job's OpenGL runs in."""
        report_faults()
        if self._version != __version__:
            raise RuntimeError(f"a worker has simgl {__version__}, not {self._version}")
        for name, digest in assets.digests().items():
            if digest != self._assets[name]:
                raise RuntimeError(f"a worker has other {name} of simgl than the client")
        self._job = pickle.loads(self._pickled_job)
        self._thread = ThreadPoolExecutor(max_workers=1)

    async def teardown(self, worker: object) -> None:  # noqa: ARG002 - Dask's signature
        """Close the simulator and its context after the frame in hand, and wait for that."""
        if self._thread is not None:
            await asyncio.wrap_future(self._thread.submit(self._close))
            self._thread.shutdown()

    def _close(self) -> None:
        if self._simulator is not None:
            self._simulator.close()
            self._simulator = None

    def render(self, frame: int) -> object:
        """A frame, or its failure."""
        assert self._thread is not None
        return self._thread.submit(self._render, frame).result()

    def _render(self, frame: int) -> object:
        assert self._job is not None
        try:
            if self._simulator is None:
                self._simulator = Simulator(self._job.scenario)
            return self._job.render(self._simulator, frame)
        except SimglError as error:
            return _Failure(str(error))


def _render_at_worker(job_name: str, frame: int) -> object:
    plugin = get_worker().plugins.get(job_name)
    if not isinstance(plugin, _JobPlugin):
        return _Failure(f"workers: frame {frame} is of a job that this worker does not hold")
    return plugin.render(frame)


def _renderer_threads(workers: int) -> int:
    """Threads that a CPU renderer starts in each of so many processes; 0: it draws on its caller's.

    Its own default is one per core in each process. A single one would gain nothing where all
    cores have a process, and llvmpipe with threads may free a lock that one of them still holds
    (``benchmarks/driver_threads``).
    """
    threads = (os.cpu_count() or 1) // workers
    return threads if threads > 1 else 0


@contextmanager
def run_on_this_machine(job: Job[T], workers: int) -> Iterator[Execute[T]]:
    """Worker processes on this machine, reached by its loopback address only."""
    environment = {
        "LP_NUM_THREADS": os.environ.get("LP_NUM_THREADS", str(_renderer_threads(workers))),
        "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": f"{_LOCAL_CONNECT_S}s",
    }
    logging.getLogger("distributed").setLevel(logging.ERROR)
    # Python's watch over shared semaphores speaks up where this process is killed.
    os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker")
    exit_at_once()
    dask.config.set({"distributed.comm.timeouts.connect": f"{_LOCAL_CONNECT_S}s"})
    with ExitStack() as running:
        try:
            cluster = running.enter_context(_local_cluster(workers, environment))
            client = running.enter_context(Client(cluster))
        except TimeoutError:
            problem = f"were not reached within {_LOCAL_CONNECT_S} s"
            raise SimglError(f"workers: processes of this machine {problem}") from None
        yield lambda frames: _run(client, job, frames)


def _local_cluster(workers: int, environment: Mapping[str, str]) -> LocalCluster:
    with ThreadPoolExecutor(max_workers=1, initializer=block_interrupts) as starter:
        starting = starter.submit(
            LocalCluster,
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address=None,
            # Dask's own default is one fixed port for all programs of a machine.
            scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},
            memory_limit=None,
            silence_logs=logging.ERROR,
            env=environment,
        )
        return starting.result()


@contextmanager
def run_on_scheduler(job: Job[T], scheduler: str) -> Iterator[Execute[T]]:
    """The workers of a scheduler, such as ``tcp://10.0.0.1:8786``, and all that join it meanwhile.

    Raises ConfigError where no scheduler answers.
    """
    try:
        client = Client(scheduler, timeout=_CONNECT_S)
    except (OSError, ValueError) as error:
        problem = f"is not a scheduler that answers: {scheduler} ({_one_line(error)})"
        raise ConfigError("command line", "--scheduler", problem) from None
    with client:
        yield lambda frames: _run(client, job, frames)


def _run(client: Any, job: Job[T], frames: Sequence[int]) -> Iterator[T]:
    pickled_job = pickle.dumps(job)
    digest = hashlib.sha256(__version__.encode() + pickled_job).hexdigest()
    # The token keeps two runs of one job from each other: each removes its own plugin.
    name = f"simgl-{digest}-{uuid4().hex}"
    try:
        client.register_plugin(_JobPlugin(name, pickled_job))
    except RuntimeError as error:
        raise ConfigError("command line", "--scheduler", _one_line(error)) from None
    try:
        yield from _results(client, name, frames)
    finally:
        client.unregister_worker_plugin(name)


def _results(client: Any, job_name: str, frames: Sequence[int]) -> Iterator[T]:
    remaining = iter(frames)

    def submit() -> Any:
        frame = next(remaining, None)
        if frame is None:
            return None
        key = f"{job_name}-{frame}"
        return client.submit(_render_at_worker, job_name, frame, pure=False, key=key)

    workers = max(len(client.scheduler_info(n_workers=-1)["workers"]), 1)
    first = [future for _ in range(_QUEUED * workers) if (future := submit()) is not None]
    arriving = as_completed(first)
    for future in arriving:
        try:
            result = future.result()
        except KilledWorker as error:
            raise SimglError(f"workers: {_one_line(error)}") from None
        # What the client releases leaves the worker's memory.
        future.release()
        if (following := submit()) is not None:
            arriving.add(following)
        if isinstance(result, _Failure):
            raise SimglError(result.problem)
        yield cast(T, result)


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())
