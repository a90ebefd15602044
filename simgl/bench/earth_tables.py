"""Tables and textures of the Earth: what they take to make, and their size.

python -m simgl.bench.earth_tables FILE.json, with an empty cache folder.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import msgspec

from simgl.arrays import Image8
from simgl.bench.results import TableResult
from simgl.gpu.context import temporary_context
from simgl.passes.background.air_tables import ORDERS, AirKind, make_tables
from simgl.passes.background.cloud_map import noise_texture, weather_codes
from simgl.passes.background.earth_maps import (
    ground_textures,
    make_form_map,
    make_lamp_map,
    make_land_map,
    make_shore_map,
)
from simgl.physics.atmosphere import STANDARD
from simgl.scene.earth import Clouds, Earth
from simgl.scene.noise_projection import make_chart


def earth_tables() -> list[TableResult]:
    """Standard atmosphere, shipped maps, default clouds."""
    earth = Earth(air=STANDARD, clouds=Clouds())
    results: list[TableResult] = []

    def note(name: str, make: Callable[[], int]) -> None:
        start = time.perf_counter()
        size = make()
        seconds = round(time.perf_counter() - start, 2)
        results.append(TableResult(name=name, bytes=size, seconds=seconds))

    with temporary_context() as ctx:
        kind = AirKind(air=STANDARD, radius=earth.equatorial_radius, albedo=earth.mean_albedo)

        def air() -> int:
            return sum(t.nbytes for t in make_tables(ctx, kind, orders=ORDERS).values())

        note("air, all views", air)
        # With their mipmaps, a third of the largest level; the chart also level by level.
        noise, ground = noise_texture(ctx, 0), ground_textures(ctx, earth.maps)
        note("weather", lambda: weather_codes(ctx, Clouds(), noise, ground).nbytes * 4 // 3)
        noise.release()
        for texture in ground:
            texture.release()
        note("noise of clouds and hills", lambda: 2 * sum(c.nbytes for c in make_chart(0)[0]))
        note("maps", lambda: sum(codes.nbytes for codes in _made_maps()) * 4 // 3)
    return results


def _made_maps() -> list[Image8]:
    return [make_land_map(None), make_form_map(), make_shore_map(None), make_lamp_map(None)]


def main() -> None:
    """Make them and write what they took."""
    Path(sys.argv[1]).write_bytes(msgspec.json.encode(earth_tables()))


if __name__ == "__main__":
    main()
