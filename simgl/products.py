"""The products of a capture, and which of them a camera has."""

from __future__ import annotations

from collections.abc import Collection
from enum import StrEnum

from simgl.camera.camera import Camera
from simgl.errors import ConfigError
from simgl.value_checks import check_choice


class Product(StrEnum):
    """The forms of an image; the field of ``Capture`` has the same name, for DN ``digital``.

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
# Products of thermal cameras.
THERMAL_PRODUCTS = frozenset({Product.DN, Product.THERMAL, Product.TRUTH, Product.NORMALS})


def products_of(camera: Camera) -> frozenset[Product]:
    """The products that a camera has."""
    return ALL_PRODUCTS - {Product.THERMAL} if camera.thermal is None else THERMAL_PRODUCTS


def check_products(camera: Camera, products: Collection[Product], scenario: str) -> None:
    """Raise ConfigError for products that a thermal camera does not have, and ValueError for what
    is no product.

    Other cameras omit the products that they do not have.
    """
    # The letters of a text would be taken for products, too.
    for product in [products] if isinstance(products, str) else products:
        check_choice("products", product, ALL_PRODUCTS)
    if isinstance(products, str):
        raise ValueError(f"products must be a collection, such as {{Product.DN}}, got {products!r}")
    if camera.thermal is None:
        return
    for product in sorted(set(products) - THERMAL_PRODUCTS):
        has = ", ".join(sorted(THERMAL_PRODUCTS))
        problem = f"sees thermal radiation: it has {has}, not {product}"
        raise ConfigError(scenario, f'camera "{camera.name}"', problem)
