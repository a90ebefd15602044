"""Images on surfaces in the picture: their texels, laws, normals and light at the right places."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array, Array32
from simgl.passes.texture_store import resampled
from simgl.scene.textures import CLAMP, MIRROR, REPEAT, Image
from simgl.simulator import Product, Simulator
from tests.model_files.gltf import UPRIGHT, Document, square
from tests.reference.brdf import brdf
from tests.scenes import capture, lambert, radiance, scene

# [W m-2] of the Sun in each band (tests/scenes.py).
SUN = np.array([154.43947526, 174.7738123, 171.94738469, 313.35751052])
RANGE = 70.0  # [m]
SCALE = 13e-3 / 3.75e-6 / RANGE  # pixels per metre
SIZE = 128


def camera_at(height: float) -> dict[str, Any]:
    """On the z axis, looking at the origin, y up."""
    towards = [0.0, 0.0, -1.0 if height > 0.0 else 1.0]
    return {"position_icrf_m": [0.0, 0.0, height], "boresight": towards, "up": [0.0, 1.0, 0.0]}


def view(
    gl: moderngl.Context,
    document: Document,
    path: Path,
    *,
    distance: float = RANGE,
    sun_w_m2: float = 1367.0,
    samples: int = 9,
) -> Array32:
    """(128, 128, 4) radiance of the file's model, the Sun behind the camera."""
    craft = {"model": str(document.write_glb(path)), "position_icrf_m": [0, 0, 0]}
    light = {"irradiance_w_m2": sun_w_m2}
    render = {"samples_per_pixel": samples}
    return radiance(gl, scene({"craft": craft}, camera_at(distance), sun=light, render=render))


def pixel_at(x: float, y: float) -> tuple[int, int]:
    """Row and column of the pixel that sees a place [m] of the square."""
    return int(SIZE / 2 - y * SCALE), int(SIZE / 2 + x * SCALE)


def plain(**pbr: Any) -> dict[str, Any]:
    """A rough dielectric, with changes."""
    return {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0, **pbr}}


def from_sun(reflectance: Any, *, metallic: float = 0.0, roughness: float = 1.0) -> Array:
    """Radiance of a surface that faces both the Sun and the camera."""
    z = np.array([[0.0, 0.0, 1.0]])
    rho = np.broadcast_to(reflectance, 4)
    f = [brdf(float(r), metallic, roughness, z, z, z)[0] for r in rho]
    return np.asarray(f) * SUN


def linear(byte: Any) -> Array:
    """Of an sRGB byte."""
    c = np.asarray(byte, dtype=np.float64) / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def test_each_texel_shows_its_linear_reflectance_at_its_place(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (4, 4, 3))
    document = square()
    document.json["materials"] = [plain(baseColorTexture={"index": document.texture(pixels)})]
    image = view(gl, document, tmp_path / "a.glb")
    for row in range(4):
        for column in range(4):
            # Row 0 is at the top, v = 0.
            seen = image[pixel_at(-0.75 + 0.5 * column, 0.75 - 0.5 * row)]
            rho = linear(pixels[row, column])[[0, 1, 2, 0]]
            # Half floats: 5e-4 of a value. The pixel's middle lies up to 0.7 pixels = 1/36 of a
            # texel off the texel's, where its neighbours weigh as much.
            span = np.ptp(linear(pixels), axis=(0, 1))[[0, 1, 2, 0]]
            limit = 5e-4 * from_sun(rho) + 0.03 * from_sun(span)
            assert np.all(np.abs(seen - from_sun(rho)) <= limit), (row, column)


def test_a_uniform_image_and_a_factor_are_the_same_reflectance(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    """Dark colours too, which 8 linear bits would round by a tenth."""
    for byte in (12, 60, 188, 255):
        document = square()
        texture = document.texture(np.full((2, 2, 3), byte))
        factor = {"baseColorFactor": [0.123456789, 0.5, 1.0, 1.0]}
        document.json["materials"] = [
            {
                **plain(baseColorTexture={"index": texture}, **factor),
                "extras": {"nir_reflectance": 1},
            }
        ]
        seen = view(gl, document, tmp_path / f"{byte}.glb")[64, 64]
        rho = linear(byte) * np.array([0.123456789, 0.5, 1.0, 1.0])
        np.testing.assert_allclose(seen, from_sun(rho), rtol=1e-3)


def test_dark_and_light_texels_average_to_their_linear_mean_far_away(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    """A checker of 256 x 256 texels, 11 or 37 of them along a pixel."""
    checker = 255 * (np.indices((256, 256)).sum(axis=0) % 2)
    document = square()
    texture = document.texture(np.repeat(checker[..., None], 3, axis=2))
    document.json["materials"] = [plain(baseColorTexture={"index": texture})]
    path = tmp_path / "a.glb"
    for distance in (300.0, 1000.0):
        seen = view(gl, document, path, distance=distance, samples=5)[64, 64]
        # The mean of the bytes would be 0.2140. Half floats, exact for 0, 1/2 and 1.
        np.testing.assert_allclose(seen, from_sun(0.5), rtol=1e-3)


def test_lines_along_the_view_stay_sharp_at_grazing_incidence(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    """Seen 10 deg above the square, ten texels lie along a pixel and less than two across."""
    lines = 255 * (np.arange(256) // 2 % 2)
    document = square()
    texture = document.texture(np.tile(lines[None, :, None], (256, 1, 3)))
    document.json["materials"] = [plain(baseColorTexture={"index": texture})]
    craft = {"model": str(document.write_glb(tmp_path / "a.glb")), "position_icrf_m": [0, 0, 0]}
    angle, distance = np.radians(10.0), 2.0 * RANGE / 3.0
    position = distance * np.array([0.0, -np.cos(angle), np.sin(angle)])
    camera = {
        "position_icrf_m": position.tolist(),
        "boresight": (-position / distance).tolist(),
        "up": [0.0, 0.0, 1.0],
    }
    image = radiance(gl, scene({"craft": craft}, camera))
    row = image[SIZE // 2, :, 1]
    seen = row[row > 0.0][8:-8]
    # A line of two texels is 1.2 pixels wide: nearly black and white.
    assert np.ptp(seen) > 0.8 * 2.0 * seen.mean()


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
def test_an_image_goes_on_past_its_edges_as_its_sampler_says(
    gl: moderngl.Context, tmp_path: Path, wrap: str
) -> None:
    """Two columns, dark and light, over a square that spans them three times: u from -1 to 2."""
    row = np.array([64, 224], dtype=np.uint8)
    mode = {"repeat": 10497, "clamp": 33071, "mirror": 33648}[wrap]
    columns = {"repeat": "dl dl dl", "clamp": "dd dl ll", "mirror": "ld dl ld"}[wrap]
    document = square([[-1, 1], [2, 1], [2, 0], [-1, 0]])
    texture = document.texture(np.tile(row[:, None], (2, 1, 3)), wrapS=mode, wrapT=mode)
    document.json["materials"] = [plain(baseColorTexture={"index": texture})]
    image = view(gl, document, tmp_path / "a.glb")
    for place, letter in enumerate(columns.replace(" ", "")):
        seen = image[pixel_at(-1.0 + (place + 0.5) / 3.0, 0.0)]
        rho = linear(row["dl".index(letter)])
        # The pixel's middle lies up to half a pixel = 1/33 of a texel off, and is as wide as that.
        assert np.all(np.abs(seen - from_sun(rho)) < 0.035 * from_sun(linear(224))), place


def test_an_image_is_turned_moved_and_stretched_by_its_transform(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    """The lower left quarter of the image turned clockwise, the example of the extension's text."""
    pixels = np.array([[20, 60, 0, 0], [100, 140, 0, 0], [160, 180, 0, 0], [200, 240, 0, 0]])
    transform = {"offset": [0, 1], "rotation": np.pi / 2, "scale": [0.5, 0.5]}
    document = square()
    use = {
        "index": document.texture(np.repeat(pixels[..., None], 3, axis=2)),
        "extensions": {"KHR_texture_transform": transform},
    }
    document.json["materials"] = [plain(baseColorTexture=use)]
    document.json["extensionsRequired"] = ["KHR_texture_transform"]
    image = view(gl, document, tmp_path / "a.glb")
    # A quarter turn clockwise of 160 180 / 200 240.
    for y, line in ((0.5, [200, 160]), (-0.5, [240, 180])):
        for x, byte in zip((-0.5, 0.5), line, strict=True):
            # As above; a texel is 50 pixels wide.
            limit = 0.03 * from_sun(linear(240))
            assert np.all(np.abs(image[pixel_at(x, y)] - from_sun(linear(byte))) < limit), (x, y)


def test_a_law_image_sets_roughness_by_green_and_metallic_by_blue(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    document = square()
    # Two halves: a smooth metal to the left, a rough dielectric to the right.
    pixels = np.array([[[9, 153, 255]] * 8 + [[250, 255, 0]] * 8] * 2)
    law = {"index": document.texture(pixels)}
    factors = {"metallicFactor": 1.0, "roughnessFactor": 0.5, "baseColorFactor": [0.6] * 3 + [1]}
    document.json["materials"] = [plain(metallicRoughnessTexture=law, **factors)]
    image = view(gl, document, tmp_path / "a.glb")
    metal, paint = image[pixel_at(-0.45, 0.0)], image[pixel_at(0.45, 0.0)]
    # Off the axis by 0.0064 rad, where the lobe of roughness 0.3 (alpha 0.09) is lower by
    # 2 (0.0032 / 0.09)^2 = 0.25 %; the Sun's disc of 0.0046 rad takes as much as (0.0023 / 0.09)^2.
    np.testing.assert_allclose(metal, from_sun(0.6, metallic=1.0, roughness=0.3), rtol=4e-3)
    np.testing.assert_allclose(paint, from_sun(0.6, roughness=0.5), rtol=1e-3)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("axis", ["red", "green"])
def test_a_normal_map_leans_the_surface_to_the_right_or_to_the_top_of_its_image(
    gl: moderngl.Context, tmp_path: Path, axis: str, mirrored: bool
) -> None:
    """A lean of 30 deg, seen from both sides under the Sun from four, 30 deg off the square."""
    t = np.radians(30.0)
    lean = np.array([np.sin(t), 0.0, np.cos(t)] if axis == "red" else [0.0, np.sin(t), np.cos(t)])
    pixels = np.full((2, 2, 3), np.round(255 * (0.5 + 0.5 * lean)))
    uv = np.array(UPRIGHT)
    if mirrored:
        uv[:, 0] = 1.0 - uv[:, 0]
    document = square(uv)
    document.json["materials"] = [
        {**plain(), "normalTexture": {"index": document.texture(pixels)}, "doubleSided": True}
    ]
    front = 2.0 * pixels[0, 0] / 255.0 - 1.0
    front *= [-1.0, 1.0, 1.0] if mirrored else [1.0, 1.0, 1.0]
    front /= np.linalg.norm(front)
    craft = {"model": str(document.write_glb(tmp_path / "a.glb")), "position_icrf_m": [0, 0, 0]}
    with Simulator(scene({"craft": craft}, camera_at(RANGE)), gl) as simulator:
        for side in (1.0, -1.0):
            n, wo = side * front, np.array([0.0, 0.0, side])
            for azimuth in np.radians([0.0, 90.0, 180.0, 270.0]):
                flat = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
                wi = np.sin(t) * flat + np.cos(t) * wo
                lit = scene({"craft": craft}, camera_at(side * RANGE), sun_direction=tuple(wi))
                state = lit.at(lit.epoch_tai_ns)
                frame = simulator.capture(state, "cam", {Product.RADIANCE}).radiance
                assert frame is not None
                f = brdf(1.0, 0.0, 1.0, n[None], wi[None], wo[None])[0]
                # The map is a half float, 5e-4, of which the cosine sees the sine's share.
                expected = f * SUN * np.dot(n, wi)
                np.testing.assert_allclose(frame.radiance[64, 64], expected, rtol=1e-3)


def test_relief_too_fine_to_see_widens_the_highlight_and_keeps_its_light(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    """A metal of roughness 0.3 with slopes of +-0.1 on both axes, from texel to texel.

    37 texels lie along a pixel. Slopes of +-s have variance s^2 along an axis, so alpha^2 grows by
    2 s^2.
    """
    s = 0.1
    i, j = np.indices((256, 256))
    slopes = np.stack([s * (-1.0) ** i, s * (-1.0) ** j, np.ones_like(i)], axis=-1)
    slopes /= np.linalg.norm(slopes, axis=-1, keepdims=True)
    document = square()
    texture = document.texture(np.round(255 * (0.5 + 0.5 * slopes)))
    metal = {"metallicFactor": 1.0, "roughnessFactor": 0.3}
    document.json["materials"] = [{**plain(**metal), "normalTexture": {"index": texture}}]
    seen = view(gl, document, tmp_path / "a.glb", distance=1000.0, samples=5)[64, 64]
    alpha = np.sqrt(0.3**4 + 2.0 * s * s)
    # The mean normal's length 1 - s^2 is the sum of a series; the next term is s^2 of it. Bytes
    # round the slope by up to 4 %.
    wide = from_sun(1.0, metallic=1.0, roughness=np.sqrt(alpha))
    np.testing.assert_allclose(seen, wide, rtol=0.06)
    # Without the relief the peak is 3.5 times as high.
    assert seen[0] < 0.4 * from_sun(1.0, metallic=1.0, roughness=0.3)[0]


def test_emission_is_factor_times_strength_times_image_without_any_sun(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    document = square()
    texture = document.texture(np.full((2, 2, 3), [255, 188, 60]))
    document.json["materials"] = [
        {
            **plain(baseColorFactor=[0.0, 0.0, 0.0, 1.0]),
            "emissiveFactor": [0.25, 0.5, 1.0],
            "emissiveTexture": {"index": texture},
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 40.0}},
            "extras": {"nir_emission": 7.0},
        }
    ]
    seen = view(gl, document, tmp_path / "a.glb", sun_w_m2=0.0)[64, 64]
    share = linear([255, 188, 60, 255])
    # The near infrared follows the image's red, which is 1; half floats.
    np.testing.assert_allclose(seen, np.array([10.0, 20.0, 40.0, 7.0]) * share, rtol=5e-4)


def test_an_inline_material_gives_off_its_emission(gl: moderngl.Context) -> None:
    glowing = {"reflectance": 0.5, "emission_w_m2_sr": [1.0, 2.0, 3.0, 4.5]}
    plate = {"plate": {"width_m": 2.0, "height_m": 2.0, "material": glowing}}
    craft = {"craft": {"model": plate, "position_icrf_m": [0, 0, 0]}}
    seen = radiance(gl, scene(craft, camera_at(RANGE)))[64, 64]
    # Lambert 0.5 facing the Sun, and its own light; float32 through a few products.
    np.testing.assert_allclose(seen, 0.5 * SUN / np.pi + [1.0, 2.0, 3.0, 4.5], rtol=2e-6)


def test_vertex_colours_multiply_the_reflectance(gl: moderngl.Context, tmp_path: Path) -> None:
    document = square()
    colours = document.accessor([[0.2, 0.4, 0.6]] * 4)
    document.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = colours
    document.json["materials"] = [plain(baseColorFactor=[0.5, 0.5, 0.5, 1.0])]
    seen = view(gl, document, tmp_path / "a.glb")[64, 64]
    # A few products in float32, and a pixel's mean over directions up to 1e-4 rad apart.
    np.testing.assert_allclose(seen, from_sun([0.1, 0.2, 0.3, 0.1]), rtol=1e-5)


def test_what_an_image_cuts_away_neither_hides_nor_shades_what_lies_behind(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    """A mask over a plate: the plate is seen, and sunlit, through its left half."""
    document = square()
    pixels = np.full((4, 8, 4), 255)
    pixels[:, :4, 3] = 100
    mask = plain(baseColorTexture={"index": document.texture(pixels)})
    document.json["materials"] = [{**mask, "alphaMode": "MASK", "doubleSided": True}]
    white = {"plate": {"width_m": 8.0, "height_m": 8.0, "material": lambert(0.8)}}
    craft: dict[str, dict[str, Any]] = {
        "mask": {
            "model": str(document.write_glb(tmp_path / "a.glb")),
            "position_icrf_m": [0, 0, 1],
        },
        "plate": {"model": white, "position_icrf_m": [0, 0, 0]},
    }
    seen = capture(gl, scene(craft, camera_at(RANGE), render={"inter_reflection": False}))
    assert seen.radiance is not None
    assert seen.truth is not None
    hole, solid = pixel_at(-0.5, 0.0), pixel_at(0.5, 0.0)
    # Float32 through a few products; Lambert's law, and that of the mask.
    np.testing.assert_allclose(seen.radiance.radiance[hole], 0.8 * SUN / np.pi, rtol=1e-5)
    np.testing.assert_allclose(seen.radiance.radiance[solid], from_sun(1.0), rtol=1e-3)
    # 24 bits of depth over a few metres at 70 m.
    assert seen.truth.depth[hole] == pytest.approx(RANGE, abs=1e-3)
    assert seen.truth.depth[solid] == pytest.approx(RANGE - 1.0, abs=1e-3)


def test_a_mask_thinner_than_its_cutoff_is_not_there(gl: moderngl.Context, tmp_path: Path) -> None:
    document = square()
    faint = plain(baseColorFactor=[1.0, 1.0, 1.0, 0.4])
    document.json["materials"] = [{**faint, "alphaMode": "MASK"}]
    assert not view(gl, document, tmp_path / "a.glb").any()


def test_relief_gets_no_sunlight_from_behind_its_surface_and_little_at_grazing_incidence(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    """A lean of 30 deg towards a Sun 5 deg below the square, and 10 deg above it."""
    t = np.radians(30.0)
    pixels = np.full((2, 2, 3), np.round(255 * (0.5 + 0.5 * np.array([0.5, 0.0, np.cos(t)]))))
    document = square()
    texture = {"index": document.texture(pixels)}
    document.json["materials"] = [{**plain(), "normalTexture": texture, "doubleSided": True}]
    n = 2.0 * pixels[0, 0] / 255.0 - 1.0
    n /= np.linalg.norm(n)
    craft = {"model": str(document.write_glb(tmp_path / "a.glb")), "position_icrf_m": [0, 0, 0]}
    wo = np.array([0.0, 0.0, 1.0])
    for elevation, share in ((-5.0, 0.0), (10.0, np.sin(np.radians(10.0)) / n[0])):
        e = np.radians(elevation)
        wi = np.array([np.cos(e), 0.0, np.sin(e)])
        image = radiance(gl, scene({"craft": craft}, camera_at(RANGE), sun_direction=tuple(wi)))
        f = brdf(1.0, 0.0, 1.0, n[None], wi[None], wo[None])[0]
        # As above, and the share's own half float.
        np.testing.assert_allclose(image[64, 64], f * SUN * np.dot(n, wi) * share, rtol=2e-3)


@pytest.mark.parametrize(
    ("wrap", "ends"), [(REPEAT, [0.25, 0.75]), (CLAMP, [0.0, 1.0]), (MIRROR, [0.0, 1.0])]
)
def test_an_image_beside_a_larger_one_is_interpolated_across_its_edges(
    wrap: int, ends: list[float]
) -> None:
    """Two texels, 0 and 1, as four: a quarter of the way from one's middle to its neighbour's."""
    values = np.array([[0.0, 1.0]], dtype=np.float16)[..., None]
    four = resampled(Image(values=values, wrap=(wrap, wrap)), 4, 1)[0, :, 0]
    np.testing.assert_array_equal(four, [ends[0], 0.25, 0.75, ends[1]])


@pytest.mark.parametrize(("count", "beside"), [(3, 1), (10, 1), (4, 8)])
def test_the_middle_of_a_texel_of_a_palette_has_its_colour(
    gl: moderngl.Context, tmp_path: Path, count: int, beside: int
) -> None:
    """Whatever the number of texels and the size of the model's other images."""
    chosen = count // 2
    palette = np.full((1, count, 3), 255)
    palette[0, chosen] = 0
    document = square(uv=[((chosen + 0.5) / count, 0.5)] * 4)
    images = [document.texture(palette), document.texture(np.full((1, beside, 3), 255))]
    document.json["materials"] = [plain(baseColorTexture={"index": index}) for index in images]
    shown = view(gl, document, tmp_path / "a.glb")[64, 64] / from_sun(1.0)
    black = from_sun(0.0) / from_sun(1.0)
    # 1/32 of what is between black and white around it.
    assert np.all(np.abs(shown - black) < 1.01 * (1.0 - black) / 32.0)


@pytest.mark.parametrize("double_sided", [False, True])
def test_a_mirrored_part_gives_the_mirror_image(
    gl: moderngl.Context, tmp_path: Path, double_sided: bool
) -> None:
    """Colour, relief and light: mirrored in x, with the Sun mirrored too."""
    document = square()
    # Leans to the right in its left half, to the top in its right half.
    relief = np.full((16, 16, 3), (128, 128, 230))
    relief[:, :8, 0], relief[:, 8:, 1] = 200, 200
    colours = np.full((16, 16, 3), 90)
    colours[:8] = 200
    document.json["materials"] = [
        {
            **plain(baseColorTexture={"index": document.texture(colours)}),
            "normalTexture": {"index": document.texture(relief)},
            "doubleSided": double_sided,
        }
    ]

    def seen(x_scale: float) -> Array32:
        document.json["nodes"][0]["scale"] = [x_scale, 1.0, 1.0]
        model = str(document.write_glb(tmp_path / f"{x_scale}.glb"))
        body = {"model": model, "position_icrf_m": [0, 0, 0]}
        sun = (0.4 * x_scale, 0.3, 1.0)
        render = {"samples_per_pixel": 9}
        return radiance(gl, scene({"s": body}, camera_at(RANGE), sun_direction=sun, render=render))

    straight, mirrored = seen(1.0), seen(-1.0)
    for x in (-0.75, -0.25, 0.25, 0.75):
        for y in (-0.5, 0.5):
            expected = straight[pixel_at(x, y)]
            assert np.all(expected[:3] > 1.0)
            # The pixel's neighbour across the mirror; samples within it lie elsewhere: 1 % of the
            # relief's change from texel to texel.
            row, column = pixel_at(x, y)
            np.testing.assert_allclose(mirrored[row, SIZE - 1 - column], expected, rtol=0.01)
