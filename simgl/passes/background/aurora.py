"""The block of the aurora."""

from __future__ import annotations

import numpy as np

from simgl.gpu.uniform_blocks import Block
from simgl.physics import aurora
from simgl.view.background import PlanetView

_LAYERS = len(aurora.HEIGHTS) - 1
# Standard deviation of an arc across its length [km].
_ARC_KM = 6.0

AURORA = Block(
    "Aurora",
    27,
    np.dtype(
        [
            # From geographic unit vectors, with 1 as the fourth component, to magnetic ones that
            # are to be normalised: columns.
            ("magnetic_north", "f4", (4, 4)),
            ("magnetic_south", "f4", (4, 4)),
            # Cosine and sine of midnight's magnetic longitude.
            ("midnight", "f4", 4),
            # Of the colatitude of the oval's edge towards the pole, towards the equator and of the
            # diffuse aurora: mean [rad], and the sine of the latitude that none exceeds; cosines
            # and sines of one to three times the local time.
            ("oval_mean", "f4", 4),
            ("oval_waves", "f4", (6, 4)),
            # As ``outside`` of the planet's block, from the layers' edges, in x.
            ("layer_outside", "f4", (_LAYERS + 1, 4)),
            # Radiance of the mean over the oval for each Earth radius of way in a layer.
            ("aurora_layers", "f4", (_LAYERS, 4)),
            ("aurora_seed", "f4"),
            ("arc_km", "f4"),
            ("arc_share", "f4"),
            ("rim", "f4"),
        ]
    ),
)


def aurora_values(planet: PlanetView, kp: float) -> dict[str, object]:
    """The block for an activity Kp."""
    earth = planet.earth
    maps = np.zeros((2, 4, 4))
    maps[:, :3] = aurora.magnetic_maps()
    longitude = aurora.midnight(np.array(planet.sun_direction_itrf))
    oval = aurora.oval(kp)
    edges = np.zeros((7, 4))
    edges[:, :3] = oval.edges.T
    widest = float(oval.colatitudes(np.linspace(0.0, 24.0, 96)).max())
    edges[0, 3] = np.cos(min(widest + np.radians(3.0), 0.5 * np.pi))
    heights = aurora.HEIGHTS / earth.equatorial_radius
    outside = np.zeros((len(heights), 4))
    outside[:, 0] = planet.outside - heights * (2.0 + heights)
    light = aurora.mean_flux(kp) * aurora.layers().T @ aurora.brightness(earth.bands)
    return {
        "magnetic_north": maps[0],
        "magnetic_south": maps[1],
        "midnight": (np.cos(longitude), np.sin(longitude), 0.0, 0.0),
        "oval_mean": edges[0],
        "oval_waves": edges[1:],
        "layer_outside": outside,
        "aurora_layers": light / np.diff(heights)[:, None],
        "aurora_seed": float(earth.clouds.seed % 1000) if earth.clouds else 0.0,
        "arc_km": _ARC_KM,
        "arc_share": aurora.ARC_SHARE,
        "rim": aurora.RIM,
    }
