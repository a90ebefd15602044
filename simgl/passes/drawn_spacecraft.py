"""What one frame draws of a spacecraft: the record that the renderer hands from pass to pass."""

from __future__ import annotations

from dataclasses import dataclass, field

import moderngl
import numpy as np

from simgl.environment_map import SkyRadiance, turned
from simgl.lru_cache import LruCache
from simgl.passes.mesh_store import VertexLighting
from simgl.passes.shared_blocks import AirBetween
from simgl.radiosity.final_gather import LitBody
from simgl.scene.posed_mesh import PosedMesh
from simgl.view.background import SkyView
from simgl.view.spacecraft_view import SpacecraftView

# Attitudes in which a sky is cached, of half a megabyte each.
_MAX_TURNED = 8

SkyTextures = tuple[moderngl.Texture, moderngl.Texture3D, moderngl.Texture]


@dataclass(frozen=True, kw_only=True, eq=False)
class EnvironmentProbe:
    """The sky of spacecraft at one place, in the axes of the first of them.

    sky : on the CPU
    cube : its radiance on the faces of a cube with borders, one below the other
    lobes : the sky as glossy lobes see it, an octahedral map for each of
        ``simgl.glossy_sky.ROUGHNESS``
    irradiance : an octahedral map by normal
    """

    sky: SkyRadiance
    cube: moderngl.Texture
    lobes: moderngl.Texture3D
    irradiance: moderngl.Texture
    _turned: LruCache[bytes, SkyRadiance] = field(default_factory=lambda: LruCache(_MAX_TURNED))

    def sky_around(self, view: SkyView) -> SkyRadiance:
        """The sky in the body axes of a spacecraft that sees it."""
        R = view.R_sky_from_body
        if np.array_equal(R, np.eye(3)):
            return self.sky
        return self._turned.get(R.tobytes(), lambda: turned(self.sky, R))

    @property
    def textures(self) -> SkyTextures:
        """What the surface shader reads."""
        return self.cube, self.lobes, self.irradiance


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnSpacecraft:
    """A spacecraft with all that its light takes, assembled once for each tile of a frame.

    shadow_maps : of the Sun, in the order of the surface pass's samplers
    probe : the Earth and sky around it; None where there is no Earth
    vertex_lighting : interreflected light at its vertices; None where its surfaces exchange none
    lit_bodies : for the reference gather instead, what rays from it can meet: itself and what is
        near
    mirrored : the same for what its glossy surfaces see; none where they see uniform light
    air : between it and the camera; None where there is none
    """

    view: SpacecraftView
    shadow_maps: tuple[moderngl.Texture, ...]
    probe: EnvironmentProbe | None = None
    vertex_lighting: VertexLighting | None = None
    lit_bodies: tuple[LitBody, ...] = ()
    mirrored: tuple[LitBody, ...] = ()
    air: AirBetween | None = None

    @property
    def mesh(self) -> PosedMesh:
        """What is drawn of it."""
        lighting = self.vertex_lighting
        return self.view.model.posed_mesh if lighting is None else lighting.mesh

    @property
    def sky(self) -> SkyRadiance | None:
        """Around it, body axes; None where there is no Earth."""
        if self.probe is None or self.view.sky is None:
            return None
        return self.probe.sky_around(self.view.sky)

    @property
    def interreflects(self) -> bool:
        """Whether light from other surfaces reaches it."""
        return self.vertex_lighting is not None or bool(self.lit_bodies)
