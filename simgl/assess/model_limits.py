"""What the images of a run do not model: said from the scenario and from what its epochs show."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from simgl.assess.target_background import TargetBackground
from simgl.assess.trajectory_assessment import Assignment
from simgl.camera.camera import Camera
from simgl.motion.trajectory import LvlhAttitude, PointingAttitude
from simgl.scenario.scenario import EphemerisSun
from simgl.sequence.journal import Row

# Share of the Sun's light below which a target is in the Earth's shadow.
_DARK = 0.01


@dataclass(frozen=True)
class ModelLimit:
    """Something that is not modelled, or only coarsely.

    what : it is about, in a word or two
    text : a sentence
    epochs : how many of the run it concerns
    """

    what: str
    text: str
    epochs: int


def model_limits(work: Assignment, rows: Sequence[Row]) -> list[ModelLimit]:
    """What is not modelled for these epochs, those that concern all of them first."""
    count = len(rows)
    limits = [ModelLimit(what, text, count) for what, text in _of_the_scenario(work)]
    limits += [ModelLimit(what, text, count) for what, text in _of_the_camera(work)]
    limits += _of_the_epochs(work, rows)
    return sorted(limits, key=lambda one: -one.epochs)


def _of_the_scenario(work: Assignment) -> Iterator[tuple[str, str]]:
    scenario = work.scenario
    if work.is_thermal:
        yield "reflection", "Thermal radiation is reflected diffusely: no mirror images."
    else:
        edges = "400-500, 500-600, 600-700, 700-1000 nm"
        yield "spectrum", f"Light is computed in four bands ({edges})."
    yield "polarisation", "Scattering and reflection ignore polarisation."
    yield (
        "materials",
        "Reflectances are those of the model files: no wear, no contamination, no temperature.",
    )
    if not isinstance(scenario.sun, EphemerisSun):
        yield "Sun", "The Sun's direction is fixed by hand: no ephemeris, no Moon."
    if not scenario.inter_reflection:
        yield (
            "interreflection",
            "Light between the surfaces of a spacecraft is off (inter_reflection = false).",
        )
    elif scenario.gather == "vertex":
        yield (
            "interreflection",
            "Light between surfaces is computed at vertices and interpolated: contacts and deep "
            "shadows are too smooth.",
        )
    if len(scenario.models) > 1 and not scenario.between_spacecraft and scenario.gather != "pixel":
        yield (
            "several spacecraft",
            "Spacecraft cast shadows on each other but do not light each other "
            "(between_spacecraft = false).",
        )
    if scenario.inter_reflection and not scenario.glossy_reflections:
        yield (
            "glossy surfaces",
            "They reflect the Sun and the Earth, but see their own spacecraft as uniform "
            "(glossy_reflections = false).",
        )
    if scenario.joint_light == "quick" and any(m.joints for m in scenario.models.values()):
        yield "joints", 'Light between moved parts is approximate (joint_light = "quick").'
    attitudes = [motion.attitude for motion in scenario.motions.values()]
    if any(isinstance(a, LvlhAttitude | PointingAttitude) for a in attitudes):
        yield "attitude", "Spacecraft keep their attitude law exactly: no control error, no jitter."
    if scenario.stars is None:
        yield "stars", "No stars are drawn."
    if scenario.earth is None:
        yield "Earth", "There is no Earth: no eclipse, no Earthshine, nothing behind the target."


def _of_the_camera(work: Assignment) -> Iterator[tuple[str, str]]:
    camera = work.scenario.cameras[work.camera]
    yield (
        "motion blur",
        "Images of an assessment are taken of a scene that stands still: no motion blur"
        + (", no rolling shutter." if camera.detector.row_time > 0.0 else "."),
    )
    yield "lens", "No internal reflections but those listed, no thermal defocus, no contamination."
    missing = "" if work.is_thermal else ", ".join(_ideal_parts(camera))
    if missing:
        yield "camera", f"Ideal in this preset, thus without effect: {missing}."


def _ideal_parts(camera: Camera) -> Iterator[str]:
    """What the camera's preset leaves out."""
    d, lens, pattern = camera.detector, camera.lens, camera.detector.pattern
    parts = {
        "point spread": lens.spread is not None,
        "distortion": lens.distortion is not None,
        "veiling glare": lens.veiling_glare > 0.0,
        "ghosts": bool(lens.surfaces),
        "dark current": d.dark_current_300k > 0.0,
        "differences between pixels": pattern.prnu > 0.0 or pattern.dsnu > 0.0,
        "hot and dead pixels": pattern.hot_pixels > 0.0 or pattern.dead_pixels > 0.0,
        "blooming": d.blooming > 0.0,
        "particle hits": d.particles is not None,
    }
    yield from (name for name, modelled in parts.items() if not modelled)


def _of_the_epochs(work: Assignment, rows: Sequence[Row]) -> Iterator[ModelLimit]:
    earth = work.scenario.earth
    if earth is None:
        return
    dark = sum(float(row["sunlight"] or 0.0) < _DARK for row in rows)
    if dark:
        yield ModelLimit(
            "eclipse",
            "In the Earth's shadow, airglow and city lights do not light spacecraft"
            + ("." if earth.moonlight else ", nor does the Moon."),
            dark,
        )
    partly = sum(_DARK <= float(row["sunlight"] or 0.0) < 1.0 - _DARK for row in rows)
    bends = earth.air is not None and any(earth.air.refractivity)
    if partly and earth.air is not None and not bends:
        yield ModelLimit(
            "penumbra",
            "Sunlight through the atmosphere is dimmed and reddened, but not refracted.",
            partly,
        )
    behind = [str(row["backdrop"]) for row in rows]
    over_limb = sum(b in (TargetBackground.LIMB, TargetBackground.MIXED) for b in behind)
    if over_limb:
        text = "Ground and clouds at the limb behind the target are not lifted by refraction."
        if not bends:
            text = "No refraction in the atmosphere behind the target."
        yield ModelLimit("limb", text, over_limb)
    over_earth = sum(b in (TargetBackground.EARTH, TargetBackground.MIXED) for b in behind)
    if not over_earth:
        return
    if earth.albedo is not None:
        text = "The Earth behind the target is a uniform Lambertian globe: no clouds, land or sea."
        yield ModelLimit("Earth", text, over_earth)
        return
    yield ModelLimit(
        "land and sea",
        "Detail below 10 km is plausible, not real; leaves do not change with the season.",
        over_earth,
    )
    if earth.clouds is None:
        yield ModelLimit("clouds", "A clear day everywhere.", over_earth)
    elif earth.clouds.image is None:
        text = f"A thin layer drawn by seed {earth.clouds.seed}, not the weather of the day."
        yield ModelLimit("clouds", text, over_earth)
