"""Interreflection on each spacecraft, as values of its vertices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np

from simgl.arrays import Array, Array32
from simgl.environment_map import SkyRadiance, cell_radiance
from simgl.gpu.vertex_buffers import Values
from simgl.passes.mesh_store import VertexLighting
from simgl.radiosity.final_gather import LitBody
from simgl.radiosity.hemisphere import CELLS_ACROSS
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.patch_light import PatchLight
from simgl.radiosity.solver import beside, earth_share, material_light, vertex_irradiance
from simgl.radiosity.transport_store import JOINT_STEP, TransportStore
from simgl.scene.mean_materials import mean_materials
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.spacecraft import SpacecraftModel
from simgl.view.frame_view import SpacecraftView

_FRONT = {"in_bounced": "4f", "in_earth_share": "1f"}
_BACK = {"in_bounced_back": "4f", "in_earth_share_back": "1f"}


@dataclass(frozen=True, kw_only=True, eq=False)
class _LitPatches:
    """The light that leaves a body with a transport.

    indirect : (p, 4) of the patches after all bounces, less the Sun's before any [W m-2]
    """

    transport: LightTransport
    indirect: Array32


class InterreflectionPass:
    """Solves for the light that surfaces of one spacecraft send to each other."""

    def __init__(self, ctx: moderngl.Context, transports: TransportStore) -> None:
        self._ctx, self._transports = ctx, transports
        self._light = PatchLight()
        # One for each spacecraft of the largest scene so far.
        self._buffers: dict[int, moderngl.Buffer] = {}

    def draw(
        self, spacecraft: Sequence[SpacecraftView], skies: Sequence[SkyRadiance | None]
    ) -> list[VertexLighting | None]:
        """The values of each spacecraft; None where nothing sees itself. Valid until the next call.

        skies : what each sees around it
        """
        return [self._lighting(s, sky) for s, sky in zip(spacecraft, skies, strict=True)]

    def bodies(
        self, spacecraft: Sequence[SpacecraftView], skies: Sequence[SkyRadiance | None]
    ) -> list[list[LitBody] | None]:
        """What rays from each spacecraft meet: itself, then what is near; None where nothing is."""
        lit = {
            s.instance: self._lit_patches(s, sky) for s, sky in zip(spacecraft, skies, strict=True)
        }
        return [self._bodies_around(s, lit) for s in spacecraft]

    def _bodies_around(
        self, viewer: SpacecraftView, lit: dict[int, _LitPatches | None]
    ) -> list[LitBody] | None:
        incident, patches = viewer.exchange, lit.get(viewer.instance)
        if incident is None:
            return None
        near = [neighbour for neighbour in incident.around if neighbour.near]
        if patches is None and not near:
            return None
        models = [(viewer.model, np.eye(4), patches)]
        models += [(n.model, n.other_from_body, lit.get(n.instance)) for n in near]
        irradiance = incident.sun_irradiance.astype(np.float32)
        return [
            self._lit_body(
                model, matrix, matrix[:3, :3] @ incident.sun_direction, irradiance, patches
            )
            for model, matrix, patches in models
        ]

    def _lit_body(
        self,
        model: SpacecraftModel,
        body_from_viewer: Array,
        sun_direction: Array,
        sun_irradiance: Array32,
        patches: _LitPatches | None,
    ) -> LitBody:
        albedo, exitance = material_light(mean_materials(model))
        mesh, indirect = model.posed_mesh, None
        if patches is not None:
            mesh = _lit_mesh(model, patches.transport)
            indirect = patches.indirect[patches.transport.patch_of_side]
        return LitBody(
            mesh=mesh,
            body_from_viewer=body_from_viewer.astype(np.float32),
            sides=2 if model.open_sheets else 1,
            albedo=albedo,
            exitance=exitance,
            sun_direction=sun_direction.astype(np.float32),
            sun_irradiance=sun_irradiance,
            solved=indirect,
        )

    def _lit_patches(
        self, spacecraft: SpacecraftView, sky: SkyRadiance | None
    ) -> _LitPatches | None:
        """The light on a spacecraft; None where nothing sees itself, or that light is left out."""
        if spacecraft.exchange is None:
            return None
        transport = self._transports.of(spacecraft.model)
        if transport is None:
            return None
        model, incident = spacecraft.model, spacecraft.exchange
        exitance = self._light.exitance(model, transport, sky, incident)
        # The Sun's light is subtracted patch by patch: near a shadow's edge neighbours differ.
        direct_sun = self._light.of_direct_sun(model, transport, incident) * incident.sun_irradiance
        indirect = np.maximum(exitance - direct_sun, 0.0).astype(np.float32)
        return _LitPatches(transport=transport, indirect=indirect)

    def _lighting(
        self, spacecraft: SpacecraftView, sky: SkyRadiance | None
    ) -> VertexLighting | None:
        if spacecraft.exchange is None:
            return None
        model = spacecraft.model
        transport = self._transports.of(model)
        if transport is None:
            return None
        cells = None if sky is None else cell_radiance(sky, CELLS_ACROSS)
        gather = transport.of_vertices
        # In the other thread while this one is busy with the bounces.
        share = beside().submit(earth_share, gather, cells)
        exitance = self._light.exitance(model, transport, sky, spacecraft.exchange)
        values = np.empty((*gather.shape, 5), dtype=np.float32)
        vertex_irradiance(gather, exitance, values)
        values[..., 4] = share.result()
        buffer = self._buffer(spacecraft.instance, values.nbytes)
        buffer.write(values)
        two_sided = transport.sides == 2
        return VertexLighting(
            mesh=_lit_mesh(model, transport),
            values=Values(buffer=buffer, layout=_FRONT | _BACK if two_sided else _FRONT),
            defines=("EXCHANGE", "TWO_SIDED") if two_sided else ("EXCHANGE",),
        )

    def _buffer(self, instance: int, size: int) -> moderngl.Buffer:
        if instance not in self._buffers:
            self._buffers[instance] = self._ctx.buffer(reserve=size, dynamic=True)
        if self._buffers[instance].size != size:
            # The same object with other storage: vertex arrays that read it stay valid.
            self._buffers[instance].orphan(size)
        return self._buffers[instance]

    def release(self) -> None:
        """Free everything."""
        for buffer in self._buffers.values():
            buffer.release()
        self._buffers.clear()


def _lit_mesh(model: SpacecraftModel, transport: LightTransport) -> PosedMesh:
    """The transport's mesh with the joints where they are."""
    coarse = model.coarsely_posed(JOINT_STEP)
    return model.posed_mesh.moved_from(coarse.posed_mesh, transport.mesh)
