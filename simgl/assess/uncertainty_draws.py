"""Monte Carlo draws of an assessment: a row for each draw at each of some epochs, resumable."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from simgl.arrays import Array
from simgl.assess.requirement_check import Check
from simgl.assess.target_light import assess_frame
from simgl.assess.trajectory_assessment import COLUMNS, PRODUCTS, Assignment, row_of
from simgl.output import check_writable
from simgl.physics.frames import rotation_about
from simgl.progress import ProgressCallback, silent
from simgl.scenario.scenario import Scenario
from simgl.scenario.uncertainty import Uncertainty
from simgl.scene.state import SceneState
from simgl.sequence.journal import Journal, Row, run_missing
from simgl.simulator import Capture, Simulator
from simgl.workers.frame_job import Executor


@dataclass(frozen=True, kw_only=True)
class UncertaintyDraw:
    """The errors of one draw, the same at every epoch.

    albedo, exposure : factors, log-normal with median 1
    attitude : (3,) rotation vector of the target in its body axes [rad]
    pointing : (3,) rotation vector of the camera in its axes [rad]
    cloud_seed : of the weather; None keeps that of the scenario
    """

    number: int
    albedo: float
    exposure: float
    attitude: tuple[float, float, float]
    pointing: tuple[float, float, float]
    cloud_seed: int | None


def uncertainty_draw(table: Uncertainty, number: int) -> UncertaintyDraw:
    """A draw by its number; it does not depend on how many there are, nor on other deviations."""
    normal = np.random.default_rng([table.seed, number]).standard_normal(8)
    attitude = math.radians(table.attitude_sigma_deg) * normal[2:5]
    pointing = math.radians(table.pointing_sigma_deg) * normal[5:8]
    return UncertaintyDraw(
        number=number,
        albedo=math.exp(table.albedo_sigma * normal[0]),
        exposure=math.exp(table.exposure_sigma * normal[1]),
        attitude=(float(attitude[0]), float(attitude[1]), float(attitude[2])),
        pointing=(float(pointing[0]), float(pointing[1]), float(pointing[2])),
        cloud_seed=_cloud_seed(table, number % table.weathers) if table.weathers else None,
    )


def _cloud_seed(table: Uncertainty, weather: int) -> int:
    """Of a weather by its number, apart from the numbers of draws."""
    return int(np.random.default_rng([table.seed, weather, 1]).integers(2**32))


@dataclass(frozen=True, kw_only=True)
class UncertaintyRun:
    """Every draw at some epochs of an assessment.

    table : of the scenario
    chosen : numbers of the epochs, in order
    """

    work: Assignment
    table: Uncertainty
    chosen: Sequence[int]

    @property
    def scenario(self) -> Scenario:
        """Scenario that the simulators are opened for."""
        return self.work.scenario

    def draws(self) -> list[UncertaintyDraw]:
        """All draws."""
        return [uncertainty_draw(self.table, number) for number in range(self.table.draws)]

    def render(self, simulator: Simulator, frame: int) -> Row:
        """The row of one draw at one epoch; all epochs of a draw follow each other.

        That way a draw's weather is made once.
        """
        number, place = divmod(frame, len(self.chosen))
        epoch = self.chosen[place]
        draw, work = uncertainty_draw(self.table, number), self.work
        state = state_of_draw(work, work.epochs[epoch], draw)
        capture = capture_of_draw(simulator, work, state, draw)
        assessment = assess_frame(capture, state, work.target, work.limits)
        return {"draw": number, **row_of(epoch, work.epochs[epoch], assessment, work.limits)}


def draws_of(
    work: Assignment, rows: Sequence[Row], checks: Sequence[Check]
) -> UncertaintyRun | None:
    """The draws that a scenario asks for, if it does.

    rows : of the run itself
    checks : their worst epochs are drawn, too
    """
    table = work.scenario.uncertainty
    if table is None:
        return None
    times = [row["tai_ns"] for row in rows]
    worst = [times.index(c.worst_tai_ns) for c in checks if c.worst_tai_ns is not None]
    chosen = chosen_epochs(len(rows), table.epochs, worst)
    return UncertaintyRun(work=work, table=table, chosen=chosen)


def chosen_epochs(count: int, wanted: int, worst: Sequence[int]) -> list[int]:
    """Numbers of the epochs to draw at: evenly spread ones, and those worst for requirements.

    count : epochs of the run
    """
    even = np.linspace(0, count - 1, min(wanted, count)).round().astype(int)
    return sorted({*even.tolist(), *worst})


def state_of_draw(work: Assignment, tai_ns: int, draw: UncertaintyDraw) -> SceneState:
    """The scene of a draw: target turned, camera turned, other clouds."""
    state = work.scenario.at(tai_ns)
    if any(draw.attitude):
        pose = state.bodies[work.target].pose
        turned = replace(pose, R_icrf_from_body=pose.R_icrf_from_body @ _rotation(draw.attitude))
        # The laws of all that hangs on the target follow it.
        state = work.scenario.with_poses(tai_ns, {work.target: turned})
    if any(draw.pointing):
        seen = state.cameras[work.camera]
        R_camera_from_icrf = _rotation(draw.pointing) @ seen.R_camera_from_icrf
        cameras = {
            **state.cameras,
            work.camera: replace(seen, R_camera_from_icrf=R_camera_from_icrf),
        }
        state = replace(state, cameras=cameras)
    earth = state.earth
    if draw.cloud_seed is None or earth is None or earth.earth.clouds is None:
        return state
    clouds = replace(earth.earth.clouds, seed=draw.cloud_seed)
    return replace(state, earth=replace(earth, earth=replace(earth.earth, clouds=clouds)))


def _rotation(vector: tuple[float, float, float]) -> Array:
    """The rotation of a rotation vector that is not 0 [rad]."""
    angle = math.hypot(*vector)
    return rotation_about(np.array(vector) / angle, angle)


def capture_of_draw(
    simulator: Simulator, work: Assignment, state: SceneState, draw: UncertaintyDraw
) -> Capture:
    """What the camera captures in a draw; the target's pixels with its albedo.

    Mean electrons are proportional to exposure time, so that the target's are those of a longer
    exposure, with the dark current of the shorter one. The noise is that of the epoch's image.
    """
    camera = state.cameras[work.camera].camera
    exposed = replace(camera, exposure_time=draw.exposure * camera.exposure_time)
    # The draws of the noise count from the first setting on, whose DN are those of the target.
    brighter = replace(
        exposed,
        exposure_time=draw.albedo * exposed.exposure_time,
        detector=replace(
            exposed.detector, dark_current_300k=exposed.detector.dark_current_300k / draw.albedo
        ),
    )
    target, around = simulator.bracket(state, work.camera, [brighter, exposed], PRODUCTS)
    assert around.truth is not None
    assert around.electrons is not None
    assert around.radiance is not None
    assert target.electrons is not None
    on_target = around.truth.instance == list(state.bodies).index(work.target) + 1
    electrons = np.where(on_target, target.electrons.electrons, around.electrons.electrons)
    radiance = np.where(on_target[..., None], draw.albedo, 1.0) * around.radiance.radiance
    return replace(
        around,
        digital=target.digital,
        electrons=replace(around.electrons, electrons=electrons),
        radiance=replace(around.radiance, radiance=radiance.astype(np.float32)),
    )


def run_draws(
    run: UncertaintyRun, executor: Executor[Row], folder: Path, progress: ProgressCallback = silent
) -> list[Row]:
    """Assess every draw and epoch that the folder's table does not hold yet.

    progress : receives the rows done and their number
    returns : all rows, by draw, then by epoch
    Raises ConfigError for a folder that holds something else.
    """
    check_writable(folder)
    content = run.work.content() | {"draws": repr(run.table), "drawn": repr(list(run.chosen))}
    with Journal(folder, content, {"draw": int, **COLUMNS}, keys=2) as journal:
        done = journal.done()
        keys = [(draw, epoch) for draw in range(run.table.draws) for epoch in run.chosen]
        missing = [frame for frame, key in enumerate(keys) if key not in done]
        run_missing(missing, len(keys), executor, journal.add, progress)
        journal.export(folder / "frames.csv")
        return list(journal.rows())
