"""What images of a scenario would wait for, made before the first: tables, maps, light, shaders."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from simgl.camera.camera import Camera
from simgl.camera.image_margin import image_margin
from simgl.camera.pixel_ramp import pixel_ramps
from simgl.errors import SimglError
from simgl.progress import ProgressCallback
from simgl.rendering.camera_pipeline import CameraPipeline
from simgl.rendering.renderer import Renderer
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.view.background import sky_view
from simgl.view.frame_view import FrameView, frame_view


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
    unseen = partial(_draw_unseen, renderer, pipeline, scenario)
    renderer.prepare(models, scenario.earth, scenario.joint_light, progress, unseen)
    _prepare_skies(renderer, scenario)


def _prepare_skies(renderer: Renderer, scenario: Scenario) -> None:
    """Compile what draws the skies of spacecraft; nothing is left to do the second time."""
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
    _prepare_skies(renderer, scenario)
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
