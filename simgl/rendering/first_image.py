"""What images of a scenario would wait for, made before the first: tables, maps, light, shaders."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache, partial

from simgl.camera.camera import Camera
from simgl.camera.image_margin import image_margin
from simgl.camera.pixel_ramp import pixel_ramps
from simgl.errors import SimglError
from simgl.progress import ProgressCallback
from simgl.rendering.camera_pipeline import CameraPipeline
from simgl.rendering.renderer import Renderer
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.view.background import Background, sky_view
from simgl.view.frame_view import FrameView, backgrounds, frame_view

# Kinds of tiles of the Earth that come within so long a time are compiled before the first image,
# as they are seen at these steps [s]: the ground in view moves by 35 km from one to the next.
_AHEAD_S, _AHEAD_STEP_S = 60, 5


def prepare_first_image(
    renderer: Renderer,
    pipeline: CameraPipeline,
    scenario: Scenario,
    progress: ProgressCallback | None,
) -> None:
    """Make what no frame should wait for.

    Where light between surfaces is to be traced, one core would be left alone with it in the end:
    an image that nobody sees is drawn meanwhile, so that the shaders of the first one are compiled.
    """
    models = scenario.models_at_epoch() if scenario.inter_reflection else ()
    prepare_programs = cache(partial(_prepare_programs, renderer, scenario))

    def unseen() -> None:
        prepare_programs()
        _draw_unseen(renderer, pipeline, scenario)

    renderer.prepare(models, scenario.earth, scenario.joint_light, progress, unseen)
    prepare_programs()


def _prepare_programs(renderer: Renderer, scenario: Scenario) -> None:
    """Compile what draws the Earth around spacecraft and, for a while, behind them."""
    _prepare_skies(renderer, scenario)
    renderer.planet.prepare_images(_coming_backgrounds(scenario))


def _coming_backgrounds(scenario: Scenario) -> Iterator[tuple[Background, tuple[int, int]]]:
    """What the cameras for visible light show behind spacecraft from the epoch on, with width and
    height of the image, as far as it is known."""
    for offset_s in range(0, _AHEAD_S + 1, _AHEAD_STEP_S):
        try:
            state = scenario.at(scenario.epoch_tai_ns + offset_s * 10**9)
            for name, camera in scenario.cameras.items():
                if camera.thermal is None:
                    yield from backgrounds(state, name, image_margin(camera))
        except SimglError:
            # Whoever asks for such an image is told.
            return


def _prepare_skies(renderer: Renderer, scenario: Scenario) -> None:
    """Compile what draws the skies of spacecraft."""
    state = scenario.at(scenario.epoch_tai_ns)
    try:
        sky = next((sky_view(state, *body) for body in state.bodies.items()), None)
    except SimglError:
        # Whoever asks for an image is told.
        return
    if sky is not None:
        renderer.skies.prepare(sky)


def _draw_unseen(renderer: Renderer, pipeline: CameraPipeline, scenario: Scenario) -> None:
    """What the first camera for visible light sees at the epoch, dark where light is traced."""
    visible = (name for name, camera in scenario.cameras.items() if camera.thermal is None)
    camera = next(visible, None)
    if camera is None:
        return
    state = scenario.at(scenario.epoch_tai_ns)
    seen_by = state.cameras[camera].camera
    try:
        view = _dark_view(renderer, scenario, state, seen_by)
    except SimglError:
        # Whoever asks for that image is told.
        return
    radiance = renderer.radiance(replace(view, ramps=pixel_ramps(seen_by)))
    electrons = pipeline.electrons_through(seen_by, state.sun.photons_per_joule, radiance)
    pipeline.digital(seen_by, state.tai_ns, scenario.seed, electrons)


def _dark_view(
    renderer: Renderer, scenario: Scenario, state: SceneState, camera: Camera
) -> FrameView:
    return frame_view(
        state,
        camera.name,
        sample_budget=renderer.sample_budget,
        samples_per_pixel=scenario.samples_per_pixel,
        gather="dark",
        joint_light=scenario.joint_light,
        margin=image_margin(camera),
    )
