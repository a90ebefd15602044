"""Light that spacecraft near each other exchange, frame by frame; what stays is cached."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array32, IndexArray
from simgl.lru_cache import MANY, LruCache
from simgl.radiosity.between_spacecraft import (
    FINE_STEP,
    STEP,
    LightPath,
    PosedPath,
    light_path,
)
from simgl.radiosity.convex_transport import convex_transport
from simgl.radiosity.incident_light import NearPair, faded
from simgl.radiosity.isolated_light import IsolatedLight
from simgl.radiosity.light_transport import GatherMatrix, LightTransport
from simgl.radiosity.near_body import NearBody, standing_rows
from simgl.radiosity.patch_light import PatchLight
from simgl.radiosity.pose_steps import in_steps
from simgl.radiosity.posed_transport import PosedTransport
from simgl.radiosity.reflection_laws import ReflectionLaws
from simgl.radiosity.sky_cells import sky_cells
from simgl.radiosity.third_bodies import third_bodies, unhidden
from simgl.radiosity.transport_store import MAX_BYTES, STEPS, TransportStore
from simgl.scene.spacecraft import SpacecraftModel

_MAX_BODIES = 32
# Poses that move go through many.
_MAX_POSED = 16
# Light goes back and forth while it brings a body so much of the light that leaves it, at most so
# many times. Of less, what the body sends to itself and back is left out.
_ENOUGH, _MAX_JOURNEYS = 5e-3, 8
# Of the bounces on each body in between: they are a part of a part of its light.
_RESIDUAL = 0.03


@dataclass(frozen=True, kw_only=True, eq=False)
class FromNeighbours:
    """What a body gets from those around it.

    exitance : (p, 4) that their light adds to its patches, after all bounces [W m-2]
    at_rows : (r, 4) irradiance of its vertices and their sides, less what they hide of its own
        surfaces [W m-2]
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
class _Way:
    """How light goes between two of some bodies, and how much of it counts."""

    pair: NearPair
    path: LightPath
    posed: PosedPath


@dataclass(frozen=True, kw_only=True, eq=False)
class _Sunlit:
    """The light that leaves a body: large patches of a hull bend, and their mean is not what is
    seen of the Sun's light before any bounce.

    rest : (p, 4) exitance but for that [W m-2]
    evenly : (p, 4) what leaves evenly of that where the Sun stands above [W m-2]; None without it
    """

    rest: Array32
    evenly: Array32 | None


class MutualLight:
    """The light of bodies after all journeys between them.

    isolated : with the light that each would have without the others
    sent : (c, 4) exitance of the clusters of each way [W m-2]
    lobes : what their lobes send, as of ``SentLobes``; None without them
    more : (p, 4) what that adds to the exitance of each body [W m-2]
    """

    def __init__(
        self,
        bodies: Sequence[NearBody],
        isolated: Sequence[IsolatedLight],
        ways: Sequence[_Way],
        sent: Sequence[Array32],
        lobes: Sequence[Array32 | None],
        more: Sequence[Array32],
    ) -> None:
        self._bodies, self._more = bodies, more
        self._skies = [one.sky for one in isolated]
        self._undisturbed = [one.exitance for one in isolated]
        self._arriving = [
            (way.pair.receiver, np.float32(way.pair.weight), way.posed, light, of_lobes)
            for way, light, of_lobes in zip(ways, sent, lobes, strict=True)
        ]

    def received(self, number: int) -> FromNeighbours:
        """What one of the bodies gets."""
        places, _, of_row = self._bodies[number].places
        light = np.zeros((len(places), 4), dtype=np.float32)
        hidden = np.zeros(len(places), dtype=np.float32)
        sky = self._skies[number]
        cells = None if sky is None else sky_cells(sky).mean(axis=1)
        leaving = self._undisturbed[number] + self._more[number]
        for receiver, weight, posed, sent, of_lobes in self._arriving:
            if receiver != number:
                continue
            light += posed.to_places @ (weight * sent)
            if of_lobes is not None:
                light += posed.lobes_to_places @ (weight * of_lobes)
            if posed.hides_from_places.nnz:
                light -= posed.hides_from_places @ (weight * leaving)
            if cells is not None:
                hidden += posed.hides @ (weight * cells)
        return FromNeighbours(
            exitance=self._more[number],
            at_rows=np.take(light, of_row, axis=0),
            hidden=hidden[of_row],
        )


class NeighbourLight:
    """Works out the light between spacecraft.

    light : solves for what leaves the patches of each
    """

    def __init__(self, transports: TransportStore, light: PatchLight) -> None:
        self._transports, self._light = transports, light
        self._coarse = LruCache[tuple[str, bool], LightTransport](_MAX_BODIES)
        self._bodies = LruCache[tuple[object, ...], NearBody](_MAX_BODIES)
        self._standing = LruCache[tuple[str, int], IndexArray](_MAX_BODIES)
        self._paths = LruCache[tuple[object, ...], LightPath](MANY, max_bytes=MAX_BYTES)
        self._posed = LruCache[tuple[object, ...], PosedPath](_MAX_POSED, max_bytes=MAX_BYTES)

    def coarse_transport(self, model: SpacecraftModel) -> LightTransport:
        """How light goes on a body whose surfaces do not see each other, or that is not drawn."""
        coarse = model.coarsely_posed(STEPS["exact"])
        key = coarse.posed_mesh.digest, model.open_sheets
        return self._coarse.get(key, lambda: convex_transport(model))

    def mutual_light(
        self, isolated: Sequence[IsolatedLight], pairs: Sequence[NearPair]
    ) -> MutualLight:
        """The light of spacecraft after all journeys between them."""
        self._coarse.reserve(len(isolated))
        self._bodies.reserve(len(isolated))
        self._standing.reserve(len(isolated))
        self._paths.reserve(2 * len(pairs))
        self._posed.reserve(len(pairs))
        bodies = [self._body(one) for one in isolated]
        ways = [self._way(isolated, bodies, pair) for pair in pairs]
        sunlit = [self._sunlit(one) for one in isolated]
        sent, lobes = [], []
        for way in ways:
            number = way.pair.sender
            laws = bodies[number].laws
            evenly, of_lobes = self._sent_first(way, isolated[number], laws, sunlit[number])
            sent.append(evenly)
            lobes.append(of_lobes)
        more = [np.zeros_like(one.exitance) for one in isolated]
        added, bounced = sent, {i: one.exitance for i, one in enumerate(isolated)}
        arriving_lobes = lobes
        for _ in range(_MAX_JOURNEYS):
            bounced = self._bounced(isolated, more, ways, (added, arriving_lobes, bounced))
            if not bounced:
                break
            for number, light in bounced.items():
                more[number] = more[number] + light
            added = [_sent_on(way, bounced) for way in ways]
            arriving_lobes = [None] * len(ways)
            sent = [a + b for a, b in zip(sent, added, strict=True)]
        return MutualLight(bodies, isolated, ways, sent, lobes, more)

    def _sunlit(self, one: IsolatedLight) -> _Sunlit:
        sun = one.incident.sun_irradiance.astype(np.float32)
        if not sun.any():
            return _Sunlit(rest=one.exitance, evenly=None)
        direct, even = self._light.direct_and_even(one.model, one.transport, one.incident)
        return _Sunlit(rest=one.exitance - sun * direct, evenly=sun * even)

    def _sent_first(
        self, way: _Way, one: IsolatedLight, laws: ReflectionLaws, sunlit: _Sunlit
    ) -> tuple[Array32, Array32 | None]:
        """(c, 4) exitance of the clusters of a way [W m-2], and what their lobes send, as of
        ``SentLobes``; None without them."""
        path, first = way.path, way.path.senders @ sunlit.rest
        if sunlit.evenly is None:
            return first, None
        incident = one.incident
        cosines = self._light.sun_at_samples(one.model, one.transport, incident, path.samples)
        first += path.means_of_patches(cosines) @ sunlit.evenly
        if path.lobes is None:
            return first, None
        sun = incident.sun_direction, incident.sun_irradiance
        return first, path.lobes.light(laws, way.posed.sender_from_receiver, sun, cosines)

    def _bounced(
        self,
        isolated: Sequence[IsolatedLight],
        more: Sequence[Array32],
        ways: Sequence[_Way],
        last: tuple[Sequence[Array32], Sequence[Array32 | None], Mapping[int, Array32]],
    ) -> dict[int, Array32]:
        """(p, 4) exitance that light just sent adds to bodies, where it is not too little beside
        their own and what others have added so far.

        last : (c, 4) that light, of each way, that of lobes, and (p, 4) what the exitance of bodies
            rose by, of which others hide a part from themselves
        """
        arriving: dict[int, Array32] = {}
        sent, lobes, risen = last
        for way, light, of_lobes in zip(ways, sent, lobes, strict=True):
            number, part = way.pair.receiver, np.float32(way.pair.weight)
            at = way.posed.to_patches @ (part * light)
            if of_lobes is not None:
                at += way.posed.lobes_to_patches @ (part * of_lobes)
            if number in risen and way.posed.hides_from_patches.nnz:
                at -= way.posed.hides_from_patches @ (part * risen[number])
            arriving[number] = arriving[number] + at if number in arriving else at
        bounced = {}
        for number, irradiance in arriving.items():
            one = isolated[number]
            areas = one.transport.areas
            present = float((areas @ one.exitance).sum() + (areas @ more[number]).sum())
            added = float((areas @ np.abs(irradiance)).sum()) / max(present, 1e-30)
            weight = faded(added, _ENOUGH)
            if weight > 0.0:
                light = np.float32(weight) * irradiance
                bounced[number] = self._light.reflected(one.model, one.transport, light, _RESIDUAL)
        return bounced

    def _body(self, one: IsolatedLight) -> NearBody:
        model, transport = one.model, one.transport
        if isinstance(transport, PosedTransport):
            # What another one sees of it changes little over larger steps than light on it does.
            coarse = model.coarsely_posed(STEPS["exact"], near_stay=False)
            if coarse.posed_mesh.motion is None:
                coarse = model.coarsely_posed(STEPS["quick"], near_stay=False)
            posed = self._transports.of(coarse, "quick")
            assert posed is not None
            transport = posed
        else:
            coarse = model.coarsely_posed(STEPS["exact"])
        meshes = transport.digest, coarse.posed_mesh.digest
        key = *meshes, model.open_sheets, model.surface_digest

        def near_body() -> NearBody:
            of_mesh = transport.mesh.digest, transport.sides
            standing = self._standing.get(of_mesh, lambda: standing_rows(transport))
            laws = self._light.laws(model, transport)
            return NearBody(model=coarse, transport=transport, laws=laws, standing=standing)

        return self._bodies.get(key, near_body)

    def _way(
        self, isolated: Sequence[IsolatedLight], bodies: Sequence[NearBody], pair: NearPair
    ) -> _Way:
        receiver, sender = bodies[pair.receiver], bodies[pair.sender]
        matrix = in_steps(pair.sender_from_receiver, pair.reach, STEP)
        key: tuple[object, ...] = (receiver.key, sender.key, matrix.tobytes())
        path = self._paths.get(
            key, lambda: light_path(receiver, sender, matrix), lambda path: path.nbytes
        )
        itself = isolated[pair.sender].instance
        around = [o for o in isolated[pair.receiver].incident.around if o.instance != itself]
        third = third_bodies(around, receiver.model, sender.model, pair.sender_from_receiver)
        if third:
            key = *key, *(other.key for other in third)
            free, blockers = path, [other.blocker() for other in third]
            path = self._paths.get(
                key, lambda: unhidden(free, matrix, blockers), lambda path: path.nbytes
            )
        fine = in_steps(pair.sender_from_receiver, pair.reach, FINE_STEP)
        posed = self._posed.get(
            (key, fine.tobytes()),
            lambda: PosedPath(path=path, sender_from_receiver=fine),
            lambda posed: posed.nbytes,
        )
        return _Way(pair=pair, path=path, posed=posed)


def _sent_on(way: _Way, bounced: dict[int, Array32]) -> Array32:
    """(c, 4) what the sender of a way sends of light that bounced [W m-2]."""
    light = bounced.get(way.pair.sender)
    if light is None:
        return np.zeros((way.path.senders.shape[0], 4), dtype=np.float32)
    return way.path.senders @ light
