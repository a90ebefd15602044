"""A lens spreads light on a GPU as it does on the CPU: Fourier transforms by compute shaders."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.camera.camera import Camera
from simgl.camera.camera_equation import square_electrons_per_irradiance
from simgl.camera.detector import Mosaic
from simgl.camera.lens import Blur, PointSpread, Zone
from simgl.camera.point_spread import SunInCamera
from simgl.errors import ShaderError
from simgl.gpu.compute_program import ComputeProgram
from simgl.gpu.fourier import ComplexLayers, FourierTransforms, radices
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.passes.compute_spread import ComputeSpreadPass
from simgl.passes.exposure import ELECTRONS_FORMAT
from simgl.passes.spread import SpreadPass
from tests.camera.cameras import DIFFRACTION, camera
from tests.camera.test_point_spread import LIGHT, TRIPLET_LIKE

Array = np.ndarray[Any, np.dtype[Any]]

ZONES = PointSpread(
    diffraction=True,
    zones=(Zone(share=0.0, blur=Blur()), Zone(share=1.0, blur=Blur(aberration=12e-6))),
)
MOSAIC = Mosaic(
    order="GRBG", red=(0.6, 0.1, 0.0, 0.3), green=(0.05, 0.5, 0.1, 0.3), blue=(0.0, 0.1, 0.4, 0.2)
)
PHOTONS = np.array([3.3e18, 2.8e18, 2.3e18, 4.2e18])
SUN = SunInCamera(
    direction=np.array([0.02, 0.01, 0.99975]), irradiance=LIGHT, angular_radius=4.65e-3
)
LENSES: dict[str, dict[str, Any]] = {
    "spread": {"spread": DIFFRACTION},
    "zones and glare": {"spread": ZONES, "veiling_glare": 0.02},
    "glare": {"veiling_glare": 0.03},
    "ghosts": {"spread": DIFFRACTION, "surfaces": TRIPLET_LIKE, "veiling_glare": 0.01},
    "sharp ghosts": {"surfaces": TRIPLET_LIKE, "f_number": 20.0},
}


def test_transforms_are_those_of_numpy(gl: moderngl.Context) -> None:
    """Lengths of every radix, and of several; odd ones; more than one layer."""
    transforms = FourierTransforms(gl)
    for rows, columns in ((16, 15), (14, 13), (12, 11), (90, 7), (1, 8), (162, 250)):
        layers = ComplexLayers(gl, 2, (rows, columns))
        rng = np.random.default_rng(rows)
        values = rng.normal(size=(2, rows, columns)) + 1j * rng.normal(size=(2, rows, columns))
        layers.values.write(values.astype(np.complex64).tobytes())
        transforms.transform(layers)
        found = np.frombuffer(layers.values.read(), np.complex64).reshape(values.shape)
        wanted = np.fft.fft2(values)
        # Each of some steps rounds sums of up to 16 values: some 2^-24 of the root mean square,
        # and five times that for the largest of 40,000.
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=3e-6 * np.abs(wanted).std())
        transforms.inverse(layers)
        back = np.frombuffer(layers.values.read(), np.complex64).reshape(values.shape)
        np.testing.assert_allclose(back / (rows * columns), values, rtol=0.0, atol=3e-6)
        layers.release()
    transforms.release()


def test_a_length_without_steps_is_refused() -> None:
    assert [np.prod(radices(n)) for n in (1, 2, 960, 1080, 1350)] == [1, 2, 960, 1080, 1350]
    with pytest.raises(ValueError, match="17 values has no step"):
        radices(17)


def test_a_parameter_that_a_shader_lacks_is_named(gl: moderngl.Context) -> None:
    with pytest.raises(ShaderError, match=r"samplers \['speed'\] are declared but not used"):
        ComputeProgram(
            gl,
            "common/fourier_step",
            parameters=("size", "done", "sense", "speed"),
            defines={"RADIX": 2},
        )


def light(cam: Camera, *, glint: bool, sun: bool) -> Array:
    """Radiance of grey noise on a panel, perhaps with glints, and the Sun's disc [W m-2 sr-1]."""
    d = cam.detector
    radiance = np.zeros((d.height, d.width, 4), dtype=np.float32)
    radiance[40:100, 60:140] = 60.0 * np.random.default_rng(3).random((60, 80, 4))
    if glint:
        radiance[60:64, 30:37] = 2e6
        radiance[100, 150] = 1e5
    if sun:
        x, y = cam.project(SUN.direction)
        rows, columns = np.mgrid[0 : d.height, 0 : d.width] + 0.5
        radiance[np.hypot(columns - x, rows - y) < 10.0] = 5e6 * LIGHT / LIGHT.sum()
    return radiance


@pytest.mark.parametrize("coloured", [False, True])
@pytest.mark.parametrize("glint", [False, True])
@pytest.mark.parametrize("lens", LENSES)
def test_it_spreads_as_on_the_cpu(
    gl: moderngl.Context, lens: str, glint: bool, coloured: bool
) -> None:
    """All bands, and what filters make of them, added to as much again."""
    cam = camera(190, 131, **LENSES[lens])
    if coloured:
        cam = replace(cam, detector=replace(cam.detector, mosaic=MOSAIC))
    sun = SUN if "ghosts" in lens else None
    size = cam.detector.width, cam.detector.height
    radiance = ImageTarget(gl, size, [Format("f4", 4)])
    radiance.textures[0].write(light(cam, glint=glint, sun=sun is not None).tobytes())
    square = square_electrons_per_irradiance(replace(cam, exposure_time=1.0), PHOTONS)
    electrons = ImageTarget(gl, size, [ELECTRONS_FORMAT])
    bands = ImageTarget(gl, size, [Format("f4", 4)])
    made = []
    for spread in (SpreadPass(), ComputeSpreadPass(gl)):
        spread.electrons(cam, square, sun, radiance, electrons)
        spread.electrons(cam, square, sun, radiance, electrons, adds=True)
        spread.bands(cam, sun, radiance, bands)
        made.append([electrons.read().astype(np.float64), bands.read().astype(np.float64)])
        spread.release()
    for target in (radiance, electrons, bands):
        target.release()
    gl.detect_framebuffer(0).use()
    for on_cpu, on_gpu in zip(*made, strict=True):
        # Of what is in single precision at most 300 sunlit plates, as bright as 60 W m-2 sr-1.
        usual = float(np.quantile(on_cpu, 0.97)) if glint or sun else on_cpu.max()
        assert usual > 0.0
        np.testing.assert_allclose(on_gpu, on_cpu, rtol=1e-6, atol=1e-6 * usual)
        assert on_gpu.sum() == pytest.approx(on_cpu.sum(), rel=3e-7)


def test_a_black_image_stays_black(gl: moderngl.Context) -> None:
    cam = camera(100, 80, spread=DIFFRACTION, veiling_glare=0.01)
    radiance = ImageTarget(gl, (100, 80), [Format("f4", 4)])
    bands = ImageTarget(gl, (100, 80), [Format("f4", 4)])
    radiance.blacken()
    spread = ComputeSpreadPass(gl)
    spread.bands(cam, None, radiance, bands)
    assert not bands.read().any()
    gl.detect_framebuffer(0).use()
    for owner in (radiance, bands, spread):
        owner.release()
