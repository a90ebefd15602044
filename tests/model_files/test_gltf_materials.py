"""The surfaces of glTF files: factors unrounded, images, their own light, and what is refused."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib
import pytest
from PIL import Image

from simgl.errors import AssetError
from simgl.model_files.model_library import load_model
from simgl.model_files.surface_tables import load_finish
from simgl.scene.materials import Material
from simgl.scene.mean_materials import mean_materials
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.surface_layers import Coat
from simgl.scene.textures import CLAMP, MIRROR, REPEAT
from tests.model_files.gltf import UNSIGNED_SHORT, Document, Json, png, png_of_16_bits, square

# float16 of a value between 0 and 1: half a step of 2^-11.
FLOAT16 = 2.5e-4


def loaded(document: Document, tmp_path: Path) -> SpacecraftModel:
    """The model of a document."""
    return load_model(str(document.write_glb(tmp_path / "a.glb")))


def one(material: Json, tmp_path: Path) -> Material:
    """The one material of a square."""
    document = square()
    document.json["materials"] = [material]
    return loaded(document, tmp_path).materials[0]


def test_factors_keep_every_digit_that_a_gltf_library_writes(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    colour, law, light = rng.random(3).tolist(), rng.random(2).tolist(), rng.random(3).tolist()
    document = square()
    written = pygltflib.GLTF2.load(str(document.write_glb(tmp_path / "plain.glb")))
    written.materials = [
        pygltflib.Material(
            name="foil",
            pbrMetallicRoughness=pygltflib.PbrMetallicRoughness(
                baseColorFactor=[*colour, 1.0], metallicFactor=law[0], roughnessFactor=law[1]
            ),
            emissiveFactor=light,
            extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 12.5}},
            extras={"nir_reflectance": 0.123456789012345, "nir_emission": 1e-7},
        )
    ]
    path = tmp_path / "written.glb"
    written.save(str(path))
    material = load_model(str(path)).materials[0]
    assert material.reflectance == (*colour, 0.123456789012345)
    assert (material.metallic, material.roughness) == tuple(law)
    assert material.emission == (*(12.5 * value for value in light), 1e-7)


def test_a_clear_coat_comes_with_its_strength_and_roughness(tmp_path: Path) -> None:
    coat = {"clearcoatFactor": 0.7, "clearcoatRoughnessFactor": 0.2}
    material = one({"extensions": {"KHR_materials_clearcoat": coat}}, tmp_path)
    assert material.coat == Coat(strength=0.7, roughness=0.2)


def test_extras_make_a_surface_lambertian_with_the_files_own_albedo(tmp_path: Path) -> None:
    """Any albedo per band; the factor defaults of glTF, a rough metal, do not matter."""
    pbr = {"baseColorFactor": [0.31, 0.22, 0.13, 1.0]}
    extras = {"simgl_lambertian": True, "nir_reflectance": 0.44}
    coat = {"KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.1}}
    surface = {"pbrMetallicRoughness": pbr, "extras": extras, "extensions": coat}
    material = one(surface, tmp_path)
    assert material.reflectance == (0.31, 0.22, 0.13, 0.44)
    assert (material.metallic, material.roughness) == (0.0, None)
    assert material.coat == Coat(strength=0.5, roughness=0.1)
    with pytest.raises(AssetError, match="simgl_lambertian must be true or false"):
        one({"extras": {"simgl_lambertian": "yes"}}, tmp_path)


def test_a_lambertian_surface_keeps_its_image_and_drops_that_of_the_law(tmp_path: Path) -> None:
    document = square()
    texture = {"index": document.texture(np.full((2, 2, 3), 128))}
    pbr = {"baseColorTexture": texture, "metallicRoughnessTexture": texture}
    extras = {"simgl_lambertian": True}
    document.json["materials"] = [{"pbrMetallicRoughness": pbr, "extras": extras}]
    material = loaded(document, tmp_path).materials[0]
    assert material.maps.base_colour == 0
    assert material.maps.law is None
    assert material.roughness is None


def test_a_finish_named_in_the_extras_stands_for_the_whole_surface(tmp_path: Path) -> None:
    own = {"metallicFactor": 0.3}
    extras = {"simgl_finish": "white_paint"}
    surface = {"name": "hull", "pbrMetallicRoughness": own, "extras": extras}
    material = one(surface, tmp_path)
    white = load_finish("white_paint")
    assert material.name == "hull"
    assert (material.reflectance, material.metallic) == (white.reflectance, white.metallic)


def test_an_unknown_finish_is_refused(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=r'material "a" extras: simgl_finish names no finish "x"'):
        one({"name": "a", "extras": {"simgl_finish": "x"}}, tmp_path)


def test_colour_images_become_linear_and_others_stay_as_they_are(tmp_path: Path) -> None:
    pixels = np.array([[[0, 10, 255, 51]], [[188, 64, 128, 255]]])
    document = square()
    use = {"index": document.texture(pixels)}
    document.json["materials"] = [
        {
            "pbrMetallicRoughness": {"baseColorTexture": use, "metallicRoughnessTexture": use},
            "emissiveTexture": use,
            "emissiveFactor": [1, 1, 1],
        }
    ]
    textures = loaded(document, tmp_path).textures
    # IEC 61966-2-1 by hand: 10 / 255 / 12.92 below the knee, else ((c + 0.055) / 1.055)^2.4.
    base = textures.base_colour[0].values
    np.testing.assert_allclose(base[0, 0], [0.0, 0.0030353, 1.0, 0.2], rtol=5e-4)
    np.testing.assert_allclose(base[1, 0], [0.5028865, 0.0512695, 0.2158605, 1.0], rtol=5e-4)
    np.testing.assert_array_equal(textures.emission[0].values, base[..., :3])
    law = pixels[..., 1:3] / 255.0
    np.testing.assert_allclose(textures.law[0].values, law, rtol=0.0, atol=FLOAT16)


def test_normal_maps_become_unit_vectors(tmp_path: Path) -> None:
    document = square()
    use = {"index": document.texture([[[255, 128, 255], [128, 128, 255]]]), "scale": 0.5}
    document.json["materials"] = [{"normalTexture": use}]
    model = loaded(document, tmp_path)
    tilted = np.array([1.0, 1.0 / 255.0, 1.0])
    first = model.textures.normal[0].values[0, 0]
    np.testing.assert_allclose(first, tilted / np.linalg.norm(tilted), rtol=0.0, atol=FLOAT16)
    assert model.materials[0].maps.normal_scale == 0.5


def test_an_image_worn_twice_is_kept_once_for_each_way_past_its_edges(tmp_path: Path) -> None:
    document = square()
    first = document.texture([[1, 2]])
    document.json["samplers"] = [{"wrapS": 33071, "wrapT": 33648}]
    document.json["textures"] += [{"source": 0}, {"source": 0, "sampler": 0}]
    document.json["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": first + k}}} for k in range(3)
    ]
    model = loaded(document, tmp_path)
    assert [m.maps.base_colour for m in model.materials[:3]] == [0, 0, 1]
    wraps = [image.wrap for image in model.textures.base_colour]
    assert wraps == [(REPEAT, REPEAT), (CLAMP, MIRROR)]


def test_texture_coordinates_may_be_whole_numbers_and_of_the_second_set(tmp_path: Path) -> None:
    document = square()
    attributes = document.json["meshes"][0]["primitives"][0]["attributes"]
    second = np.array([[0, 65535], [65535, 65535], [65535, 0], [0, 0]])
    attributes["TEXCOORD_1"] = document.accessor(second, 5123)
    document.json["accessors"][-1]["normalized"] = True
    use = {"index": document.texture([[9]]), "texCoord": 1}
    document.json["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": use}}]
    model = loaded(document, tmp_path)
    assert model.mesh.uv is not None
    np.testing.assert_array_equal(model.mesh.uv, [[0, 1], [1, 1], [1, 0], [0, 0]])


def test_whole_numbers_that_are_no_fractions_are_refused(tmp_path: Path) -> None:
    """Pixels of the image, say: as fractions they would all lie in its first texel."""
    document = square()
    attributes = document.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["TEXCOORD_0"] = document.accessor([[0, 9], [9, 9], [9, 0], [0, 0]], 5123)
    use = {"index": document.texture([[9]])}
    document.json["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": use}}]
    index = attributes["TEXCOORD_0"]
    with pytest.raises(AssetError, match=f"accessor {index} has integers that are not normalized"):
        loaded(document, tmp_path)


@pytest.mark.parametrize("form", ["embedded", "data", "beside", "jpeg", "grey 16", "palette"])
def test_an_image_may_lie_anywhere_and_be_of_any_kind(form: str, tmp_path: Path) -> None:
    document = square()
    file = png(np.full((8, 8, 3), 99))
    buffer = io.BytesIO()
    if form == "jpeg":
        Image.new("RGB", (8, 8), (99, 99, 99)).save(buffer, "JPEG", quality=95)
    if form == "grey 16":
        file = png(np.full((8, 8), 99 * 257, dtype=np.uint16))
    if form == "palette":
        Image.fromarray(np.full((8, 8, 3), 99, dtype=np.uint8)).quantize(4).save(buffer, "PNG")
    file = buffer.getvalue() or file
    if form == "beside":
        (tmp_path / "the foil.png").write_bytes(file)
        image: Json = {"uri": "the%20foil.png"}
    elif form == "data":
        image = {"uri": "data:image/png;base64," + base64.b64encode(file).decode()}
    else:
        image = {"bufferView": document.view(file)}
    document.json["images"] = [image]
    document.json["textures"] = [{"source": 0}]
    document.json["materials"] = [{"emissiveTexture": {"index": 0}, "emissiveFactor": [1, 1, 1]}]
    values = loaded(document, tmp_path).textures.emission[0].values
    assert values.shape == (8, 8, 3)
    # ((99 / 255 + 0.055) / 1.055)^2.4 = 0.12477; a JPEG may be off by one.
    np.testing.assert_allclose(values, 0.12477, rtol=0.03 if form == "jpeg" else 5e-4)


# Steps of two of 65536: 8 bits tell two of 256 apart.
_FINE = 20000 + 2 * np.arange(256)


def _image(document: Document, file: bytes) -> Json:
    document.json["images"] = [{"bufferView": document.view(file)}]
    document.json["textures"] = [{"source": 0}]
    return {"index": 0}


@pytest.mark.parametrize(
    "channels", ["grey", "grey, alpha", "colour", "colour, alpha", "one clear"]
)
def test_a_gradient_finer_than_8_bits_stays_one(channels: str, tmp_path: Path) -> None:
    up, down = np.tile(_FINE, (4, 1)), np.tile(_FINE[::-1], (4, 1))
    layers = {
        "grey": [up],
        "grey, alpha": [up, down],
        "colour": [up, down, up],
        "colour, alpha": [up, down, up, down],
        "one clear": [up, up, up],
    }[channels]
    if channels == "grey":
        file = png(up.astype(np.uint16))
    else:
        clear = (20000,) * 3 if channels == "one clear" else ()
        file = png_of_16_bits(np.stack(layers, axis=-1), clear)
    document = square()
    use = _image(document, file)
    document.json["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": use}}]
    values = loaded(document, tmp_path).textures.base_colour[0].values.astype(np.float64)
    green = down if channels.startswith("colour") else up
    alpha = down / 65535.0 if "alpha" in channels else np.ones(up.shape)
    if channels == "one clear":
        alpha[:, 0] = 0.0
    # Half floats: half of 2^-10.
    for channel, level in enumerate((up, green, up)):
        linear = ((level / 65535.0 + 0.055) / 1.055) ** 2.4
        np.testing.assert_allclose(values[..., channel], linear, rtol=5e-4)
    np.testing.assert_allclose(values[..., 3], alpha, rtol=5e-4)


def test_a_normal_image_of_16_bits_tells_tilts_of_a_minute_of_arc(tmp_path: Path) -> None:
    tilt = np.tile(np.linspace(-0.004, 0.004, 64), (4, 1))
    normal = np.stack([tilt, np.zeros_like(tilt), np.sqrt(1.0 - tilt**2)], axis=-1)
    document = square()
    use = _image(document, png_of_16_bits(np.rint(32767.5 * (normal + 1.0))))
    document.json["materials"] = [{"normalTexture": use}]
    found = loaded(document, tmp_path).textures.normal[0].values.astype(np.float64)
    # Half a step of 16 bits; half floats hold 2^-11 of a small value. 8 bits have steps of 0.008.
    np.testing.assert_allclose(found[..., 0], tilt, atol=2e-5)


def test_a_damaged_image_of_16_bits_is_refused(tmp_path: Path) -> None:
    file = png_of_16_bits(np.random.default_rng(2).integers(0, 65536, (64, 64, 3)))
    document = square()
    use = _image(document, file[: len(file) // 2])
    document.json["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": use}}]
    with pytest.raises(AssetError, match="is not a readable PNG or JPEG file"):
        loaded(document, tmp_path)


def test_a_large_image_is_averaged_down_in_linear_light(tmp_path: Path) -> None:
    document = square()
    stripes = np.zeros((2, 4096, 3))
    stripes[:, 1::2] = 255
    use = {"index": document.texture(stripes)}
    document.json["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": use}}]
    values = loaded(document, tmp_path).textures.base_colour[0].values
    assert values.shape == (1, 2048, 4)
    np.testing.assert_allclose(values[..., :3], 0.5, rtol=0.0, atol=FLOAT16)


def test_what_a_material_asks_for_and_does_not_get_is_noted(tmp_path: Path) -> None:
    document = square()
    assert not square().json["materials"]
    texture = document.texture([[9]])
    moved = {"KHR_texture_transform": {"offset": [0.5, 0.0]}}
    document.json["materials"] = [
        {
            "name": "foil",
            "pbrMetallicRoughness": {
                "baseColorTexture": {"index": texture},
                "metallicRoughnessTexture": {"index": texture, "texCoord": 2},
                "roughnessFactor": 0.0,
            },
            "normalTexture": {"index": texture, "extensions": moved},
            # Shadows painted into an image: the light between surfaces is worked out instead.
            "occlusionTexture": {"index": texture},
            "alphaMode": "BLEND",
            "extensions": {
                "KHR_materials_sheen": {},
                "KHR_materials_clearcoat": {
                    "clearcoatFactor": 1.0,
                    "clearcoatTexture": {"index": texture},
                },
            },
        }
    ]
    assert loaded(document, tmp_path).notes == (
        'material "foil": metallic-roughness texture on texture coordinates 2 is not drawn',
        'material "foil": normal map, placed unlike the base colour texture, is not drawn',
        'material "foil": transparency is not drawn',
        'material "foil": roughness 0 is raised to 0.01',
        'material "foil": KHR_materials_sheen is not drawn',
        'material "foil": clear coat texture is not drawn',
        'material "foil": clear coat roughness 0 is raised to 0.01',
    )


def test_a_part_without_texture_coordinates_is_noted(tmp_path: Path) -> None:
    document = square()
    del document.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"]
    use = {"index": document.texture([[9]])}
    document.json["materials"] = [
        {"name": "foil", "pbrMetallicRoughness": {"baseColorTexture": use}}
    ]
    assert loaded(document, tmp_path).notes == (
        'part "square": has no texture coordinates 0; one texel of each image of material "foil" '
        "is drawn all over it",
    )


def _images(*images: Json) -> Callable[[Document], None]:
    def put(document: Document) -> None:
        document.json["images"] = list(images)

    return put


def _content(content: bytes) -> Callable[[Document], None]:
    def put(document: Document) -> None:
        document.json["images"] = [{"bufferView": document.view(content)}]

    return put


def _texture(**texture: int) -> Callable[[Document], None]:
    def put(document: Document) -> None:
        document.json["textures"] = [texture]

    return put


def _material(**material: Any) -> Callable[[Document], None]:
    def put(document: Document) -> None:
        document.json["materials"] = [material]

    return put


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (_images({"uri": "no.png"}), 'image "no.png" cannot be read (No such file or directory)'),
        (_images({"uri": "data:image/png;base64,?"}), "holds an image that is not base64"),
        (_images({}), "image 0 names neither a file nor a buffer view"),
        (_images({"bufferView": 99}), "names buffer view 99, but holds only 5"),
        (_images(), "names image 0, but holds only 0"),
        (_content(b"GIF89a"), "image 0 is not a readable PNG or JPEG file"),
        (_content(png(np.eye(99))[:-40]), "image 0 is not a readable PNG or JPEG file"),
        (
            _content(png(np.zeros((1, 8193)))),
            "image 0 has 8193 x 1 pixels, at most 8192 x 8192 are read",
        ),
        (_texture(), "texture 0 names no PNG or JPEG image"),
        (_texture(source=0, sampler=3), "names sampler 3, but holds only 0"),
        (
            _material(emissiveFactor=[-1, 0, 0]),
            'material "material_0": emission must be 0 or more, got -1',
        ),
        (
            _material(pbrMetallicRoughness={"baseColorTexture": {"index": 7}}),
            "names texture 7, but holds only 1",
        ),
    ],
)
def test_a_broken_image_or_material_is_refused_in_one_line(
    damage: Callable[[Document], None], message: str, tmp_path: Path
) -> None:
    document = square()
    use = {"index": document.texture([[9]])}
    document.json["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": use}}]
    damage(document)
    path = document.write_gltf(tmp_path / "broken.gltf")
    with pytest.raises(AssetError) as caught:
        load_model(str(path))
    assert str(caught.value) == f"{path}: {message}"


@pytest.mark.parametrize(
    ("material", "message"),
    [
        (
            {"extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": -1}}},
            "KHR_materials_emissive_strength: emissiveStrength must be a number >= 0.0, got -1",
        ),
        (
            {"extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 2}}},
            "KHR_materials_clearcoat: clearcoatFactor must be a number >= 0.0, <= 1.0, got 2",
        ),
        ({"extras": {"nir_emission": "x"}}, 'extras: nir_emission must be a number, got "x"'),
        (
            {"extras": {"simgl_lambertan": True, "of_another_program": 1}},
            'extras: simgl_lambertan is not a key here; did you mean "simgl_lambertian"? '
            "(allowed: nir_emission, nir_reflectance, simgl_finish, simgl_lambertian)",
        ),
    ],
)
def test_a_broken_extension_is_refused_in_one_line(
    material: Json, message: str, tmp_path: Path
) -> None:
    document = square()
    document.json["materials"] = [{"name": "foil", **material}]
    path = document.write_glb(tmp_path / "broken.glb")
    with pytest.raises(AssetError) as caught:
        load_model(str(path))
    assert str(caught.value) == f'{path} material "foil" {message}'


def test_a_vertex_colour_outside_0_to_1_is_refused(tmp_path: Path) -> None:
    document = square(COLOR_0=2)
    document.json["materials"] = [{}]
    colours = document.accessor([[1.5, 0.0, 0.0]] * 4)
    document.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = colours
    with pytest.raises(AssetError, match=r'part "square" has a vertex colour outside 0..1$'):
        loaded(document, tmp_path)


def test_the_mean_material_is_that_of_the_images_where_the_mesh_wears_them(tmp_path: Path) -> None:
    """A square on the left half of an image whose right half is black, tinted by its vertices."""
    document = square([[0.0, 1.0], [0.5, 1.0], [0.5, 0.0], [0.0, 0.0]])
    colours = document.accessor([[0.5, 1.0, 1.0]] * 4)
    document.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = colours
    pixels = np.zeros((4, 4, 3))
    pixels[::2, :2] = 255
    law = np.full((2, 2, 3), [0, 102, 51])
    uses = {
        "baseColorTexture": {"index": document.texture(pixels)},
        "metallicRoughnessTexture": {"index": document.texture(law)},
    }
    factor = {"baseColorFactor": [0.8, 0.6, 0.4, 1.0], "metallicFactor": 0.5}
    document.json["materials"] = [{"pbrMetallicRoughness": {**uses, **factor}}]
    model = loaded(document, tmp_path)
    mean = mean_materials(model)[0]
    # Half of the rows; near infrared like red. 200,000 even places tell the half to 1e-3.
    np.testing.assert_allclose(mean.reflectance, [0.2, 0.3, 0.2, 0.2], rtol=2e-3)
    np.testing.assert_allclose(mean.metallic, 0.1, rtol=1e-3)


@pytest.mark.parametrize("count", [1, 3, 7, 49, 1000])
def test_the_mean_of_a_white_image_is_white_on_any_mesh(count: int, tmp_path: Path) -> None:
    """A strip of unequal triangles; sums of ones round up for some counts."""
    rng = np.random.default_rng(count)
    x = np.cumsum(rng.uniform(0.01, 1.0, count + 2))
    points = np.stack([x, np.arange(count + 2) % 2, np.zeros(count + 2)], axis=1)
    corners = np.arange(count)[:, None] + np.arange(3)
    document = Document()
    white = np.full((5, 3, 3), 255)
    mesh = document.mesh(
        attributes={
            "POSITION": document.accessor(points),
            "TEXCOORD_0": document.accessor(rng.uniform(0.0, 1.0, (count + 2, 2))),
            "COLOR_0": document.accessor(np.ones((count + 2, 4))),
        },
        indices=document.accessor(corners.ravel(), UNSIGNED_SHORT),
        material=0,
    )
    document.json["nodes"].append({"name": "strip", "mesh": mesh})
    factors = {"metallicFactor": 1.0, "baseColorTexture": {"index": document.texture(white)}}
    document.json["materials"] = [{"pbrMetallicRoughness": factors}]
    model = load_model(str(document.write_glb(tmp_path / "white.glb")))
    mean = mean_materials(model)[0]
    # Half a million sums in float64 err by far less.
    np.testing.assert_allclose(mean.reflectance, 1.0, rtol=1e-9)


def test_a_material_on_triangles_without_area_has_a_mean_too(tmp_path: Path) -> None:
    document = square()
    white = document.texture(np.full((2, 2, 3), 255))
    surface = {"pbrMetallicRoughness": {"baseColorTexture": {"index": white}}}
    document.json["materials"] = [surface, surface]
    flat = document.mesh(
        attributes={
            "POSITION": document.accessor([[0, 0, 0], [1, 0, 0], [2, 0, 0]]),
            "TEXCOORD_0": document.accessor([[0, 0], [1, 0], [1, 1]]),
        },
        material=1,
    )
    document.json["nodes"].append({"name": "flat", "mesh": flat})
    document.json["scenes"][0]["nodes"] = [0, 1]
    model = load_model(str(document.write_glb(tmp_path / "flat.glb")))
    assert mean_materials(model)[1].reflectance == (1.0, 1.0, 1.0, 1.0)
