"""Models in the bands of a scenario: files give surfaces in R, G, B, N or as curves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from simgl.arrays import Array
from simgl.physics.spectral_form import scaled
from simgl.physics.spectrum import BANDS, CHANNELS, Bands, PerBand, channels
from simgl.scene.materials import Material
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.textures import Image


def model_in_bands(model: SpacecraftModel, bands: Bands, temperature: float) -> SpacecraftModel:
    """A model whose reflectances and emission are those of the bands.

    model : in the bands R, G, B, N
    temperature : of the sunlight that weights the wavelengths [K]

    Curves are averaged, finishes follow the form of their spectra, other numbers hold all over
    their band (``Bands.of_rgbn``). Images and
    vertex colours have three channels; a fourth band follows those of the first, as N does red.
    """
    if bands == BANDS:
        return model
    # How much of each band is of R, G, B, N; an image's N is its red.
    shares = np.array([bands.of_rgbn(one, temperature) for one in np.eye(CHANNELS).tolist()]).T
    from_rgb = shares[:3, :3].copy()
    from_rgb[:, 0] += shares[:3, 3]
    colour = model.mesh.colour
    if colour is not None:
        coloured = np.concatenate([colour[:, :3] @ from_rgb.T, colour[:, 3:]], axis=1)
        colour = coloured.astype(np.float32)
    textures = model.textures
    return replace(
        model,
        mesh=model.mesh if colour is None else replace(model.mesh, colour=colour),
        materials=tuple(_material(one, bands, temperature) for one in model.materials),
        textures=replace(
            textures,
            base_colour=tuple(_image(one, from_rgb) for one in textures.base_colour),
            emission=tuple(_image(one, from_rgb) for one in textures.emission),
        ),
    )


def _material(material: Material, bands: Bands, temperature: float) -> Material:
    cells = material.cells
    if cells is not None:
        cells = replace(
            cells,
            gap_reflectance=bands.of_rgbn(cells.gap_reflectance, temperature),
            metal_reflectance=bands.of_rgbn(cells.metal_reflectance, temperature),
        )
    return replace(
        material,
        reflectance=_reflectance(material, bands, temperature),
        emission=bands.power_of_rgbn(material.emission),
        cells=cells,
    )


def _reflectance(material: Material, bands: Bands, temperature: float) -> PerBand:
    if material.spectrum is not None:
        return bands.photon_mean_of(material.spectrum, temperature)
    form = material.form
    if form is None:
        return bands.of_rgbn(material.reflectance, temperature)
    return channels(
        np.clip(scaled(material.reflectance, lambda nm: np.interp(nm, *form), bands), 0.0, 1.0)
    )


def _image(image: Image, from_rgb: Array) -> Image:
    values: NDArray[np.float16] = image.values.copy()
    values[..., :3] = image.values[..., :3].astype(np.float32) @ from_rgb.T.astype(np.float32)
    return replace(image, values=values)
