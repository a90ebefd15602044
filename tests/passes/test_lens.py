"""The lens in pictures: camera equation, vignetting, distortion; shaders against numpy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.camera.camera import Camera
from simgl.camera.camera_equation import square_electrons_per_irradiance
from simgl.camera.detector import Mosaic
from simgl.camera.distortion import relative_illumination, sight_lines
from simgl.camera.lens import Vignetting
from simgl.camera.point_spread import Spread
from simgl.camera.projections import Distortion, Fisheye
from simgl.gpu.render_targets import Area, Format, ImageTarget
from simgl.images import ElectronFrame, RadianceFrame, TruthFrame
from simgl.rendering.camera_pipeline import CameraPipeline
from simgl.simulator import Capture, Product, Simulator
from tests.camera.cameras import DIFFRACTION, camera
from tests.reference.optics import image_irradiance
from tests.scenes import SUN, USUAL_PRODUCTS, capture, lambert, scene

WIDE = Distortion(k1=-0.28, k2=0.07, p1=0.0015, p2=-0.001)
PINCUSHION = Distortion(k1=0.12, k2=0.02, k3=0.01, k4=0.05, p1=-0.001)


Array = np.ndarray[Any, np.dtype[Any]]


def irradiance(gl: moderngl.Context, cam: Camera, radiance: Array) -> Array:
    """The optics of the renderer on given radiance."""
    target = ImageTarget(gl, (cam.detector.width, cam.detector.height), [Format("f4", 4)])
    target.textures[0].write(radiance.astype("<f4").tobytes())
    with CameraPipeline(gl) as camera_pipeline:
        found = camera_pipeline.irradiance(cam, target).read()
    gl.detect_framebuffer(0).use()
    target.release()
    return found


@pytest.mark.parametrize(
    "lens",
    [
        {},
        {"camera_equation": "1+4N2", "transmission": (0.9, 0.8, 0.7, 0.6)},
        {"vignetting": Vignetting(natural=False)},
        {"vignetting": Vignetting(angles=(0.0, 0.03, 0.2), relative=(1.0, 0.9, 0.3))},
        {"distortion": WIDE, "focal_length": 0.7e-3},
        {"distortion": PINCUSHION, "focal_length": 0.7e-3},
    ],
    ids=["plain", "1+4N2", "even", "measured", "barrel", "pincushion"],
)
def test_shader_and_reference_agree(gl: moderngl.Context, lens: dict[str, Any]) -> None:
    cam = camera(**lens)
    radiance = np.random.default_rng(5).random((192, 256, 4))
    # A few float32 products and, for maps, interpolated tangents: 2e-6.
    np.testing.assert_allclose(
        irradiance(gl, cam, radiance), image_irradiance(cam, radiance), rtol=2e-6
    )


@pytest.mark.parametrize("by_compute", [False, True])
@pytest.mark.parametrize("width", [256, 254])
def test_behind_colour_filters_a_spread_image_makes_the_electrons_of_its_bands(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, width: int, by_compute: bool
) -> None:
    """The sums behind the filters are spread; the bands would be four times as much to spread."""
    monkeypatch.setattr("simgl.rendering.camera_pipeline.prefers_compute", lambda _: by_compute)
    red, green, blue = (0.6, 0.1, 0.0, 0.3), (0.05, 0.5, 0.1, 0.3), (0.0, 0.1, 0.4, 0.2)
    plain = camera(width, spread=DIFFRACTION, veiling_glare=0.01)
    mosaic = Mosaic(order="GRBG", red=red, green=green, blue=blue)
    cam = replace(plain, detector=replace(plain.detector, mosaic=mosaic))
    radiance = np.zeros((192, width, 4))
    radiance[50:120, 60:140] = np.random.default_rng(5).random((70, 80, 4))
    photons = np.array([3.3e18, 2.8e18, 2.3e18, 4.2e18])
    target = ImageTarget(gl, (width, 192), [Format("f4", 4)])
    target.textures[0].write(radiance.astype("<f4").tobytes())
    with CameraPipeline(gl) as camera_pipeline:
        bands = camera_pipeline.irradiance(cam, target).read().astype(np.float64)
        found = camera_pipeline.electrons_through(cam, photons, target).read()
    gl.detect_framebuffer(0).use()
    target.release()
    square = square_electrons_per_irradiance(cam, photons)
    for place, weights in enumerate(square):
        of = np.s_[place // 2 :: 2, place % 2 :: 2]
        np.testing.assert_allclose(found[of], bands[of] @ weights, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("by_compute", [False, True])
@pytest.mark.parametrize(
    ("lit", "area"),
    [
        (np.s_[60:100, 90:150], (80, 50, 100, 60)),
        (np.s_[0:30, 200:256], (190, 0, 66, 40)),
        (np.s_[0:192, 0:256], (0, 0, 256, 192)),
        (np.s_[0:0, 0:0], (0, 0, 0, 0)),
    ],
)
def test_what_is_black_for_sure_needs_no_reading(
    gl: moderngl.Context,
    monkeypatch: pytest.MonkeyPatch,
    lit: tuple[slice, slice],
    area: Area,
    by_compute: bool,
) -> None:
    """Of an image with light in one area, that area tells all: to the bit."""
    monkeypatch.setattr("simgl.rendering.camera_pipeline.prefers_compute", lambda _: by_compute)
    cam = camera(256, spread=DIFFRACTION, veiling_glare=0.01)
    radiance = np.zeros((192, 256, 4), dtype=np.float32)
    radiance[lit] = np.random.default_rng(6).random(radiance[lit].shape)
    photons = np.array([3.3e18, 2.8e18, 2.3e18, 4.2e18])
    target = ImageTarget(gl, (256, 192), [Format("f4", 4)])
    target.textures[0].write(radiance.tobytes())
    with CameraPipeline(gl) as pipeline:
        whole = pipeline.electrons_through(cam, photons, target).read().copy()
        known = pipeline.electrons_through(cam, photons, target, None, area).read()
    gl.detect_framebuffer(0).use()
    target.release()
    assert (whole.max() > 0.0) == bool(radiance.any())
    np.testing.assert_array_equal(known, whole)


@pytest.mark.parametrize("by_compute", [False, True])
def test_exposure_and_gain_change_without_new_kernels(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, by_compute: bool
) -> None:
    """A loop that sets them for every image must not wait for the point spread each time."""
    made: list[Camera] = []

    def watched(cam: Camera, *others: Any) -> Spread:
        made.append(cam)
        return Spread(cam, *others)

    monkeypatch.setattr("simgl.rendering.camera_pipeline.prefers_compute", lambda _: by_compute)
    monkeypatch.setattr("simgl.passes.spread.Spread", watched)
    monkeypatch.setattr("simgl.passes.compute_spread.Spread", watched)
    cam = camera(256, spread=DIFFRACTION)
    target = ImageTarget(gl, (256, 192), [Format("f4", 4)])
    radiance = np.random.default_rng(8).random((192, 256, 4))
    target.textures[0].write(radiance.astype("<f4").tobytes())
    photons = np.array([3.3e18, 2.8e18, 2.3e18, 4.2e18])
    with CameraPipeline(gl) as pipeline:
        once = pipeline.electrons_through(cam, photons, target).read().copy()
        longer = replace(
            cam,
            exposure_time=2.5 * cam.exposure_time,
            detector=replace(cam.detector, gain_dn_per_e=0.5, read_noise=1.0),
        )
        found = pipeline.electrons_through(longer, photons, target).read()
        other = replace(cam, lens=replace(cam.lens, f_number=2.0 * cam.lens.f_number))
        pipeline.electrons_through(other, photons, target)
    gl.detect_framebuffer(0).use()
    target.release()
    # Two float32 products.
    np.testing.assert_allclose(found, 2.5 * once, rtol=3e-7)
    assert made == [cam, other]


@pytest.mark.parametrize("width", [256, 254])
@pytest.mark.parametrize(
    "lens",
    [{}, {"vignetting": Vignetting(angles=(0.0, 0.03, 0.2), relative=(1.0, 0.9, 0.3))}],
    ids=["plain", "measured"],
)
@pytest.mark.parametrize("coloured", [False, True])
def test_a_sharp_image_makes_the_electrons_of_its_irradiance(
    gl: moderngl.Context, lens: dict[str, Any], width: int, coloured: bool
) -> None:
    """From radiance in one step, which never writes the irradiance down."""
    cam = camera(width, **lens)
    if coloured:
        mosaic = Mosaic(
            order="RGGB", red=(0.6, 0.1, 0.0, 0.3), green=(0.1, 0.5, 0.1, 0.3), blue=(0, 0, 1, 0)
        )
        cam = replace(cam, detector=replace(cam.detector, mosaic=mosaic))
    radiance = np.random.default_rng(6).random((192, width, 4))
    photons = np.array([3.3e18, 2.8e18, 2.3e18, 4.2e18])
    target = ImageTarget(gl, (width, 192), [Format("f4", 4)])
    target.textures[0].write(radiance.astype("<f4").tobytes())
    with CameraPipeline(gl) as camera_pipeline:
        bands = camera_pipeline.irradiance(cam, target)
        in_two_steps = camera_pipeline.electrons(cam, photons, bands).read().copy()
        found = camera_pipeline.electrons_through(cam, photons, target).read()
    gl.detect_framebuffer(0).use()
    target.release()
    assert found.max() > 0.0
    # Some float32 products in another order.
    np.testing.assert_allclose(found, in_two_steps, rtol=2e-6)


# Corner of 1280 x 960 pixels of 3.75 um: focal length [mm], relative illumination.
@pytest.mark.parametrize(
    ("millimetres", "expected"), [(4.0, 0.409600), (8.0, 0.768625), (16.0, 0.933229)]
)
def test_corner_gets_cos4(millimetres: float, expected: float) -> None:
    cam = camera(1280, 960, focal_length=millimetres * 1e-3)
    corner = relative_illumination(cam)[0, 0]
    # At the centre of the corner pixel, half a pixel in: (f^2 / (f^2 + r^2))^2.
    r = np.hypot(639.5, 479.5) * 3.75e-6
    f = millimetres * 1e-3
    assert corner == pytest.approx((f**2 / (f**2 + r**2)) ** 2, rel=1e-6)
    r = np.hypot(640.0, 480.0) * 3.75e-6
    assert (f**2 / (f**2 + r**2)) ** 2 == pytest.approx(expected, abs=1e-6)
    assert corner == pytest.approx(expected, rel=2e-3)


FLAT = Vignetting(natural=False)
MEASURED = Vignetting(natural=False, angles=(0.0, 0.5), relative=(1.0, 0.5))


@pytest.mark.parametrize("aspect", [1.0, 1.5, 0.7])
@pytest.mark.parametrize("vignetting", [Vignetting(), FLAT, MEASURED])
@pytest.mark.parametrize(
    "lens",
    [{}, {"skew": 0.1}, {"distortion": WIDE}, {"distortion": Fisheye(k1=0.05)}],
    ids=["plain", "skew", "barrel", "fisheye"],
)
def test_a_pixel_on_the_axis_collects_by_its_solid_angle(
    lens: dict[str, Any], vignetting: Vignetting, aspect: float
) -> None:
    """Light of a star does not depend on how a lens falls off away from it."""
    # The axis in the middle of a pixel.
    offset = (0.5 * 3.75e-6, 0.5 * 3.75e-6)
    cam = camera(64, 48, vignetting=vignetting, aspect=aspect, principal_offset=offset, **lens)
    on_axis = relative_illumination(cam)[24, 32]
    # 1 / (fx fy) over that of square pixels, 1 / fx^2; float32.
    assert on_axis == pytest.approx(1.0 / aspect, rel=1e-6)


@pytest.mark.parametrize("distortion", [WIDE, PINCUSHION], ids=["barrel", "pincushion"])
def test_distortion_is_inverted(distortion: Distortion) -> None:
    rng = np.random.default_rng(2)
    tangents = rng.uniform(-0.6, 0.6, (1000, 2))
    there = distortion.distorted(tangents)
    np.testing.assert_allclose(distortion.undistorted(there), tangents, atol=1e-10)
    step = 1e-6
    for axis in range(2):
        side = np.eye(2)[axis] * step
        slope = (distortion.distorted(tangents + side) - distortion.distorted(tangents - side)) / (
            2.0 * step
        )
        np.testing.assert_allclose(distortion.jacobian(tangents)[..., axis], slope, atol=1e-8)


def test_distortion_in_the_convention_of_opencv() -> None:
    """One point worked by hand: x = 0.3, y = -0.2, r^2 = 0.13."""
    d = Distortion(k1=-0.3, k2=0.1, k3=-0.02, k4=0.01, k5=0.02, k6=-0.03, p1=0.001, p2=-0.002)
    r2 = 0.13
    radial = (1 - 0.3 * r2 + 0.1 * r2**2 - 0.02 * r2**3) / (
        1 + 0.01 * r2 + 0.02 * r2**2 - 0.03 * r2**3
    )
    x = 0.3 * radial + 2 * 0.001 * (0.3 * -0.2) + -0.002 * (r2 + 2 * 0.3**2)
    y = -0.2 * radial + 0.001 * (r2 + 2 * 0.2**2) + 2 * -0.002 * (0.3 * -0.2)
    np.testing.assert_allclose(d.distorted(np.array([0.3, -0.2])), [x, y], rtol=1e-14)


BALLS = [(0.0, 0.0), (0.33, 0.21), (-0.3, 0.25), (0.36, -0.27), (-0.36, -0.05)]


# At the origin, 49 deg wide.
CAMERA: dict[str, Any] = {
    "position_icrf_m": [0, 0, 0],
    "boresight": [0, 0, 1],
    "up": [0, -1, 0],
    "width_px": 640,
    "height_px": 480,
    "pixel_pitch_um": 10.0,
    "focal_length_mm": 7.0,
}


def balls(optics: dict[str, Any], **sun: Any) -> Any:
    """Small spheres over a wide field, lit from behind the camera at the origin."""
    ball = {"sphere": {"radius_m": 0.05, "material": lambert(0.8)}}
    return scene(
        {
            f"ball{i}": {"model": ball, "position_icrf_m": [10.0 * x, 10.0 * y, 10.0]}
            for i, (x, y) in enumerate(BALLS)
        },
        {**CAMERA, "optics": optics},
        sun_direction=(0.0, 0.0, -1.0),
        **sun,
    )


BARREL = {"distortion": {"k1": -0.28, "k2": 0.07, "p1": 0.0015, "p2": -0.001}}


def frames(exposure: Capture) -> tuple[RadianceFrame, TruthFrame, ElectronFrame]:
    assert exposure.radiance is not None
    assert exposure.truth is not None
    assert exposure.electrons is not None
    return exposure.radiance, exposure.truth, exposure.electrons


def centroid(image: Array, about: Array) -> Array:
    """Centroid of the light within 9 pixels."""
    y, x = np.mgrid[0 : image.shape[0], 0 : image.shape[1]] + 0.5
    near = np.where(np.hypot(x - about[0], y - about[1]) < 9.0, image.astype(np.float64), 0.0)
    return [np.sum(near * x), np.sum(near * y)] / near.sum()


def test_bodies_appear_where_the_lens_puts_them(gl: moderngl.Context) -> None:
    render = {"samples_per_pixel": 64}
    scenario = balls(BARREL, render=render)
    cam = scenario.cameras["cam"]
    k = cam.intrinsics
    straight, _, _ = frames(capture(gl, balls({}, render=render)))
    radiance, truth, _ = frames(capture(gl, scenario))
    for index, (x, y) in enumerate(BALLS):
        # Off the axis the light of a sphere is not quite in its middle: the pinhole's picture says
        # where.
        light = centroid(straight.radiance[..., 1], k[:2, 2] + k[0, 0] * np.array([x, y]))
        place = cam.project(np.array([*(light - k[:2, 2]) / k[0, 0], 1.0]))
        found = centroid(radiance.radiance[..., 1], place)
        # 64 samples in each of 38 pixels: 0.005 of a pixel in either picture.
        assert np.hypot(*(found - place)) < 0.02
        place = cam.project(np.array([x, y, 1.0]))
        seen = truth.part_id == (index + 1) * 65536 + 1
        # Whole pixels: 22 on the edge, each in or out by chance, 3.5 away from the middle of 38,
        # move the middle by sqrt(22) 0.29 3.5 / 38 = 0.125.
        assert np.hypot(*(centroid(seen, place) - place)) < 0.3
        if index:
            # A pinhole puts it elsewhere.
            assert np.hypot(*(light - found)) > 5.0


def test_a_tile_lit_in_parts_is_that_lit_at_once(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A pixel across a cut has its coverage once, not from either part."""
    ball = {"sphere": {"radius_m": 2.0, "material": lambert(0.8)}}
    one = scene(
        {"ball": {"model": ball, "position_icrf_m": [1.0, 0.7, 10.0]}},
        {**CAMERA, "optics": BARREL},
        sun_direction=(0.0, 0.0, -1.0),
        render={"samples_per_pixel": 64},
    )
    whole = capture(gl, one).radiance
    monkeypatch.setattr("simgl.view.frame_view._SAMPLES_AT_ONCE", 100_000)
    cut = capture(gl, one).radiance
    assert whole is not None
    assert cut is not None
    peak = float(whole.radiance.max())
    # Samples on an edge: 64 in a pixel place it to some 0.01 px; coverage counted twice is 0.25.
    np.testing.assert_allclose(cut.radiance, whole.radiance, atol=0.05 * peak)
    assert cut.radiance.sum(dtype=np.float64) == pytest.approx(
        whole.radiance.sum(dtype=np.float64), rel=1e-4
    )


def test_a_distorted_image_depends_on_no_earlier_one(gl: moderngl.Context) -> None:
    """Pixels across a tile's edges see beyond its samples, where those of other images lie."""
    box = {"box": {"size_m": [4.0, 3.0, 0.1], "material": lambert(0.8)}}
    one = scene(
        {"box": {"model": box, "position_icrf_m": [1.0, 0.7, 30.0]}},
        {**CAMERA, "optics": BARREL},
        sun_direction=(0.0, 0.0, -1.0),
    )
    far = one.at(one.epoch_tai_ns)
    nearer = replace(far.bodies["box"].pose, position=np.array([1.0, 0.7, 8.0]))
    near = replace(far, bodies={"box": replace(far.bodies["box"], pose=nearer)})
    with Simulator(one, gl) as simulator:
        images = [
            simulator.capture(state, "cam", {Product.RADIANCE}).radiance
            for state in (far, near, far)
        ]
    first, _, again = images
    assert first is not None
    assert again is not None
    np.testing.assert_array_equal(again.radiance, first.radiance)


def test_bodies_keep_their_light(gl: moderngl.Context) -> None:
    """What a lens collects of a body does not depend on where its picture is stretched to."""
    render = {"samples_per_pixel": 64}
    straight = frames(capture(gl, balls({}, render=render)))[2].electrons
    bent = frames(capture(gl, balls(BARREL, render=render)))[2].electrons
    # 38 pixels a ball with 64 samples each: the light of one is good to 1e-3.
    assert bent.sum(dtype=np.float64) == pytest.approx(straight.sum(dtype=np.float64), rel=1e-3)


def test_the_sun_appears_where_the_lens_puts_it(gl: moderngl.Context) -> None:
    scenario = scene(
        {},
        {**CAMERA, "optics": BARREL},
        sun_direction=(0.33, 0.24, 1.0),
    )
    image = frames(capture(gl, scenario))[0].radiance[..., 1]
    place = scenario.cameras["cam"].project(np.array([0.33, 0.24, 1.0]))
    assert np.hypot(*(centroid(image, place) - place)) < 0.02
    # Its solid angle as well: pi (0.263 deg)^2.
    cam = scenario.cameras["cam"]
    relative = relative_illumination(cam) / np.float32(1.0)
    cos = sight_lines(cam)[..., 2]
    # relative = cos^4 / stretch, and a pixel's solid angle is cos^3 / stretch / f^2.
    angle = np.sum(image * (relative / cos)) / cam.focal_length_px**2
    # The disc's edge is drawn over a pixel of width; 3.2 pixels across: 1 %.
    disc = np.pi * np.radians(0.5 * SUN["angular_diameter_deg"]) ** 2
    mean = image[image > 0.99 * image.max()].mean(dtype=np.float64)
    assert angle == pytest.approx(mean * disc, rel=0.03)


def test_layers_of_a_distorted_picture_sum_to_it(gl: moderngl.Context) -> None:
    scenario = balls(BARREL)
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        exposure = simulator.capture(state, "cam", {Product.LAYERS, *USUAL_PRODUCTS})
    assert exposure.layers is not None
    radiance, truth, _ = frames(exposure)
    np.testing.assert_allclose(exposure.layers.total, radiance.radiance, rtol=1e-5, atol=1e-6)
    # Depth is along the boresight whatever the lens does.
    seen = truth.depth > 0
    assert truth.depth[seen].min() == pytest.approx(9.95, abs=0.01)
