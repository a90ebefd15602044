"""The receiver of a flash LIDAR: from the returned light of a pulse to electrons and ranges."""

from __future__ import annotations

import zlib

import numpy as np
from numpy.random import Generator, Philox

from simgl.arrays import Array32
from simgl.camera.camera_equation import irradiance_per_radiance
from simgl.camera.distortion import relative_illumination, sight_lines
from simgl.camera.lidar import detected
from simgl.images import FrameInfo, LidarFrame


def lidar_frame(
    info: FrameInfo, seed: int, depth: Array32, pulse: Array32, sunlit: Array32
) -> LidarFrame:
    """The frame of one pulse, without the point spread of the lens.

    seed : with camera name, epoch and draw determines the noise
    depth : (height, width) along the boresight [m], 0 for no spacecraft
    pulse : (height, width, 4) radiance of the returned pulse, integrated over time [J m-2 sr-1]
    sunlit : (height, width, 4) radiance of the scene without the pulse [W m-2 sr-1]
    """
    camera, lidar = info.camera, info.camera.lidar
    assert lidar is not None
    band = lidar.band
    area = camera.detector.pixel_pitch**2 * irradiance_per_radiance(camera)[band]
    collected = area * relative_illumination(camera).astype(np.float64)
    energy = pulse[..., band] * collected
    sunlight = sunlit[..., band] * collected * lidar.filter_share * lidar.gate
    lines = np.nan_to_num(sight_lines(camera))
    seen = depth != 0.0
    along = np.divide(depth, lines[..., 2], out=np.zeros(depth.shape), where=seen)
    places = lines * along[..., None]
    out = np.linalg.norm(places - np.array(lidar.offset), axis=-1)
    distance = np.where(seen, 0.5 * (out + along), 0.0)
    # 128 bits of key, unique for each epoch; the draw is the counter's highest word.
    key = np.array(
        [(seed << 32) | zlib.crc32(camera.name.encode()), info.epoch_tai_ns], dtype=np.uint64
    )
    rng = Generator(Philox(key=key, counter=[0, 0, 0, info.draw]))
    # Far beyond any full well; keeps the Poisson counts exact.
    per_joule = lidar.electrons_per_joule
    signal, background = (np.minimum(e * per_joule, 1e9) for e in (energy, sunlight))
    ranges, counted = detected(lidar, distance, signal, background, rng)
    return LidarFrame(
        info=info,
        range=ranges.astype(np.float32),
        electrons=counted.astype(np.float32),
        energy=energy.astype(np.float32),
    )
