"""What a capture can contain, and what of it a camera has."""

from __future__ import annotations

from collections.abc import Collection
from enum import StrEnum

from simgl.camera.camera import Camera
from simgl.errors import ConfigError


class Product(StrEnum):
    """What a capture can contain; each is a field of ``Capture`` of that name, DN is ``digital``.

    >>> simgl.Product("radiance") is simgl.Product.RADIANCE
    True
    """

    DN = "dn"
    ELECTRONS = "electrons"
    RADIANCE = "radiance"
    LAYERS = "layers"
    IRRADIANCE = "irradiance"
    TRUTH = "truth"
    NORMALS = "normals"
    LIDAR = "lidar"
    THERMAL = "thermal"


ALL_PRODUCTS = frozenset(Product)
# Of cameras that see thermal radiation.
THERMAL_PRODUCTS = frozenset({Product.DN, Product.THERMAL, Product.TRUTH, Product.NORMALS})


def products_of(camera: Camera) -> frozenset[Product]:
    """What a capture of a camera may contain."""
    return ALL_PRODUCTS - {Product.THERMAL} if camera.thermal is None else THERMAL_PRODUCTS


def check_products(camera: Camera, products: Collection[Product], scenario: str) -> None:
    """Raise ConfigError for a product that a thermal camera has not; of others it is left out."""
    if camera.thermal is None:
        return
    for product in sorted(set(products) - THERMAL_PRODUCTS):
        has = ", ".join(sorted(THERMAL_PRODUCTS))
        problem = f"sees thermal radiation: it has {has}, not {product}"
        raise ConfigError(scenario, f'camera "{camera.name}"', problem)
