"""One image of a case, and the pixels of it that a number is about."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from examples.fewer_pixels import fewer_pixels
from simgl import (
    Camera,
    Capture,
    FrameAssessment,
    Product,
    Scenario,
    SceneState,
    Simulator,
    Verdict,
    assess_frame,
    display_from_radiance,
    verdict,
)
from simgl.arrays import Array, Array32, Image8, Mask
from simgl.assess.target_background import ring_around
from simgl.figures.false_colour import relative_flux

TARGET = "space_rider"
# Body axes of Space Rider.
BACK, PORT = np.array([0.0, 0.0, -1.0]), np.array([0.0, -1.0, 0.0])
PRODUCTS = frozenset(
    {
        Product.DN,
        Product.ELECTRONS,
        Product.RADIANCE,
        Product.TRUTH,
        Product.NORMALS,
        Product.LAYERS,
    }
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Shot:
    """An image, its assessment, and the processor time that it took on all cores [s]."""

    capture: Capture
    state: SceneState
    assessment: FrameAssessment
    verdict: Verdict
    reasons: tuple[str, ...]
    seconds: float

    @property
    def radiance(self) -> Array32:
        """(height, width, 4) [W m-2 sr-1]."""
        assert self.capture.radiance is not None
        return self.capture.radiance.radiance

    @property
    def image(self) -> Image8:
        """(height, width, 3) sRGB; a white plate that faces the Sun is white."""
        return display_from_radiance(self.radiance)

    @property
    def flux(self) -> Array:
        """(height, width) relative luminance times 1367, the study's flux [W m-2]."""
        return relative_flux(self.radiance)

    @property
    def flux_from_8_bits(self) -> Array:
        """(height, width) the study's flux as its script has it from an 8-bit image [W m-2]."""
        code = self.image / 255.0
        linear = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
        return 1367.0 * linear @ np.array([0.2126, 0.7152, 0.0722])

    @property
    def exitance(self) -> Array:
        """(height, width) pi times the radiance, 400-1000 nm [W m-2].

        What leaves a surface, if it is equally bright from all sides.
        """
        return np.pi * self.radiance.sum(axis=-1, dtype=np.float64)

    def part(self, *names: str) -> Mask:
        """Pixels of parts of Space Rider; of all of it if none is named."""
        truth = self.capture.truth
        assert truth is not None
        wanted = [
            number
            for number, name in truth.part_names.items()
            if name.startswith(f"{TARGET}/") and (not names or name.split("/")[1] in names)
        ]
        return np.isin(truth.part_id, wanted)

    @property
    def background(self) -> Mask:
        """Pixels without a spacecraft."""
        assert self.capture.truth is not None
        return self.capture.truth.part_id == 0

    @property
    def around_target(self) -> Mask:
        """Background next to Space Rider."""
        return ring_around(self.part(), ~self.background)

    def facing(self, direction_body: Array, within_deg: float) -> Mask:
        """Pixels whose surface looks along a body axis."""
        R_icrf_from_body = self.state.bodies[TARGET].pose.R_icrf_from_body
        return self._facing(R_icrf_from_body @ direction_body, within_deg)

    @property
    def sunlit(self) -> Mask:
        """Pixels with more direct sunlight than light of other kinds."""
        return self._by_sunlight(0.5, 1.0)

    @property
    def in_cast_shadow(self) -> Mask:
        """Pixels that face the Sun and get hardly any of it."""
        position = self.state.bodies[TARGET].pose.position
        towards = self.state.sun.seen_from(position).direction_icrf
        return self._facing(towards, 30.0) & self._by_sunlight(-1.0, 0.02)

    def _facing(self, direction_icrf: Array, within_deg: float) -> Mask:
        assert self.capture.normals is not None
        towards = self.capture.info.R_camera_from_icrf @ direction_icrf
        return self.capture.normals.normals @ towards > np.cos(np.radians(within_deg))

    def _by_sunlight(self, above: float, upto: float) -> Mask:
        """Pixels whose share of direct sunlight in all their light lies in a range."""
        assert self.capture.layers is not None
        sun = self.capture.layers.layers["sun"].sum(axis=-1)
        share = sun / np.maximum(self.radiance.sum(axis=-1), 1e-12)
        return (share > above) & (share <= upto)

    def saturated_at(self, exposure_time: float) -> float:
        """Share of Space Rider's pixels that another exposure time [s] would fill."""
        assert self.capture.electrons is not None
        times = exposure_time / self.capture.info.camera.exposure_time
        electrons = self.capture.electrons.electrons[self.part()]
        full = self.assessment.full_electrons
        assert full is not None
        return float(np.mean(electrons * times >= full))


def smaller(scenario: Scenario, shrink: int) -> Scenario:
    """A scenario whose cameras have fewer, larger pixels, the same field, and as full wells."""

    def dimmed(camera: Camera) -> Camera:
        r, g, b, n = (share / shrink**2 for share in camera.lens.transmission)
        return replace(camera, lens=replace(camera.lens, transmission=(r, g, b, n)))

    fewer = fewer_pixels(scenario, shrink)
    return replace(fewer, cameras={n: dimmed(c) for n, c in fewer.cameras.items()})


def take(simulator: Simulator, camera: str) -> Shot:
    """The image that a camera takes at the scenario's epoch."""
    scenario = simulator.scenario
    state = scenario.at(scenario.epoch_tai_ns)
    capture = simulator.capture(state, camera, PRODUCTS)
    # A second one, which finds programs compiled and shadows drawn.
    start = time.process_time()
    simulator.capture(state, camera, {Product.DN})
    seconds = time.process_time() - start
    assessment = assess_frame(capture, state, TARGET)
    judgement, reasons = verdict(assessment, scenario.criteria)
    return Shot(
        capture=capture,
        state=state,
        assessment=assessment,
        verdict=judgement,
        reasons=reasons,
        seconds=seconds,
    )
