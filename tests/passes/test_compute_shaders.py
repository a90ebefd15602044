"""Compute shaders give the image of the fragment shaders from whose text they are made."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.errors import ShaderError
from simgl.gpu.compute_glsl import as_compute
from simgl.gpu.compute_screen import ComputeScreen
from simgl.gpu.glsl import Stage
from simgl.simulator import Product, Simulator
from tests.scenes import lambert, radiance, scene

FOIL = {
    "reflectance": 0.7,
    "metallic": 1.0,
    "roughness": 0.2,
    "crinkle": {"facet_size_m": 0.05, "slope": 0.1},
}
# Each both stands before a neighbour and casts its shadow on it.
CRAFT = {
    "foil": {
        "model": {"box": {"size_m": [1.0, 0.7, 0.5], "material": FOIL}},
        "position_icrf_m": [0.0, 0.0, 0.0],
        "quaternion_icrf_from_body_xyzw": [0.2, 0.3, 0.1, 0.927361849549570],
    },
    "dull": {
        "model": {"sphere": {"radius_m": 0.3, "material": lambert(0.5)}},
        "position_icrf_m": [0.5, 0.4, 0.6],
    },
    "sheet": {
        "model": {"plate": {"width_m": 2.0, "height_m": 2.0, "material": lambert(0.4)}},
        "position_icrf_m": [0.1, 0.2, -0.7],
    },
}
CAMERA = {
    "width_px": 48,
    "height_px": 40,
    "position_icrf_m": [0.3, 0.2, 8.0],
    "look_at": "foil",
    "focal_length_mm": 8.0,
}
SCENE = scene(CRAFT, CAMERA, sun_direction=(0.35, 0.2, 0.91515))


def test_compute_shaders_give_the_same_image(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But for the rounding of other instructions, a few last digits of float32."""
    by_fragments = radiance(gl, SCENE)
    monkeypatch.setattr("simgl.gpu.fullscreen.prefers_compute", bool)
    draws: list[None] = []
    draw = ComputeScreen.draw

    def counted(*values: Any, **named: Any) -> None:
        draws.append(draw(*values, **named))

    monkeypatch.setattr(ComputeScreen, "draw", counted)
    by_compute = radiance(gl, SCENE)
    assert len(draws) > len(CRAFT)
    assert by_fragments.any(axis=-1).mean() > 0.3
    np.testing.assert_allclose(by_compute, by_fragments, rtol=2e-5, atol=1e-6 * by_fragments.max())


def test_compute_shaders_divide_pixels_along_the_same_edges(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    camera = CAMERA | {"focal_length_mm": 32.0, "optics": {"diffraction": True}}
    camera |= {"width_px": 192, "height_px": 160}
    seen = scene(CRAFT, camera, sun_direction=(0.35, 0.2, 0.91515), render={"samples_per_pixel": 5})

    def electrons() -> Array:
        with Simulator(seen, gl) as simulator:
            made = simulator.capture(seen.at(seen.epoch_tai_ns), "cam", {Product.ELECTRONS})
        assert made.electrons is not None
        return made.electrons.electrons.astype(np.float64)

    by_fragments = electrons()
    monkeypatch.setattr("simgl.gpu.fullscreen.prefers_compute", bool)
    monkeypatch.setattr("simgl.rendering.camera_pipeline.prefers_compute", bool)
    by_compute = electrons()
    # A sample that rounding puts beyond a line counts on its other side, a thousandth of a pixel.
    np.testing.assert_allclose(by_compute, by_fragments, rtol=2e-3, atol=1e-3 * by_fragments.max())
    assert np.abs(by_compute - by_fragments).mean() < 1e-5 * by_fragments.max()


def test_an_output_that_no_image_holds_is_refused() -> None:
    stage = Stage("#version 330 core\nout vec3 colour;\nvoid main() {}\n", ("a/b.frag",))
    with pytest.raises(ShaderError, match=r"^a/b.frag: .* no image for vec3 colour$"):
        as_compute(stage)


def test_the_lines_after_an_output_keep_their_numbers() -> None:
    text = "#version 330 core\n#line 1 0\nout vec4 colour;\nvoid main() { colour = vec4(0.0); }\n"
    lines = as_compute(Stage(text, ("a/b.frag",))).text.splitlines()
    assert lines[lines.index("#line 2 0") + 1].startswith("void shade()")
