"""Images for a screen: 8-bit sRGB of linear values, DN or radiance; contact sheets, PNG."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from simgl.arrays import Array32, Image8, Image16
from simgl.camera.camera import Camera
from simgl.camera.demosaic import develop
from simgl.display_colours import in_strips, shown_channels, srgb_from_bands, white_radiance
from simgl.physics.constants import SOLAR_CONSTANT, SOLAR_TEMPERATURE
from simgl.physics.spectrum import BANDS, Bands, black_body_light

# Reference of the white balance, R G B N.
WHITE_PHOTONS = black_body_light(SOLAR_CONSTANT, SOLAR_TEMPERATURE).photon_irradiance


def srgb_from_linear(linear: Array32) -> Image8:
    """8-bit sRGB code values of linear light 0..1 (IEC 61966-2-1); brighter saturates."""
    x = np.clip(linear, 0.0, 1.0)
    encoded = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1.0 / 2.4) - 0.055)
    return np.round(255.0 * encoded).astype(np.uint8)


def display_from_linear(linear: Array32) -> Image8:
    """(height, width, 3) grey sRGB image of a linear value 0..1."""
    return np.repeat(srgb_from_linear(linear)[..., None], 3, axis=2)


def display_from_dn(dn: Image16, camera: Camera, gain: float = 1.0) -> Image8:
    """(height, width, 3) sRGB image of digital numbers, pedestal black, full scale white.

    Grey without colour filters or of bands other than R, G, B, N; else sunlit white is neutral.

    dn : (height, width) digital numbers of the camera
    camera : that gave them
    gain : factor of the brightness
    """
    detector = camera.detector
    if detector.mosaic is not None and detector.bands == BANDS:
        return srgb_from_linear(develop(dn, detector, WHITE_PHOTONS, gain))
    # There are fewer values than pixels.
    values = np.arange(int(dn.max(initial=0)) + 1, dtype=np.uint16)
    grey = replace(detector, mosaic=None)
    return srgb_from_linear(develop(values[None], grey, WHITE_PHOTONS, gain))[0].take(dn, axis=0)


def display_from_radiance(radiance: Array32, gain: float = 1.0, bands: Bands = BANDS) -> Image8:
    """(height, width, 3) sRGB image of the bands R, G, B in natural colours.

    Other bands: the first three as red, green and blue; a single band as grey.
    White is a white surface that faces the Sun at 1 au, so that images are comparable.

    radiance : (height, width, 4) [W m-2 sr-1]
    gain : factor of the brightness
    bands : of the channels
    """
    factor = np.float32(gain) / white_radiance(bands)
    shown, to_srgb = shown_channels(bands), srgb_from_bands(bands).T
    return in_strips(lambda part: srgb_from_linear(part[..., shown] * factor @ to_srgb), radiance)


def display_gain(radiance: Array32, bands: Bands = BANDS) -> float:
    """Largest power of two that saturates at most 1 % of the lit pixels; 1 for a black image.

    radiance : (height, width, 4) [W m-2 sr-1]
    bands : of the channels
    """
    brightest = (radiance[..., shown_channels(bands)] / white_radiance(bands)).max(axis=-1)
    lit = brightest[brightest > 0.0]
    return 2.0 ** -math.ceil(math.log2(float(np.percentile(lit, 99.0)))) if lit.size else 1.0


def contact_sheet(panels: Mapping[str, Image8], columns: int) -> Image8:
    """(H, W, 3) sRGB image: images of one size on a grid, each below its name.

    panels : name to (height, width, 3) sRGB image
    columns : images side by side
    """
    height, width = next(iter(panels.values())).shape[:2]
    line = max(11, width // 20)
    font = ImageFont.load_default(size=0.7 * line)
    rows = -(-len(panels) // columns)
    sheet = Image.new("RGB", (columns * width, rows * (height + line)), "white")
    pen = ImageDraw.Draw(sheet)
    for index, (name, image) in enumerate(panels.items()):
        x, y = index % columns * width, index // columns * (height + line)
        pen.text((x + line // 4, y + line // 2), name, fill="black", font=font, anchor="lm")
        sheet.paste(Image.fromarray(image), (x, y + line))
    return np.asarray(sheet)


def png_bytes(image: Image8) -> bytes:
    """An 8-bit image as PNG."""
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, format="PNG")
    return buffer.getvalue()
