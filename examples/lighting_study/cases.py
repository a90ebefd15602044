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
        kind="too dark: the craft is hardly told from the sky, only the air gives information",
        text="The Sun has all but set, its last light is red and falls on the far side.",
        numbers=(
            Number(
                what="craft",
                says="hardly told from the dark",
                pixels=lambda shot: shot.part(),
                against=("air along the limb", 0.0, 0.1),
            ),
            Number(
                what="air along the limb",
                says="the only information",
                pixels=lambda shot: shot.background & (shot.flux > 1.0),
                why="In kind. How bright depends on how deep the craft is in the shadow, which the "
                "study does not say; here 17 % of the sunlight reach it.",
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
        text="The back of the body and the clouds have one brightness.",
        numbers=(
            Number(
                what="back of the body, sunlit",
                says="800 to 1000",
                published=(800.0, 1000.0),
                pixels=_sunlit_back,
                why="White felt of reflectance 0.64 to 0.72, 10 deg off the Sun's direction.",
            ),
            Number(
                what="background beside the craft",
                says="very similar to the body",
                pixels=lambda shot: shot.around_target,
                against=("back of the body, sunlit", 0.67, 1.5),
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
        title="The craft alone",
        figures="61, 62",
        kind="good: front and back, and the materials, are told apart",
        text="Side light before black space.",
        numbers=(
            Number(
                what="flank before the camera",
                says="about 400 (front)",
                published=(400.0, 400.0),
                pixels=lambda shot: shot.part("body") & shot.facing(PORT, 40.0),
                why="White tiles have 550 to 600 and black ones 40 to 60: the median falls between "
                "two materials. The study's body is white all over, and it does not say what its "
                "front is.",
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
                why="It is painted white here; the study's is of a dark material.",
            ),
        ),
    ),
    Case(
        name="over_earth",
        file="over_earth",
        camera="navcam",
        title="The craft and the Earth",
        figures="63, 64",
        kind="good: craft, clouds, air and ground are told apart; the right wing shines",
        text="The right wing is turned so that it mirrors the Sun towards the camera, nearly.",
        numbers=(
            Number(
                what="right wing",
                says="highly reflective",
                pixels=lambda shot: shot.part("panel_wing_right"),
                against=("left wing", 2.0, math.inf),
                why="Cells mirror; its brightest tenth outshines a white plate.",
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
        title="Cargo bay, the lens on 4.8 mm of pixels",
        figures="65 to 67",
        kind="good: the CubeSat's shadow lies in a bay that stays visible and well lit",
        text="20.9 deg wide: 0.48 m of the floor, most of it in the shadow.",
        numbers=(
            Number(
                what="bay, sunlit",
                says="well lit",
                pixels=lambda shot: shot.part("cargo_bay") & shot.sunlit,
                why="More than the 1066 of a white floor of reflectance 0.78: the walls add a "
                "fifth.",
            ),
            Number(
                what="bay in the CubeSat's shadow",
                says="clearly visible",
                pixels=lambda shot: shot.part("cargo_bay") & shot.in_cast_shadow,
                against=("bay, sunlit", 0.02, 0.5),
                why="The bay's own walls light the shadow, to a ninth of the sunlit floor; the "
                "signal is still over ten times its noise.",
            ),
        ),
    ),
    Case(
        name="bay_wide",
        file="bay",
        camera="bay_wide",
        title="Cargo bay, the lens on 36 mm of film",
        figures="65 to 67",
        kind="the same",
        text="108 deg wide, if the study left its software's film size as it comes. It does not "
        "say, and which of the two its figure is cannot be told from the text.",
    ),
    Case(
        name="azimuth_20",
        file="azimuths",
        camera="azimuth_20",
        title="Azimuth 20 deg",
        figures="82",
        kind="the craft before black sky, the Earth at the bottom",
        text="",
    ),
    Case(
        name="azimuth_28",
        file="azimuths",
        camera="azimuth_28",
        title="Azimuth 28 deg",
        figures="83",
        kind="across the limb, no defect where craft and air overlap",
        text="The true thickness of the air; the study's software needed 400 km of it.",
    ),
    Case(
        name="azimuth_90",
        file="azimuths",
        camera="azimuth_90",
        title="Azimuth 90 deg",
        figures="84",
        kind="from above before the Earth, light and shadows right",
        text="",
    ),
)
