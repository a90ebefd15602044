"""Surface materials: band reflectances and the parameters of the reflection law."""

from __future__ import annotations

from dataclasses import dataclass

# On a smoother surface a point Sun has a highlight narrower than a float resolves.
SMOOTHEST = 0.01


@dataclass(frozen=True, kw_only=True)
class Material:
    """A metallic-roughness surface, or a Lambertian one where ``roughness`` is None.

    reflectance : base colour per band R, G, B, N, 0..1
    metallic : 0 dielectric (diffuse base under a 4 % specular), 1 metal (reflectance is F0)
    roughness : perceptual roughness, alpha = roughness^2; None means purely Lambertian
    """

    name: str
    reflectance: tuple[float, float, float, float]
    metallic: float = 0.0
    roughness: float | None = None

    def __post_init__(self) -> None:
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
