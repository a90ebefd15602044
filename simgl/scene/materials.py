"""Surface materials: band reflectances and the parameters of the reflection law."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite

from simgl.physics.spectrum import CHANNELS, Curve
from simgl.scene.surface_layers import SMOOTHEST, Bands, Cells, Coat, Crinkle
from simgl.scene.textures import Maps
from simgl.scene.thermal_surface import ThermalSurface

# Of one model, with the default for surfaces without one: those of a uniform block.
MAX_MATERIALS = 64


@dataclass(frozen=True, kw_only=True)
class Material:
    """A metallic-roughness surface, or a Lambertian one where ``roughness`` is None.

    name : in error messages and tables
    reflectance : base colour per band, 0..1
    spectrum : of a measured material, from which the reflectance was averaged [nm]
    form : spectrum of a finish's kind, which is scaled to the reflectance in R, G, B, N [nm]
    metallic : 0 dielectric (diffuse base under a 4 % specular), 1 metal (reflectance is F0)
    roughness : perceptual roughness, alpha = roughness^2; None means purely Lambertian
    emission : emitted radiance, the same in all directions [W m-2 sr-1]
    coverage : 0..1, factor of the alpha of image and vertex colours
    cutoff : no surface where that product is less; None for a surface without cut-outs
    maps : images that multiply reflectance, metallic, roughness and emission or tilt the normal;
        the near infrared follows an image's red
    conserving : adds multiple scattering between microfacets; False is the model of glTF, whose
        lobe gets darker with roughness
    coat, cells, crinkle : layers on or in the surface
    thermal : absorptance, emissivity and skin; None where they are estimated from the above
    """

    name: str
    reflectance: Bands
    metallic: float = 0.0
    roughness: float | None = None
    emission: Bands = (0.0, 0.0, 0.0, 0.0)
    coverage: float = 1.0
    cutoff: float | None = None
    maps: Maps = field(default_factory=Maps)
    conserving: bool = False
    # Its effect is in the reflectance.
    spectrum: Curve | None = field(default=None, compare=False, repr=False)
    form: Curve | None = field(default=None, compare=False, repr=False)
    coat: Coat | None = None
    cells: Cells | None = None
    crinkle: Crinkle | None = None
    # Visible images do not depend on it.
    thermal: ThermalSurface | None = field(default=None, compare=False)

    @property
    def layered(self) -> bool:
        """Whether it has more than one uniform reflection lobe."""
        layers = self.coat, self.cells, self.crinkle
        return self.conserving or any(layer is not None for layer in layers)

    def __post_init__(self) -> None:
        if len(self.reflectance) != CHANNELS:
            problem = f"reflectance has {CHANNELS} bands, got {len(self.reflectance)}"
            raise ValueError(f'material "{self.name}": {problem}')
        for value in (*self.reflectance, self.metallic):
            if not 0.0 <= value <= 1.0:
                raise ValueError(
                    f'material "{self.name}": reflectance and metallic lie in 0..1, got {value:g}'
                )
        if self.roughness is not None and not SMOOTHEST <= self.roughness <= 1.0:
            raise ValueError(
                f'material "{self.name}": roughness lies in {SMOOTHEST:g}..1, '
                f"got {self.roughness:g}"
            )
        for value in self.emission:
            if not (value >= 0.0 and isfinite(value)):
                raise ValueError(
                    f'material "{self.name}": emission must be 0 or more, got {value:g}'
                )
