"""Light that a spacecraft gets from those near it, frame by frame; what stays is cached."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Array32
from simgl.environment_map import SkyRadiance, turned
from simgl.lru_cache import MANY, LruCache
from simgl.radiosity.between_spacecraft import (
    LightPath,
    NearBody,
    in_steps,
    light_path,
    sun_cosines,
)
from simgl.radiosity.convex_transport import convex_transport
from simgl.radiosity.incident_light import IncidentLight, LitNeighbour
from simgl.radiosity.light_transport import GatherMatrix, LightTransport
from simgl.radiosity.patch_light import PatchLight
from simgl.radiosity.sky_cells import sky_cells
from simgl.radiosity.transport_store import MAX_BYTES, JointLight, TransportStore
from simgl.scene.spacecraft import SpacecraftModel

_MAX_BODIES = 32
# Light goes back and forth until so much is left of it, at most so many times.
_LEFT, _MAX_JOURNEYS = 0.01, 8


@dataclass(frozen=True, kw_only=True, eq=False)
class FromNeighbours:
    """What a body gets from those around it.

    exitance : (p, 4) of its patches with that light after all bounces [W m-2]
    at_rows : (r, 4) of its vertices and their sides [W m-2]
    hidden : (r,) irradiance by the sky behind them over pi, mean of the bands [W m-2 sr-1]
    """

    exitance: Array32
    at_rows: Array32
    hidden: Array32

    def lost_share(self, gather: GatherMatrix, cells: Array32 | None) -> Array32:
        """(r,) of the sky's irradiance on a free surface what they hide.

        cells : (c, 4) radiance of the sky that the gather matrix knows; None for a dark sky
        """
        if cells is None:
            return np.zeros(len(self.hidden), dtype=np.float32)
        rays = np.asarray(gather.sky_rays.sum(axis=1)).ravel()
        free = (gather.sky_rays @ cells.mean(axis=1)) / np.maximum(rays, 1.0)
        return self.hidden / np.maximum(free, np.float32(1e-30))[gather.sky_rays_row[gather.rows]]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Near:
    """A neighbour.

    exitance : (q, 4) of its patches, but for what comes from the body and for the Sun's light
        before any bounce [W m-2]
    sunlit : (c, 4) that light in its clusters [W m-2]
    to_body, to_neighbour : how its light comes to the body, and that of the body to it
    """

    sender: NearBody
    exitance: Array32
    sunlit: Array32
    to_body: LightPath
    to_neighbour: LightPath


class NeighbourLight:
    """Works out the light between spacecraft.

    light : solves for what leaves the patches of each
    """

    def __init__(self, transports: TransportStore, light: PatchLight) -> None:
        self._transports, self._light = transports, light
        self._convex = LruCache[tuple[str, bool], LightTransport](_MAX_BODIES)
        self._bodies = LruCache[tuple[object, ...], NearBody](_MAX_BODIES)
        self._paths = LruCache[tuple[object, ...], LightPath](MANY, max_bytes=MAX_BYTES)

    def transport(self, model: SpacecraftModel, joint_light: JointLight) -> LightTransport:
        """How light goes on a body that sees itself or does not."""
        transport = self._transports.of(model, joint_light)
        if transport is not None:
            return transport
        key = model.posed_mesh.digest, model.open_sheets
        return self._convex.get(key, lambda: convex_transport(model))

    def received(
        self,
        model: SpacecraftModel,
        sky: SkyRadiance | None,
        incident: IncidentLight,
        joint_light: JointLight,
    ) -> FromNeighbours:
        """The light of all that are near, with what goes back and forth between them and the body.

        Light that goes from one neighbour to another is left out.
        """
        receiver = self._body(model, joint_light)
        separate = exitance = self._light.exitance(model, receiver.transport, sky, incident)
        neighbours = [self._lit(receiver, lit, sky, joint_light) for lit in incident.lit_by]
        leaves = max(n.to_body.largest_share * n.to_neighbour.largest_share for n in neighbours)
        for _ in range(_journeys(leaves)):
            at_patches = np.zeros((len(receiver.transport.areas), 4), dtype=np.float32)
            sent_by = []
            for near in neighbours:
                sender = near.sender
                again = near.to_neighbour.at_patches(near.to_neighbour.senders @ exitance)
                again = self._light.reflected(sender.model, sender.transport, again)
                sent_by.append(near.sunlit + near.to_body.senders @ (near.exitance + again))
                at_patches += near.to_body.at_patches(sent_by[-1])
            exitance = separate + self._light.reflected(model, receiver.transport, at_patches)
        places, _, of_row = receiver.places
        at_places = np.zeros((len(places), 4), dtype=np.float32)
        hidden = np.zeros(len(places), dtype=np.float32)
        cells = None if sky is None else sky_cells(sky).mean(axis=1)
        for near, light in zip(neighbours, sent_by, strict=True):
            at_places += near.to_body.at_places(light)
            if cells is not None:
                hidden += near.to_body.hides @ cells
        return FromNeighbours(exitance=exitance, at_rows=at_places[of_row], hidden=hidden[of_row])

    def _lit(
        self,
        receiver: NearBody,
        lit: LitNeighbour,
        sky: SkyRadiance | None,
        joint_light: JointLight,
    ) -> _Near:
        other = lit.neighbour
        sender = self._body(other.model, joint_light)
        to_body, to_neighbour = self._both_ways(receiver, sender, lit)
        around = None if sky is None else turned(sky, other.other_from_body[:3, :3].T)
        sent = self._light.exitance(other.model, sender.transport, around, lit.light)
        sunlit = np.zeros((to_body.means.shape[0], 4), dtype=np.float32)
        sun = lit.light.sun_irradiance.astype(np.float32)
        if sun.any():
            # Large patches of a hull bend: their mean is not what is seen of them.
            sent = sent - sun * self._light.of_direct_sun(other.model, sender.transport, lit.light)
            blockers = [neighbour.blocker() for neighbour in lit.light.before_sun]
            cosines = sun_cosines(sender, to_body.samples, lit.light.sun_direction, blockers)
            albedo = self._light.albedo(other.model, sender.transport)
            patch = sender.samples[3][to_body.samples]
            sunlit = to_body.means @ (cosines[:, None] * albedo[patch] * sun)
        return _Near(
            sender=sender, exitance=sent, sunlit=sunlit, to_body=to_body, to_neighbour=to_neighbour
        )

    def _body(self, model: SpacecraftModel, joint_light: JointLight) -> NearBody:
        transport = self.transport(model, joint_light)
        key = transport.digest, model.posed_mesh.digest, model.open_sheets
        return self._bodies.get(key, lambda: NearBody(model=model, transport=transport))

    def _both_ways(
        self, receiver: NearBody, sender: NearBody, lit: LitNeighbour
    ) -> tuple[LightPath, LightPath]:
        """From the sender to the receiver, and back."""
        matrix = in_steps(lit.neighbour.other_from_body, lit.gap)
        inverse: Array = np.linalg.inv(matrix).astype(np.float64)
        key = matrix.tobytes()
        to_body = self._paths.get(
            (receiver.key, sender.key, key),
            lambda: light_path(receiver, sender, matrix),
            lambda path: path.nbytes,
        )
        to_neighbour = self._paths.get(
            (sender.key, receiver.key, key, "back"),
            lambda: light_path(sender, receiver, inverse),
            lambda path: path.nbytes,
        )
        return to_body, to_neighbour


def _journeys(leaves: float) -> int:
    """There and back again, each of which leaves so much of the light."""
    if leaves <= _LEFT:
        return 1
    return min(int(np.ceil(np.log(_LEFT) / np.log(min(leaves, 0.999)))), _MAX_JOURNEYS)
