"""Several clients on one Dask scheduler: every frame is rendered for the job that asked for it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from simgl.errors import SimglError
from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator
from tests.scenes import lambert, scene

distributed = pytest.importorskip("distributed")
dask_executor = pytest.importorskip("simgl.workers.dask_executor")


@dataclass(frozen=True)
class NamedJob:
    """A frame says whose it is, and which scenario its simulator is of."""

    name: str

    @property
    def scenario(self) -> Scenario:
        box = {"box": {"size_m": [1.0, 1.0, 1.0], "material": lambert(0.5)}}
        bodies = {self.name: {"model": box, "position_icrf_m": [0.0, 0.0, 0.0]}}
        return scene(bodies, {"position_icrf_m": [9.0, 0.0, 0.0], "look_at": self.name})

    def render(self, simulator: Simulator, frame: int) -> tuple[str, str, int]:
        return self.name, next(iter(simulator.scenario.models)), frame


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """Address of a scheduler with one worker, a thread of this process."""
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0"
    ) as cluster:
        # Clients of other machines come by TCP; inproc:// is the same code.
        yield cluster.scheduler_address


def test_two_jobs_on_one_scheduler_get_their_own_frames(scheduler: str) -> None:
    with (
        dask_executor.run_on_scheduler(NamedJob("first"), scheduler) as execute_first,
        dask_executor.run_on_scheduler(NamedJob("second"), scheduler) as execute_second,
    ):
        # Interleaved: both runs have begun, and have frames left, when either renders.
        first, second = execute_first(range(6)), execute_second(range(6))
        results = [next(first), next(second)]
        results += [result for pair in zip(first, second, strict=True) for result in pair]
    for name in ("first", "second"):
        frames = sorted(frame for job, body, frame in results if job == body == name)
        assert frames == list(range(6))
    assert len(results) == 12


def test_the_same_job_may_run_twice_at_once(scheduler: str) -> None:
    job = NamedJob("target")
    with (
        dask_executor.run_on_scheduler(job, scheduler) as execute,
        dask_executor.run_on_scheduler(job, scheduler) as execute_again,
    ):
        longer, shorter = execute(range(8)), execute_again(range(2))
        results = [next(longer)]
        assert len(list(shorter)) == 2
        # The shorter run has ended; the other one's simulator is still there.
        results += longer
    assert sorted(frame for _, _, frame in results) == list(range(8))


def test_workers_hold_no_job_when_its_run_is_over(
    scheduler: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    closed = []
    close = Simulator.close

    def noted_close(simulator: Simulator) -> None:
        close(simulator)
        closed.append(simulator)

    monkeypatch.setattr(Simulator, "close", noted_close)
    with dask_executor.run_on_scheduler(NamedJob("target"), scheduler) as execute:
        assert len(list(execute(range(2)))) == 2
    # The run waits for the worker, which waits until its context is closed.
    assert len(closed) == 1
    with distributed.Client(scheduler) as client:
        jobs = client.run(lambda dask_worker: [n for n in dask_worker.plugins if "simgl" in n])
    assert list(jobs.values()) == [[]]


def test_a_worker_refuses_a_job_that_it_does_not_hold(scheduler: str) -> None:
    with distributed.Client(scheduler) as client:
        failure = client.submit(dask_executor._render_at_worker, "simgl-other", 3).result()
        assert failure.problem == "workers: frame 3 is of a job that this worker does not hold"
        with pytest.raises(SimglError, match="does not hold"):
            list(dask_executor._results(client, "simgl-other", [3]))


@pytest.mark.parametrize(
    ("cores", "workers", "threads"), [(2, 2, 0), (3, 2, 0), (4, 2, 2), (1, 2, 0)]
)
def test_a_worker_with_one_core_has_a_cpu_renderer_without_threads(
    monkeypatch: pytest.MonkeyPatch, cores: int, workers: int, threads: int
) -> None:
    started: list[tuple[int, dict[str, str]]] = []

    def no_cluster(workers: int, environment: dict[str, str]) -> None:
        started.append((workers, environment))
        raise TimeoutError

    monkeypatch.setattr(dask_executor, "_local_cluster", no_cluster)
    monkeypatch.setattr("os.cpu_count", lambda: cores)
    monkeypatch.delenv("LP_NUM_THREADS", raising=False)
    with pytest.raises(SimglError, match="not reached"):
        dask_executor.run_on_this_machine(NamedJob("target"), workers).__enter__()
    assert [(count, told["LP_NUM_THREADS"]) for count, told in started] == [(workers, str(threads))]
