"""The cases: which image stands for which figures, and what the study reads from them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from examples.lighting_study.shot import BACK, PORT, Shot
from simgl.arrays import Mask


@dataclass(frozen=True, kw_only=True)
class Number:
    """A flux in an image, and what the study gives for it.

    what, says : where, and the study's number or word
    pixels : that ours is read from
    published : lowest and highest [W m-2]; None where the study has words only
    against : another number of the case, and the ratio of medians that the words mean, from .. to
    why : of agreement or difference
    """

    what: str
    says: str
    pixels: Callable[[Shot], Mask]
    published: tuple[float, float] | None = None
    against: tuple[str, float, float] | None = None
    why: str = ""


@dataclass(frozen=True, kw_only=True)
class Case:
    """An image of the study.

    file, camera : of the scenario
    figures : their numbers in the study
    kind : what the study says of it, in our words
    text : what ours shows, under the image
    numbers : what the study gives figures or words for
    """

    name: str
    file: str
    camera: str
    title: str
    figures: str
    kind: str
    text: str
    numbers: tuple[Number, ...] = ()


def _sunlit_back(shot: Shot) -> Mask:
    return shot.part("body") & shot.facing(BACK, 40.0) & shot.sunlit


def _wings(shot: Shot) -> Mask:
    return shot.part("panel_wing_left", "panel_wing_right")


CASES = (
    Case(
        name="eclipse",
        file="eclipse",
        camera="navcam",
        title="Eclipse",
        figures="57, 58",
        kind="too dark: the spacecraft is hardly distinguishable from the sky, only the "
        "atmosphere gives information",
        text="The Sun has almost set; its last light is red and falls on the far side.",
        numbers=(
            Number(
                what="spacecraft",
                says="hardly distinguishable",
                pixels=lambda shot: shot.part(),
                against=("atmosphere at the limb", 0.0, 0.1),
            ),
            Number(
                what="atmosphere at the limb",
                says="the only information",
                pixels=lambda shot: shot.background & (shot.flux > 1.0),
                why="Its brightness depends on how deep the spacecraft is in the shadow, which "
                "the study does not state; here 17 % of the sunlight reach it.",
            ),
        ),
    ),
    Case(
        name="too_bright",
        file="too_bright",
        camera="navcam",
        title="Over the bright atmosphere",
        figures="59, 60",
        kind="bad: the body merges with the atmosphere, tail cone and wings are dark",
        text="The back of the body is twice as bright as the clouds.",
        numbers=(
            Number(
                what="back of the body, sunlit",
                says="800 to 1000",
                published=(800.0, 1000.0),
                pixels=_sunlit_back,
                why="White felt of reflectance 0.64 to 0.72, 10 deg off the Sun's direction.",
            ),
            Number(
                what="background around the spacecraft",
                says="very similar to the body",
                pixels=lambda shot: shot.around_target,
                against=("back of the body, sunlit", 0.67, 1.5),
                why="Clouds and air reflect here what satellites measure, most of it half as much "
                "as white felt; the study's atmosphere is brighter.",
            ),
            Number(
                what="wings",
                says="very dark",
                pixels=_wings,
                against=("back of the body, sunlit", 0.0, 0.4),
            ),
        ),
    ),
    Case(
        name="craft_alone",
        file="craft_alone",
        camera="navcam",
        title="Spacecraft before space",
        figures="61, 62",
        kind="good: front, back and materials are distinguishable",
        text="Light from the side, black background.",
        numbers=(
            Number(
                what="side that faces the camera",
                says="about 400 (front)",
                published=(400.0, 400.0),
                pixels=lambda shot: shot.part("body") & shot.facing(PORT, 40.0),
                why="White tiles have 550 to 600 and black ones 40 to 60, so the median falls "
                "between two materials. The study's body is white, and the study does not state "
                "which side is the front.",
            ),
            Number(
                what="back, sunlit",
                says="about 1000",
                published=(1000.0, 1000.0),
                pixels=_sunlit_back,
            ),
            Number(
                what="solar panels",
                says="much less",
                pixels=_wings,
                against=("back, sunlit", 0.0, 0.5),
            ),
            Number(
                what="tail cone",
                says="much less",
                pixels=lambda shot: shot.part("tail_cone"),
                against=("back, sunlit", 0.0, 0.5),
                why="It is painted white here; the study's is dark.",
            ),
        ),
    ),
    Case(
        name="over_earth",
        file="over_earth",
        camera="navcam",
        title="Spacecraft before the Earth",
        figures="63, 64",
        kind="good: spacecraft, clouds, atmosphere and ground are distinguishable; the right "
        "wing glints",
        text="The right wing nearly mirrors the Sun into the camera.",
        numbers=(
            Number(
                what="right wing",
                says="highly reflective",
                pixels=lambda shot: shot.part("panel_wing_right"),
                against=("left wing", 2.0, math.inf),
                why="Solar cells are mirror-like; the brightest tenth is brighter than a white "
                "plate.",
            ),
            Number(
                what="left wing",
                says="",
                pixels=lambda shot: shot.part("panel_wing_left"),
            ),
        ),
    ),
    Case(
        name="bay",
        file="bay",
        camera="bay",
        title="Cargo bay, 4.8 mm sensor",
        figures="65 to 67",
        kind="good: the CubeSat's shadow falls into a bay that stays visible and well lit",
        text="The field of view is 20.9 deg wide: 0.48 m of the floor, most of it in the shadow.",
        numbers=(
            Number(
                what="bay, sunlit",
                says="well lit",
                pixels=lambda shot: shot.part("cargo_bay") & shot.sunlit,
                why="A white floor of reflectance 0.78 alone gives 1066; the walls add a fifth.",
            ),
            Number(
                what="bay in the CubeSat's shadow",
                says="clearly visible",
                pixels=lambda shot: shot.part("cargo_bay") & shot.in_cast_shadow,
                against=("bay, sunlit", 0.02, 0.5),
                why="The walls of the bay illuminate the shadow to a ninth of the sunlit floor; "
                "the signal is still more than ten times its noise.",
            ),
        ),
    ),
    Case(
        name="bay_wide",
        file="bay",
        camera="bay_wide",
        title="Cargo bay, 36 mm sensor",
        figures="65 to 67",
        kind="the same",
        text="The field of view is 108 deg wide if the study used the default sensor size of its "
        "software. The text does not show which of the two its figure is.",
    ),
    Case(
        name="azimuth_20",
        file="azimuths",
        camera="azimuth_20",
        title="Azimuth 20 deg",
        figures="82",
        kind="the spacecraft before black sky, the Earth at the bottom",
        text="",
    ),
    Case(
        name="azimuth_28",
        file="azimuths",
        camera="azimuth_28",
        title="Azimuth 28 deg",
        figures="83",
        kind="across the limb, no artefact where spacecraft and atmosphere overlap",
        text="The atmosphere has its true thickness; the study's software needed 400 km.",
    ),
    Case(
        name="azimuth_90",
        file="azimuths",
        camera="azimuth_90",
        title="Azimuth 90 deg",
        figures="84",
        kind="from above before the Earth, light and shadows correct",
        text="",
    ),
)
