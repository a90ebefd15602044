"""The surface finishes of the shipped models, by name.

Reflectances are round figures for each class of finish at normal incidence, meant to give every
surface a plausible place between black ceramic and white paint. They are not measurements of any
flown vehicle.
"""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Material:
    """A finish in the metallic-roughness model.

    rgb : reflectance in 600-700, 500-600 and 400-500 nm; nir : in 700-1000 nm
    metallic : 1 where the reflectance is that of a bare metal, else 0
    roughness : perceptual roughness, the square root of the microfacet width
    finish : of simgl/data/finishes.toml, which simgl draws instead; the rest is for other readers
        of the file
    """

    rgb: tuple[float, float, float]
    nir: float
    metallic: float
    roughness: float
    finish: str | None = None


def _painted(
    red: float, green: float, blue: float, nir: float, roughness: float, finish: str | None = None
) -> Material:
    rgb = (red, green, blue)
    return Material(rgb=rgb, nir=nir, metallic=0.0, roughness=roughness, finish=finish)


def _metal(
    red: float, green: float, blue: float, nir: float, roughness: float, finish: str | None = None
) -> Material:
    rgb = (red, green, blue)
    return Material(rgb=rgb, nir=nir, metallic=1.0, roughness=roughness, finish=finish)


def _grey(reflectance: float, finish: str) -> Material:
    """Diffuse, the same in all bands."""
    return _painted(reflectance, reflectance, reflectance, reflectance, 1.0, finish)


# Reflectances of the diffuse steps of the calibration board, each a finish [%].
GREY_STEPS = (2, 5, 9, 12, 18, 25, 36, 45, 60, 75, 90, 99)

MATERIALS = {
    "ceramic_black": _painted(0.050, 0.049, 0.050, 0.07, 0.70),
    "ceramic_black_worn": _painted(0.075, 0.072, 0.070, 0.10, 0.75),
    "ceramic_grey": _painted(0.19, 0.19, 0.19, 0.22, 0.75),
    "felt_white": _painted(0.72, 0.71, 0.68, 0.74, 0.90),
    "felt_white_worn": _painted(0.64, 0.63, 0.60, 0.68, 0.90),
    "felt_grey": _painted(0.42, 0.42, 0.41, 0.46, 0.90),
    "tile_gap": _painted(0.11, 0.11, 0.11, 0.13, 0.90),
    "white_paint": _painted(0.80, 0.80, 0.78, 0.78, 0.60),
    "grey_paint": _painted(0.36, 0.37, 0.38, 0.40, 0.60),
    "black_paint": _painted(0.030, 0.030, 0.032, 0.04, 0.60),
    "beta_cloth": _painted(0.78, 0.78, 0.76, 0.74, 0.85),
    "gold_foil": _metal(0.76, 0.56, 0.16, 0.80, 0.50, "mli_gold"),
    "silver_foil": _metal(0.88, 0.89, 0.89, 0.84, 0.42, "mli_silver"),
    "aluminium": _metal(0.86, 0.87, 0.88, 0.86, 0.45),
    "anodised_dark": _metal(0.22, 0.22, 0.24, 0.28, 0.45),
    "titanium": _metal(0.54, 0.50, 0.45, 0.60, 0.40),
    "nozzle_inside": _metal(0.20, 0.18, 0.17, 0.26, 0.60),
    "solar_cell": _painted(0.034, 0.036, 0.056, 0.07, 0.20, "cell_under_glass"),
    "panel_grid": _painted(0.70, 0.71, 0.72, 0.70, 0.45),
    "lens_glass": _painted(0.015, 0.018, 0.030, 0.02, 0.06),
    "circuit_green": _painted(0.06, 0.16, 0.08, 0.30, 0.55),
    "signal_red": _painted(0.48, 0.06, 0.04, 0.52, 0.60),
    "kapton": _painted(0.50, 0.32, 0.10, 0.56, 0.45),
    "blanket_seam": _painted(0.22, 0.17, 0.10, 0.25, 0.50),
    "radiator_white": _painted(0.88, 0.88, 0.84, 0.87, 0.90, "white_paint"),
    "target_black": _painted(0.035, 0.035, 0.035, 0.04, 0.60, "black_paint"),
    "aluminium_machined": _metal(0.82, 0.83, 0.83, 0.79, 0.45, "bare_aluminium"),
    "mirror": _metal(0.96, 0.96, 0.94, 0.96, 0.01, "mirror"),
    "soot": _painted(0.045, 0.042, 0.040, 0.05, 0.95),
    "paint_scorched": _painted(0.36, 0.31, 0.26, 0.40, 0.85),
    "paint_aged": _painted(0.66, 0.64, 0.58, 0.68, 0.75),
    **{
        f"lambert_{percent:02d}": _grey(percent / 100.0, f"lambert_{percent:02d}")
        for percent in GREY_STEPS
    },
}
