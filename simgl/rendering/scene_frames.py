"""The frames of a scene at an epoch: all products of visible light but electrons and DN."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from simgl.flash_lidar import lidar_frame
from simgl.images import (
    Capture,
    IrradianceFrame,
    LayersFrame,
    LidarFrame,
    NormalsFrame,
    RadianceFrame,
    TruthFrame,
)
from simgl.products import Product
from simgl.rendering.camera_pipeline import CameraPipeline
from simgl.rendering.still_scene import StillScene
from simgl.view.lidar_pulse import pulse_view

_Frame = TypeVar("_Frame")


def scene_frames(
    still: StillScene, pipeline: CameraPipeline, products: frozenset[Product]
) -> Capture:
    """A capture with those of the products; others are left to the camera's electronics.

    pipeline : computes the irradiance of the image plane
    """

    def made(product: Product, make: Callable[[], _Frame]) -> _Frame | None:
        return make() if product in products else None

    return Capture(
        info=still.info,
        radiance=made(Product.RADIANCE, lambda: _radiance(still)),
        layers=made(Product.LAYERS, lambda: _layers(still)),
        truth=made(Product.TRUTH, lambda: _truth(still)),
        normals=made(Product.NORMALS, lambda: _normals(still)),
        irradiance=made(Product.IRRADIANCE, lambda: _irradiance(still, pipeline)),
        lidar=made(Product.LIDAR, lambda: _lidar(still)),
    )


def _radiance(still: StillScene) -> RadianceFrame:
    return RadianceFrame(info=still.info, radiance=still.radiance.read())


def _layers(still: StillScene) -> LayersFrame:
    return LayersFrame(info=still.info, layers=still.renderer.layers(still.view))


def _truth(still: StillScene) -> TruthFrame:
    target, names = still.renderer.truth(still.view), still.state.part_names
    return TruthFrame(
        info=still.info, depth=target.read(0), part_id=target.read(1), part_names=names
    )


def _normals(still: StillScene) -> NormalsFrame:
    target = still.renderer.truth(still.view, normals=True)
    return NormalsFrame(info=still.info, normals=target.read(2)[..., :3])


def _irradiance(still: StillScene, pipeline: CameraPipeline) -> IrradianceFrame:
    target = pipeline.irradiance(still.camera, still.softened, still.sun)
    photons = still.state.sun.photons_per_joule
    return IrradianceFrame(info=still.info, irradiance=target.read(), photons_per_joule=photons)


def _lidar(still: StillScene) -> LidarFrame | None:
    view, state = still.view, still.state
    if view.camera.lidar is None:
        return None
    pulse = pulse_view(view, view.camera.lidar, state, state.cameras[view.camera.name])
    sunlit = still.radiance.read()
    lit = np.zeros_like(sunlit) if pulse is None else still.renderer.layers(pulse)["lamp"]
    depth = still.renderer.truth(view).read(0)
    return lidar_frame(still.info, still.info.seed, depth, lit, sunlit)
