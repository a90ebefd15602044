"""Interreflection on each spacecraft, as values of its vertices."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import moderngl
import numpy as np

from simgl.environment_map import SkyRadiance
from simgl.gpu.vertex_buffers import Values
from simgl.passes.mesh_store import VertexLighting
from simgl.radiosity.incident_light import IncidentLight
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.patch_light import PatchLight
from simgl.radiosity.solver import earth_share, vertex_irradiance
from simgl.radiosity.transport_store import JointLight, TransportStore, lit_mesh
from simgl.scene.spacecraft import SpacecraftModel
from simgl.view.spacecraft_view import SpacecraftView

_FRONT = {"in_bounced": "4f", "in_earth_share": "1f"}
_BACK = {"in_bounced_back": "4f", "in_earth_share_back": "1f"}


@dataclass(frozen=True, kw_only=True, eq=False)
class _Solved:
    """What the vertices of a spacecraft hold, and what that was made of."""

    made_of: tuple[SpacecraftModel, LightTransport, SkyRadiance | None, tuple[Hashable, ...]]
    lighting: VertexLighting


class InterreflectionPass:
    """Solves for the light that surfaces of one spacecraft send to each other.

    It does not depend on who looks: further cameras of one state, and further rasters of one image,
    read what the first one got.

    executor : takes a part of the work on the CPU
    """

    def __init__(
        self, ctx: moderngl.Context, transports: TransportStore, executor: Executor
    ) -> None:
        self._ctx, self._transports, self._executor = ctx, transports, executor
        self._light = PatchLight()
        # One for each spacecraft of the largest scene so far.
        self._buffers: dict[int, moderngl.Buffer] = {}
        self._solved: dict[int, _Solved] = {}

    def draw(
        self,
        spacecraft: Sequence[SpacecraftView],
        skies: Sequence[SkyRadiance | None],
        joint_light: JointLight,
    ) -> list[VertexLighting | None]:
        """The values of each spacecraft; None where nothing sees itself. Valid until the next call.

        skies : what each sees around it
        """
        return [
            self._lighting(s, sky, joint_light) for s, sky in zip(spacecraft, skies, strict=True)
        ]

    def _lighting(
        self, spacecraft: SpacecraftView, sky: SkyRadiance | None, joint_light: JointLight
    ) -> VertexLighting | None:
        if spacecraft.incident_light is None:
            return None
        model = spacecraft.model
        transport = self._transports.of(model, joint_light)
        if transport is None:
            return None
        made_of = model, transport, sky, spacecraft.incident_light.key
        last = self._solved.pop(spacecraft.instance, None)
        if last is None or last.made_of != made_of:
            lighting = self._solve(spacecraft, spacecraft.incident_light, transport, sky)
            last = _Solved(made_of=made_of, lighting=lighting)
        self._solved[spacecraft.instance] = last
        return last.lighting

    def _solve(
        self,
        spacecraft: SpacecraftView,
        light: IncidentLight,
        transport: LightTransport,
        sky: SkyRadiance | None,
    ) -> VertexLighting:
        model = spacecraft.model
        cells = None if sky is None else transport.cells_of(sky)
        gather = transport.of_vertices
        # In another thread while this one is busy with the bounces.
        share = self._executor.submit(earth_share, gather, cells)
        exitance = self._light.exitance(model, transport, sky, light)
        values = np.empty((*gather.shape, 5), dtype=np.float32)
        vertex_irradiance(gather, exitance, values, self._executor)
        values[..., 4] = share.result()
        buffer = self._buffer(spacecraft.instance, values.nbytes)
        buffer.write(values)
        two_sided = transport.sides == 2
        return VertexLighting(
            mesh=lit_mesh(model, transport),
            values=Values(buffer=buffer, layout=_FRONT | _BACK if two_sided else _FRONT),
            defines=("INTERREFLECTION", "TWO_SIDED") if two_sided else ("INTERREFLECTION",),
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
        self._solved.clear()
