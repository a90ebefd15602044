"""A solar wing on two joints looks as the same shapes do that were stored that way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import moderngl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.motion.joints import Joint
from simgl.physics.frames import unit
from simgl.scenario.scenario import Scenario
from simgl.scene.mesh import Mesh, box
from simgl.scene.spacecraft import SpacecraftModel
from simgl.simulator import Capture, Product, Simulator
from tests.scenes import scene

# Lines that lie along no axis, so that no component of a turned normal is zero but for rounding,
# which would turn the rays about it.
YOKE = Joint(
    name="yoke",
    parts=(1,),
    axis_body=unit(np.array([0.1, 1.0, 0.05])),
    origin_body=np.array([0.0, 0.5, 0.0]),
    limits=(-np.pi, np.pi),
)
WING = Joint(
    name="wing",
    parts=(2,),
    axis_body=unit(np.array([1.0, 0.05, 0.2])),
    origin_body=np.array([0.0, 1.0, 0.0]),
    limits=(-np.pi, np.pi),
    parent=0,
)
# Multiples of 5 deg, at which light between surfaces is traced.
ANGLES = {"yoke": np.radians(35.0), "wing": np.radians(-50.0)}
# The first part of the first spacecraft, in pictures of parts.
HULL = 65536 + 1
PICTURES = frozenset({Product.RADIANCE, Product.TRUTH})


def stored() -> Mesh:
    """A hull, a yoke on its side that reaches along y, and a wing beyond that."""
    sizes = (1.2, 1.0, 1.0), (0.12, 0.44, 0.12), (1.4, 1.2, 0.06)
    boxes = [box(size) for size in sizes]
    counts = [len(one.positions) for one in boxes]
    starts = np.cumsum([0, *counts[:-1]])
    along = np.repeat([0.0, 0.75, 1.7], counts)
    places = np.concatenate([one.positions for one in boxes]).astype(np.float64)
    places[:, 1] += along
    return Mesh(
        positions=places.astype(np.float32),
        normals=np.concatenate([one.normals for one in boxes]),
        triangles=np.concatenate(
            [one.triangles + np.uint32(first) for one, first in zip(boxes, starts, strict=True)]
        ),
        part=np.repeat(np.arange(3, dtype=np.uint32), counts),
        material=np.zeros(sum(counts), dtype=np.uint32),
    )


def turned(mesh: Mesh, hinges: Mapping[Joint, tuple[int, ...]]) -> Mesh:
    """The mesh with parts turned about one stored hinge line after the other."""
    places, normals = mesh.positions.astype(np.float64), mesh.normals.astype(np.float64)
    for hinge, parts in hinges.items():
        turn = Rotation.from_rotvec(ANGLES[hinge.name] * hinge.axis_body)
        own = np.isin(mesh.part, parts)
        places[own] = turn.apply(places[own] - hinge.origin_body) + hinge.origin_body
        normals[own] = turn.apply(normals[own])
    return replace(mesh, positions=places.astype(np.float32), normals=normals.astype(np.float32))


def bench(
    inter_reflection: bool, focal_length_mm: float = 0.8
) -> tuple[Scenario, SpacecraftModel, SpacecraftModel]:
    """The scene, the jointed craft, and the rigid one; the wing's shadow lies on the hull."""
    scenario = scene(
        {
            "craft": {
                "model": {"box": {"size_m": [1.0, 1.0, 1.0], "material": "white_paint"}},
                "position_icrf_m": [7.0e6, 0.0, 0.0],
            }
        },
        {
            "position_icrf_m": [7.0e6 - 1.0, 6.5, 4.0],
            "look_at": "craft",
            "width_px": 128,
            "height_px": 128,
            "focal_length_mm": focal_length_mm,
        },
        sun_direction=(-0.1, 0.8, -0.35),
        render={"samples_per_pixel": 8, "inter_reflection": inter_reflection},
    )
    plain = replace(scenario.models["craft"], parts=("hull", "yoke", "wing"), mesh=stored())
    rigid = replace(plain, mesh=turned(stored(), {WING: (2,), YOKE: (1, 2)}))
    return scenario, replace(plain, joints=(YOKE, WING)), rigid


def capture(
    gl: moderngl.Context, scenario: Scenario, model: SpacecraftModel, angles: Mapping[str, float]
) -> Capture:
    changed = replace(scenario, models={"craft": model})
    epoch = scenario.epoch_tai_ns
    state = changed.with_poses(epoch, changed.poses(epoch), joint_angles={"craft": angles})
    with Simulator(changed, gl) as simulator:
        return simulator.capture(state, "cam", PICTURES)


def radiances(*frames: Capture) -> list[Array]:
    found = []
    for frame in frames:
        assert frame.radiance is not None
        found.append(np.asarray(frame.radiance.radiance, dtype=np.float64))
    return found


@pytest.mark.parametrize("inter_reflection", [False, True], ids=["alone", "exchanging"])
def test_a_wing_on_two_joints_is_the_wing_stored_that_way(
    gl: moderngl.Context, inter_reflection: bool
) -> None:
    """With its shadow on the hull and with the light between them."""
    scenario, jointed, rigid = bench(inter_reflection)
    by_joints = capture(gl, scenario, jointed, ANGLES)
    by_shape = capture(gl, scenario, rigid, {})
    as_stored = capture(gl, scenario, jointed, {})
    one, other, before = radiances(by_joints, by_shape, as_stored)
    scale = np.percentile(other[other > 0.0], 99)
    # Places and normals agree to the last bits of float32; so does what is worked out from them. At
    # a shadow's edge 4e-7 m count over a texel of the map, 2 mm.
    off = np.abs(one - other)
    assert np.quantile(off, 0.9999) < 1e-5 * scale
    assert off.max() < 2e-4 * scale
    assert by_joints.truth is not None
    assert by_shape.truth is not None
    np.testing.assert_array_equal(by_joints.truth.part_id, by_shape.truth.part_id)
    # Float32 rounds a place of 2 m three times, to 4e-7 m, and a depth of 8 m to 5e-7. On a surface
    # at a grazing angle, depth moves by the former over that angle: one pixel in a thousand.
    difference = np.abs(by_joints.truth.depth - by_shape.truth.depth)[by_shape.truth.part_id > 0]
    assert np.quantile(difference, 0.999) < 4e-6
    assert difference.max() < 1e-4
    # And it is another picture than the stored one, so the comparison says something.
    assert np.abs(before - other)[other > 0.0].mean() > 0.1 * scale


def test_light_and_shadow_between_the_parts_are_there_to_be_compared(gl: moderngl.Context) -> None:
    """On the hull's side, part of which the wing shades: black alone, not with light around it."""
    frames = []
    for inter_reflection in (False, True):
        scenario, jointed, _ = bench(inter_reflection)
        frames.append(capture(gl, scenario, jointed, ANGLES))
    alone, together = (np.max(picture, axis=-1) for picture in radiances(*frames))
    truth = frames[0].truth
    assert truth is not None
    dark = (alone == 0.0) & (truth.part_id == HULL)
    # The side away from the Sun sees nothing else of the craft and stays black.
    lit = dark & (together > 0.01 * together.max())
    assert lit.sum() > 50
