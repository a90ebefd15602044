"""Thermal detectors: uncooled bolometers and cooled photon detectors, from radiance to DN."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from simgl import assets
from simgl.arrays import Array, Image16
from simgl.camera.diffraction import diffraction_mtf
from simgl.config.validation import convert, read_toml
from simgl.config.value_types import Fraction, NonNegative, Positive, Table
from simgl.errors import AssetError, did_you_mean
from simgl.physics.thermal_radiation import band_photon_radiance, band_radiance

# NETD is given for a black body at this temperature [K].
NETD_TEMPERATURE = 300.0
# Wavelengths over which the transfer function of diffraction is averaged.
_WAVELENGTHS = 5
# Random streams of one detector.
_TEMPORAL, _GAIN, _OFFSET, _DRIFT = range(4)


class InfraredDetectorTable(Table, frozen=True, kw_only=True):
    """A preset in ``simgl/data/infrared_detectors.toml``.

    netd_mk : of a bolometer, at 300 K with the optics given, all noise in time
    time_constant_ms : of a bolometer's pixel, between its frames
    range_k : scene temperatures of a bolometer's lowest and highest DN
    gain_spread, offset_spread_k : fixed pattern that is left after the last shutter correction
    drift_k_per_sqrt_min : random walk of each pixel's offset since then
    """

    source: str
    kind: Literal["bolometer", "photon"]
    band_um: tuple[Positive, Positive]
    width_px: int
    height_px: int
    pixel_pitch_um: Positive
    f_number: Positive
    transmission: Fraction
    optics_temperature_k: Positive = 295.0
    bits: int = 14
    netd_mk: NonNegative = 0.0
    time_constant_ms: NonNegative = 0.0
    range_k: tuple[Positive, Positive] = (233.0, 423.0)
    quantum_efficiency: Fraction = 0.0
    integration_time_ms: NonNegative = 0.0
    full_well_e: NonNegative = 0.0
    read_noise_e: NonNegative = 0.0
    dark_current_e_s: NonNegative = 0.0
    gain_spread: Fraction = 0.0
    offset_spread_k: NonNegative = 0.0
    drift_k_per_sqrt_min: NonNegative = 0.0


@dataclass(frozen=True, kw_only=True)
class InfraredDetector:
    """A thermal detector with its optics; see ``InfraredDetectorTable`` for what is in it.

    band [m]; lengths, times and temperatures in SI units.
    minutes_since_shutter : since the offsets were last corrected [min]
    """

    name: str
    table: InfraredDetectorTable
    minutes_since_shutter: float = 0.0

    @property
    def band(self) -> tuple[float, float]:
        """Lower and upper wavelength [m]."""
        low, high = self.table.band_um
        return 1e-6 * low, 1e-6 * high

    def emission(self, temperature: Array) -> Array:
        """Radiance of a black body as the detector counts it: W or photons s-1 m-2 sr-1."""
        radiance = band_radiance if self.table.kind == "bolometer" else band_photon_radiance
        return radiance(self.band, temperature)

    def watts(self, temperature: Array) -> Array:
        """Radiance of a black body in the band [W m-2 sr-1]."""
        return band_radiance(self.band, temperature)

    @property
    def levels(self) -> int:
        """Number of DN."""
        return int(2**self.table.bits)

    @property
    def exposure_time(self) -> float:
        """Over which a pixel sees: integration time, or a bolometer's time constant [s]."""
        t = self.table
        return 1e-3 * (t.integration_time_ms if t.kind == "photon" else t.time_constant_ms)

    @property
    def reads_at_epoch(self) -> bool:
        """Whether the epoch of an image is when it is read, not the middle of its exposure."""
        return self.table.kind == "bolometer"

    @property
    def collected(self) -> float:
        """Irradiance of the image plane over the scene's radiance [sr]: pi t / (4 N^2 + 1)."""
        t = self.table
        return np.pi * t.transmission / (4.0 * t.f_number**2 + 1.0)

    @cached_property
    def optics_radiance(self) -> float:
        """Radiance of the warm optics, over that of the scene's light that they pass."""
        t = self.table
        warm = float(self.emission(np.array(t.optics_temperature_k)))
        return warm * (1.0 - t.transmission) / t.transmission

    def signal(self, radiance: Array) -> Array:
        """(...) mean signal: DN of a bolometer, electrons of a photon detector.

        A bolometer's DN are linear in radiance between those of its range: its shutter takes off
        what optics and housing emit. A photon detector collects that, too.
        """
        t = self.table
        if t.kind == "bolometer":
            low, high = self._range
            return np.asarray((radiance - low) / (high - low) * (self.levels - 1))
        area = (1e-6 * t.pixel_pitch_um) ** 2
        rate = (radiance + self.optics_radiance) * self.collected * area * t.quantum_efficiency
        return np.asarray(1e-3 * t.integration_time_ms * (rate + t.dark_current_e_s))

    @cached_property
    def _range(self) -> Array:
        """(2,) radiance of a bolometer's lowest and highest DN."""
        return self.emission(np.array(self.table.range_k))

    @cached_property
    def _netd_response(self) -> float:
        return self.response(NETD_TEMPERATURE)

    @property
    def electrons_per_dn(self) -> float:
        """Of a photon detector."""
        return self.table.full_well_e / (self.levels - 1)

    def response(self, temperature: float) -> float:
        """Change of the signal with a black body's temperature [signal K-1]."""
        step = 0.01
        ends = self.signal(self.emission(np.array([temperature - step, temperature + step])))
        return float(ends[1] - ends[0]) / (2.0 * step)

    def noise(self, signal: Array) -> Array:
        """(...) standard deviation in time, in the unit of the signal.

        Of a bolometer the same for every signal, from its NETD; of a photon detector shot and read
        noise.
        """
        t = self.table
        if t.kind == "bolometer":
            return np.full(np.shape(signal), 1e-3 * t.netd_mk * self._netd_response)
        return np.sqrt(np.maximum(signal, 0.0) + t.read_noise_e**2)

    def digitised(
        self, radiance: Array, seed: tuple[int, ...], tai_ns: int, draw: int = 0
    ) -> Image16:
        """(h, w) DN of a radiance image, with all noise.

        radiance : (h, w) as ``emission`` counts it
        seed : of the fixed pattern; numbers from 0 on
        tai_ns : of the frame; noise in time depends on both
        draw : which of several images of this epoch
        """
        t, shape = self.table, radiance.shape
        blurred = diffracted(radiance, self)
        response = abs(self._netd_response)
        signal = self.signal(blurred)
        gain = 1.0 + t.gain_spread * _pattern(shape, *seed, _GAIN)
        offset = t.offset_spread_k * _pattern(shape, *seed, _OFFSET)
        walk = t.drift_k_per_sqrt_min * np.sqrt(self.minutes_since_shutter)
        offset = offset + walk * _pattern(shape, *seed, _DRIFT)
        noisy = signal * gain + offset * response
        noisy += self.noise(signal) * _normal(shape, *seed, _TEMPORAL, tai_ns, draw)
        if t.kind == "photon":
            noisy = np.minimum(noisy, t.full_well_e) / self.electrons_per_dn
        return np.clip(np.floor(noisy + 0.5), 0, self.levels - 1).astype(np.uint16)


def _normal(shape: tuple[int, ...], *key: int) -> Array:
    """Normal deviates that depend on the key alone."""
    return np.random.default_rng(key).standard_normal(shape)


@lru_cache(maxsize=12)
def _pattern(shape: tuple[int, ...], *key: int) -> Array:
    """The same of a detector's own pattern, for all of its frames."""
    return _normal(shape, *key)


def lagged(before: Array, radiance: Array, seconds: float, detector: InfraredDetector) -> Array:
    """(h, w) radiance as a bolometer's pixels hold it, after a time under a new radiance.

    before, radiance : (h, w)
    seconds : since ``before``

    A pixel's temperature follows by 1 - exp(-t / tau): edges that move leave a smear.
    """
    tau = 1e-3 * detector.table.time_constant_ms
    share = 1.0 if tau == 0.0 else 1.0 - np.exp(-seconds / tau)
    return np.asarray(before + share * (radiance - before))


def diffracted(radiance: Array, detector: InfraredDetector) -> Array:
    """(h, w) image behind a circular pupil, as it is in the mean over the band.

    Beyond the edges the image goes on as its mirror image. Pixels are means over their area
    already, so that only the pupil's transfer function is applied.
    """
    # Slow to import, and for thermal cameras alone.
    from scipy import fft

    return np.asarray(fft.idctn(fft.dctn(radiance) * _mtf(radiance.shape, detector)))


@lru_cache(maxsize=4)
def _mtf(shape: tuple[int, ...], detector: InfraredDetector) -> Array:
    """(h, w) of the pupil at the frequencies of a cosine transform."""
    t = detector.table
    height, width = shape
    # The cosine transform of the mirrored image: frequencies are k / (2 n) cycles per pixel.
    rows, columns = (np.arange(n) / (2.0 * n) for n in (height, width))
    frequency = np.hypot(rows[:, None], columns) / (1e-6 * t.pixel_pitch_um)
    wavelengths = np.linspace(*detector.band, _WAVELENGTHS)
    mtf = [diffraction_mtf(frequency * w * t.f_number) for w in wavelengths]
    return np.asarray(np.mean(mtf, axis=0))


def measured_netd(
    detector: InfraredDetector, temperature: float = NETD_TEMPERATURE, size: int = 128
) -> float:
    """NETD as a test bench measures it [K]: noise of frames of one black body over the response.

    temperature : of the black body [K]; the response is taken from 2 K above and below
    """

    def frame(kelvin: float, number: int) -> Array:
        flat = np.full((size, size), float(detector.emission(np.array(kelvin))))
        return detector.digitised(flat, (1,), number).astype(np.float64)

    # The difference of two frames has no fixed pattern.
    noise = float((frame(temperature, 1) - frame(temperature, 2)).std()) / np.sqrt(2.0)
    rise = float(frame(temperature + 2.0, 3).mean() - frame(temperature - 2.0, 4).mean()) / 4.0
    return noise / rise


def infrared_detectors() -> dict[str, InfraredDetector]:
    """The shipped presets by name."""
    path = assets.data() / "infrared_detectors.toml"
    return {
        name: InfraredDetector(
            name=name, table=convert(data, InfraredDetectorTable, f"{path} [{name}]")
        )
        for name, data in read_toml(path).items()
    }


def load_infrared_detector(name: str) -> InfraredDetector:
    """A shipped preset; raises AssetError with a suggestion for an unknown name."""
    presets = infrared_detectors()
    if name not in presets:
        raise AssetError(f'no infrared detector "{name}"; {did_you_mean(name, list(presets))}')
    return presets[name]
