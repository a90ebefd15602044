"""Light of the sky that glossy surfaces send on in lobes: by where it goes, not evenly.

Each cell of the sky lights a patch from one direction, the mean of what of it stands above the
patch. What vertices get of that more than of patches that send evenly is a sum over the cells. As
lobes and cells are wide it is smooth over the sky, so that a few polynomials of the direction stand
for all cells.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from itertools import product

import numpy as np

from simgl.arrays import Array, Array32
from simgl.disk_cache import Arrays, computed_once
from simgl.environment_map import cube_directions, cube_solid_angles
from simgl.radiosity.gather_points import unit_rows
from simgl.radiosity.glossy_places import GRAZING
from simgl.radiosity.hemisphere import CELLS_ACROSS, SKY_CELLS
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.lobe_sunlight import LobeSunlight
from simgl.radiosity.reflection_laws import ReflectionLaws
from simgl.radiosity.sky_cells import FINE_ACROSS, parts_of_cells

_DEGREE = 5
# Gather points whose sums are multiplied together: products so small that BLAS keeps them to one
# thread.
_AT_ONCE = 1024
_MADE_BY = (
    __name__,
    "simgl.radiosity.lobe_sunlight",
    "simgl.radiosity.lobe_pairs",
    "simgl.radiosity.glossy_places",
    "simgl.radiosity.reflection_laws",
    "numpy",
)


class SkyLobes:
    """What the lobes of a body's patches make of the light of the sky.

    laws : of the body's materials; law : (p,) of the patches
    lobes : of the body, of which there are some
    """

    def __init__(
        self, transport: LightTransport, laws: ReflectionLaws, lobes: LobeSunlight
    ) -> None:
        self._transport, self._laws, self._lobes = transport, laws, lobes
        self._law = np.argmax(transport.materials, axis=1)

    @property
    def nbytes(self) -> int:
        """Size of its arrays, which it makes at the latest now."""
        return sum(array.nbytes for array in self._made.values())

    def at_points(self, cell_radiance: Array32) -> Array32:
        """(s, 4) what gather points of vertices get more than of patches that send evenly [W m-2].

        cell_radiance : (96, 4) of the sky [W m-2 sr-1]
        """
        sums, colour = self._made["sums"], self._made["colour"]
        of_sky = (_polynomials()[1] @ cell_radiance).astype(np.float32)
        light = np.empty_like(colour)
        for start in range(0, len(sums), _AT_ONCE):
            part = slice(start, start + _AT_ONCE)
            np.matmul(sums[part], of_sky, out=light[part])
        light *= colour
        return light

    def leaving(self, albedo: Array32) -> Array32:
        """(p, 4, 96) what leaves patches by each cell of radiance 1 before bounces, and by that
        part of the second reflection by which lobes bring more than even light would.

        albedo : (p, 4) of the patches
        """
        irradiance, facing = self._irradiance, self._seen[1]
        more = self._made["patches"][:, None] * self._made["colour of patches"][:, :, None]
        leaving: Array32 = albedo[:, :, None] * (irradiance[:, None] + more)
        glossy = self._lobes.glossy
        for cell in range(SKY_CELLS):
            lit = glossy[irradiance[glossy, cell] > 0.0]
            share = self._laws.of_light(self._law[lit], facing[lit, cell]).sum(axis=0)
            share -= albedo[lit]
            leaving[lit, :, cell] += share * irradiance[lit, cell, None]
        return leaving

    @cached_property
    def _irradiance(self) -> Array32:
        """(p, 96) by each cell of radiance 1: rays follow the cosine, each stands for pi over their
        number."""
        return np.asarray(np.float32(np.pi) * self._transport.sky.toarray())

    @cached_property
    def _seen(self) -> tuple[Array32, Array32]:
        """(p, 96, 3) unit directions of cells as patches see them, and (p, 96) their cosines."""
        normals = unit_rows(self._transport.normals.mean(axis=1)).astype(np.float32)
        fine = cube_directions(FINE_ACROSS).reshape(-1, 3).astype(np.float32)[parts_of_cells()]
        area = np.tile(cube_solid_angles(FINE_ACROSS).ravel(), 6)[parts_of_cells()]
        directions = np.empty((len(normals), SKY_CELLS, 3), dtype=np.float32)
        for cell, (parts, weights) in enumerate(zip(fine, area.astype(np.float32), strict=True)):
            # What is not above counts a little, for cells of which nothing is.
            seen = np.maximum(normals @ parts.T, np.float32(1e-4)) * weights
            directions[:, cell] = seen @ parts
        directions /= np.linalg.norm(directions, axis=2, keepdims=True)
        cosine = np.einsum("pci,pi->pc", directions, normals)
        return directions, np.maximum(cosine, np.float32(GRAZING))

    @cached_property
    def _made(self) -> Arrays:
        """For gather points and for patches what they get more, for light that is alike in all
        bands, of polynomials and of cells, and its colour."""
        transport, laws = self._transport, self._laws
        inputs = (
            transport.digest,
            *(transport.areas, transport.points, transport.point_open, transport.materials),
            *(np.array(transport.gather.shape), transport.gather.nnz),
            *(transport.start_places, transport.start_normals),
            *(laws.lobes, laws.f0, laws.alpha2, laws.covered, laws.conserving, laws.once),
        )
        shapes = len(transport.areas), SKY_CELLS

        def fits(arrays: Arrays) -> bool:
            points = arrays["sums"].shape[0], arrays["colour"].shape[0]
            return arrays["patches"].shape == shapes and set(points) == {transport.gather.shape[0]}

        return computed_once("sky_lobes", _MADE_BY, inputs, self._make, fits)

    def _make(self) -> Arrays:
        transport, glossy = self._transport, self._lobes.glossy
        directions, facing = self._seen
        points, patches = transport.gather.shape[0], len(transport.areas)
        surplus = [np.zeros((count, SKY_CELLS), dtype=np.float32) for count in (points, patches)]
        colours = [np.zeros((count, 4), dtype=np.float32) for count in (points, patches)]
        evenly = np.zeros((patches, SKY_CELLS), dtype=np.float32)
        for cell in range(SKY_CELLS):
            irradiance = self._irradiance[glossy, cell]
            sent = self._laws.of_light(self._law[glossy], facing[glossy, cell])[1].mean(axis=1)
            evenly[glossy, cell] = sent * irradiance
            lit = self._lobes.of_sky(directions[glossy, cell], irradiance)
            for light, more, colour in zip(lit, surplus, colours, strict=True):
                more[:, cell] = light.mean(axis=1)
                colour += light
        at_points = transport.of_vertices.at_points(transport.gather @ evenly)
        for more, even in zip(surplus, (at_points, transport.form_factors @ evenly), strict=True):
            more -= even
        for colour in colours:
            colour /= np.maximum(colour.mean(axis=1, keepdims=True), np.float32(1e-9))
        return {
            "sums": (surplus[0] @ _polynomials()[0]).astype(np.float32),
            "colour": colours[0],
            "patches": surplus[1],
            "colour of patches": colours[1],
        }


@lru_cache(maxsize=1)
def _polynomials() -> tuple[Array, Array]:
    """(96, k) and (k, 96): what is smooth over the cells, times the product of both, is itself.

    All polynomials of the direction up to a degree, made orthogonal over the sky.
    """
    directions = cube_directions(CELLS_ACROSS).reshape(-1, 3)
    root = np.sqrt(np.tile(cube_solid_angles(CELLS_ACROSS).ravel(), 6))[:, None]
    # On the sphere z^2 is 1 - x^2 - y^2: those of z and of none of it are all.
    powers = [
        (i, j, k)
        for i, j, k in product(range(_DEGREE + 1), range(_DEGREE + 1), (0, 1))
        if i + j + k <= _DEGREE
    ]
    values = np.stack([np.prod(directions**power, axis=1) for power in powers], axis=1)
    orthogonal, _ = np.linalg.qr(root * values)
    return orthogonal / root, (root * orthogonal).T
