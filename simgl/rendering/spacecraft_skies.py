"""What spacecraft have around them, drawn for their heat: light, and warmth in any band."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np

from simgl.arrays import Array
from simgl.camera.infrared_detector import InfraredDetector
from simgl.gpu.context import current
from simgl.rendering.renderer import Renderer
from simgl.scene.state import SceneState
from simgl.thermal.infrared_surroundings import (
    share_in_bands,
    surroundings_at_all_wavelengths,
    surroundings_in_band,
)
from simgl.thermal.sky_light import EmptySkies, SkyLight, on_cells
from simgl.view.background import SkyView, sky_view

_EMPTY = EmptySkies()
# Of sunlight at all wavelengths the Earth reflects 0.29 (Loeb et al. 2018), of that from 400 to
# 1000 nm 0.32: it is brighter in the ultraviolet and darker beyond 1 um. An estimate.
ALL_WAVELENGTHS = 0.9


@dataclass(frozen=True, eq=False)
class SpacecraftSkies:
    """The skies of a renderer, by which it lights spacecraft in images (``Skies``)."""

    renderer: Renderer
    ctx: moderngl.Context

    def heat(self, state: SceneState, name: str) -> SkyLight:
        """Sunlight that the Earth reflects, and its long-wave radiation, at all wavelengths
        [W m-2 sr-1].

        The light in the scene's bands stands for all sunlight, of an Earth with maps to
        ``ALL_WAVELENGTHS``. That of night, a thousandth of a watt, goes along.
        """
        view = sky_view(state, name, state.bodies[name])
        if view is None or state.earth is None:
            return _EMPTY.heat(state, name)
        darker = ALL_WAVELENGTHS if state.earth.earth.albedo is None else 1.0
        with current(self.ctx):
            light = self.renderer.skies.sky(view).radiance.sum(axis=-1)
            warmth = self.renderer.infrared_sky(view, surroundings_at_all_wavelengths(state))[
                ..., 0
            ]
        reflected = on_cells(light) * (darker / share_in_bands(state.bands))
        return _sky_light(view, reflected, on_cells(warmth))

    def in_band(self, state: SceneState, name: str, detector: InfraredDetector) -> SkyLight:
        """In the band of a detector, in W m-2 sr-1 and as it counts."""
        view = sky_view(state, name, state.bodies[name])
        if view is None:
            return _EMPTY.in_band(state, name, detector)
        with current(self.ctx):
            seen = self.renderer.infrared_sky(view, surroundings_in_band(state, detector))
        return _sky_light(view, on_cells(seen[..., 0]), on_cells(seen[..., 1]))


def _sky_light(view: SkyView, *lights: Array) -> SkyLight:
    return SkyLight(cells=np.stack(lights, axis=1), R_sky_from_body=view.R_sky_from_body)
