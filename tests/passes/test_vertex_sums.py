"""Light at vertices, summed by compute shaders, is what the CPU makes of the same."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array32
from simgl.gpu.mesh_tables import COLUMNS
from simgl.passes.mesh_store import GridLight, VertexLighting
from simgl.passes.vertex_sums import SkyOfVertices, VertexInputs, VertexSums, near_table
from simgl.radiosity.patch_light import PatchLight, UnsummedSunlight
from simgl.radiosity.precomputed_response import GatheredSunlight
from simgl.radiosity.solver import earth_share, vertex_irradiance
from simgl.scene.materials import Material
from tests.radiosity.glossy_walls import BLACK, WALL, WIDE, baked
from tests.radiosity.test_hidden_sunlight import MATT, SUN, plate_and_wall, sheet

HALF_A_SHADE = sheet(0.4), 0.5 * SUN + [1.6, 0.6, 0.0]


def table(gl: moderngl.Context, texels: int) -> moderngl.Texture:
    return gl.texture((COLUMNS, -(-texels // COLUMNS)), 4, dtype="f4")


def texels(texture: moderngl.Texture) -> Array32:
    return np.frombuffer(texture.read(), dtype=np.float32).reshape(-1, 4)


@pytest.mark.parametrize("neighbours", [False, True])
@pytest.mark.parametrize("sunny", [False, True])
@pytest.mark.parametrize("shaded", [False, True])
@pytest.mark.parametrize("plate", [WIDE["alpha 0.2"], MATT], ids=["metal", "matt"])
def test_sums_on_a_gpu_are_those_of_the_cpu(
    gl: moderngl.Context, plate: Material, shaded: bool, sunny: bool, neighbours: bool
) -> None:
    """Patches, sky, sunlight on surfaces, what others take of it, and what they send."""
    transport, light, rng = baked(WALL), PatchLight(), np.random.default_rng(4)
    body, incident = plate_and_wall(plate, BLACK, HALF_A_SHADE if shaded else None)
    if not sunny:
        incident = replace(incident, sun_irradiance=np.zeros(4))
    exitance = rng.random((len(transport.areas), 4), dtype=np.float32)
    cells = None if neighbours else rng.random((96, 4), dtype=np.float32)
    matrix = transport.of_vertices
    count = len(matrix.rows)
    near = None
    if neighbours:
        near = rng.normal(size=(count, 4)).astype(np.float32), rng.random(count, dtype=np.float32)
    summed, unsummed = (
        light.besides_sky(body, transport, incident, summed=summed) for summed in (True, False)
    )
    assert summed is not None
    assert unsummed is not None
    sunlight = summed.sunlight
    assert sunlight is None or isinstance(sunlight, GatheredSunlight)
    assert not isinstance(unsummed.sunlight, GatheredSunlight)
    more = None if sunlight is None else sunlight.vertices
    irradiance = vertex_irradiance(matrix, exitance, more)
    share = earth_share(matrix, cells).ravel()
    if near is not None:
        irradiance, share = np.maximum(irradiance + near[0], 0.0), np.maximum(share - near[1], 0.0)
    assert irradiance.max() > 0.1
    vertices, grids = table(gl, 2 * count), None
    if sunlight is not None:
        nodes = table(gl, len(sunlight.nodes))
        grids = GridLight(of_triangle=nodes, rows=nodes, light=nodes)
    sums = VertexSums(gl)
    inputs = VertexInputs(
        transport=transport,
        exitance=exitance,
        sky=SkyOfVertices.of(transport, cells),
        sunlight=unsummed.sunlight,
        near=None if near is None else near_table(*near),
    )
    for _ in range(2):
        sums.write(
            inputs, VertexLighting(mesh=body.posed_mesh, light=vertices, defines=(), grids=grids)
        )
    found = texels(vertices)
    # Sums of some hundred values in another order.
    atol = 1e-6 * float(irradiance.max())
    np.testing.assert_allclose(found[: 2 * count : 2], irradiance, rtol=1e-5, atol=atol)
    np.testing.assert_allclose(found[1 : 2 * count : 2, 0], share, rtol=1e-5, atol=1e-6)
    assert not found[2 * count :].any()
    if grids is not None:
        assert sunlight is not None
        assert isinstance(unsummed.sunlight, UnsummedSunlight)
        assert (unsummed.sunlight.taken is not None) == shaded
        found = texels(grids.light)
        of_nodes = sunlight.nodes[: len(found)]
        np.testing.assert_allclose(found[: len(of_nodes)], of_nodes, rtol=1e-5, atol=atol)
        assert np.abs(of_nodes).max() > 0.1
        grids.light.release()
    vertices.release()
    sums.release()
