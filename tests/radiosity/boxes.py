"""An open and a closed box, their light, and what it has to be."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from simgl.arrays import Array, Array32, Mask
from simgl.motion.trajectory import FixedAttitude, Motion, UniformMotion
from simgl.radiosity.bake import BakeSettings, bake
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.sunlit_patches import SunlitPatches
from simgl.scenario.scenario import Scenario
from simgl.scene.materials import Material
from simgl.scene.spacecraft import SpacecraftModel
from tests.radiosity.shapes import LID, OPEN_BOX, quads
from tests.scenes import scene

Sun = tuple[float, float, float]

SUN = np.array([-1.0, 0.0, 1.0]) / np.sqrt(2.0)
QUICK = BakeSettings(patches=200, patch_rays=128, gather_rays=128, added_triangles=300)


def white(reflectance: float, count: int = 6, emission: float = 0.0) -> list[Material]:
    """Lambertian, the same in every band, for each of some numbers of material."""
    return [
        Material(name="white", reflectance=(reflectance,) * 4, emission=(emission,) * 4)
    ] * count


@lru_cache(maxsize=1)
def open_box() -> LightTransport:
    """The open box of C6."""
    found = bake(quads(OPEN_BOX), open_sheets=True)
    assert found is not None
    return found


@lru_cache(maxsize=1)
def closed_box() -> LightTransport:
    """The same with a lid."""
    settings = BakeSettings(patches=300, patch_rays=256, gather_rays=64, added_triangles=500)
    found = bake(quads((*OPEN_BOX, LID)), open_sheets=True, settings=settings)
    assert found is not None
    return found


def sunlight(transport: LightTransport) -> Array32:
    """(p, 4) irradiance of the patches by a Sun of 1367 W/m2 in each band."""
    cosines = SunlitPatches(transport).cosines(SUN)
    return cosines[:, None] * np.full(4, 1367.0, dtype=np.float32)


def inside(transport: LightTransport) -> Mask:
    """Patches on the inner faces of the box."""
    centre = transport.points.mean(axis=1) - np.array([1.0, 0.5, 0.5])
    return np.einsum("ij,ij->i", transport.normals[:, 0], centre) < 0.0


def box_faces(transport: LightTransport) -> dict[str, Mask]:
    """Patches of the inner faces, and of the halves of the floor away from the shadow's edge."""
    x = transport.points.mean(axis=1)[:, 0]
    n, inner = transport.normals[:, 0], inside(transport)
    floor = inner & (n[:, 2] > 0.9)
    return {
        "floor": floor,
        "shadow": floor & (x > 0.0625) & (x < 0.9375),
        "lit": floor & (x > 1.0625) & (x < 1.9375),
        "x=0": inner & (n[:, 0] > 0.9),
        "x=2": inner & (n[:, 0] < -0.9),
        "y=0": inner & (n[:, 1] > 0.9),
    }


# By the number of bounces (0: all), mean radiance of faces of reflectance 0.8 [W m-2 sr-1].
C6 = {
    1: {"floor": 123.08, "shadow": 0.0, "lit": 246.14, "x=0": 0.0, "x=2": 246.14, "y=0": 0.0},
    2: {"floor": 146.0, "shadow": 6.29, "lit": 283.79, "x=0": 19.98, "x=2": 285.56, "y=0": 46.59},
    3: {"floor": 171.89, "shadow": 18.09, "lit": 323.21, "x=0": 30.79, "x=2": 325.37, "y=0": 66.54},
    0: {
        "floor": 207.53,
        "shadow": 44.19,
        "lit": 367.36,
        "x=0": 59.62,
        "x=2": 370.89,
        "y=0": 102.77,
    },
}


def at_rest(model: SpacecraftModel, x: float, y: float, sun: Sun, *, on: bool) -> Scenario:
    """A craft at the origin, seen from 6 m above a place of its.

    sun : direction to it, ICRF
    on : with light between its surfaces
    """
    empty = scene(
        {},
        {
            "position_icrf_m": [x, y, 6.0],
            "boresight": [0.0, 0.0, -1.0],
            "up": [0.0, 1.0, 0.0],
            "focal_length_mm": 8.0,
            "pixel_pitch_um": 20.0,
        },
        sun_direction=sun,
        render={"inter_reflection": on, "samples_per_pixel": 16},
    )
    still = Motion(
        trajectory=UniformMotion(position=np.zeros(3), velocity=np.zeros(3), epoch_tai_ns=0),
        attitude=FixedAttitude(R_icrf_from_body=np.eye(3)),
    )
    return replace(empty, models={model.name: model}, motions={model.name: still})


def c6_scene(reflectance: float, *, on: bool) -> Scenario:
    """The open box before a camera on high, Sun from -x."""
    model = SpacecraftModel(
        name="box",
        mesh=quads(OPEN_BOX),
        parts=("box",),
        materials=tuple(white(reflectance, 5)),
        open_sheets=True,
    )
    return at_rest(model, 1.0, 0.5, (-(0.5**0.5), 0.0, 0.5**0.5), on=on)


def floor_means(picture: Array) -> dict[str, float]:
    """Of the floor in the picture of ``c6_scene``: what lies in shadow, and what the Sun lights.

    The rows leave out 8 cm at both walls' feet, where it is up to 10 % brighter: 1 % of the mean.

    picture : (128, 128)
    """
    pixels_per_metre = 400.0 / 6.0
    # Centre of the picture is x = 1, y = 0.5; columns along +x, rows down along -y.
    x = (np.arange(128) - 63.5) / pixels_per_metre + 1.0
    rows = picture[64 - 28 : 64 + 28]
    return {
        "shadow": float(rows[:, (x > 0.0625) & (x < 0.9375)].mean()),
        "lit": float(rows[:, (x > 1.0625) & (x < 1.9375)].mean()),
    }
