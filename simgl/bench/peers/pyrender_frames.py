"""Frames of pyrender, plain: 8 bits, one directional light, no shadows.

python pyrender_frames.py SCENE.npz FRAMES.npz WIDTH HEIGHT COUNT; knows no simgl.
"""

from __future__ import annotations

import os
import sys
import time
from typing import Any

import numpy as np

# Without a display; PYOPENGL_PLATFORM=osmesa where there is no EGL.
os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
# pyrender 0.1.45 is older than numpy 2, which dropped the name.
np.infty = np.inf  # type: ignore[attr-defined]

# Sunlight and its exposure: white at normal incidence stays below 255.
_INTENSITY = 2.5
# pyrender writes sRGB by this power, not by sRGB's curve.
_GAMMA = 2.2


def scene_of(pyrender: Any, arrays: Any, width: int, height: int) -> Any:
    """The same triangles, colours, camera and light."""
    scene = pyrender.Scene(bg_color=np.zeros(4), ambient_light=np.zeros(3))
    for index, reflectance in enumerate(arrays["reflectance"]):
        chosen = arrays["triangles"][arrays["material"] == index]
        if not len(chosen):
            continue
        used, corners = np.unique(chosen, return_inverse=True)
        primitive = pyrender.Primitive(
            positions=arrays["positions"][used],
            normals=arrays["normals"][used],
            indices=corners.reshape(-1, 3),
            material=pyrender.MetallicRoughnessMaterial(
                baseColorFactor=[*reflectance, 1.0],
                metallicFactor=0.0,
                roughnessFactor=1.0,
                doubleSided=True,
            ),
            mode=4,
        )
        scene.add(pyrender.Mesh([primitive]))
    # OpenGL's camera looks along -z, with y up.
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[:3, 3] = arrays["camera_position"]
    aspect = width / height
    camera = pyrender.PerspectiveCamera(
        yfov=2.0 * np.arctan(np.tan(0.5 * float(arrays["fov"])) / aspect),
        aspectRatio=aspect,
        znear=1.0,
        zfar=1e3,
    )
    scene.add(camera, pose=pose)
    scene.add(
        pyrender.DirectionalLight(color=np.ones(3), intensity=_INTENSITY),
        pose=_towards(arrays["sun_direction"]),
    )
    return scene


def _towards(z_axis: Any) -> Any:
    """The pose of a light that shines along its -z."""
    x_axis = np.cross([0.0, 1.0, 0.0] if abs(z_axis[1]) < 0.9 else [1.0, 0.0, 0.0], z_axis)
    x_axis /= np.linalg.norm(x_axis)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x_axis, np.cross(z_axis, x_axis), z_axis], axis=1)
    return pose


def main() -> None:
    """Draw frames and write their times and the last image."""
    source, out = sys.argv[1:3]
    width, height, count = (int(word) for word in sys.argv[3:6])
    import pyrender

    scene = scene_of(pyrender, np.load(source), width, height)
    renderer = pyrender.OffscreenRenderer(width, height)
    seconds = []
    renderer.render(scene)
    for _ in range(count):
        start = time.perf_counter()
        colour, _ = renderer.render(scene)
        seconds.append(time.perf_counter() - start)
    renderer.delete()
    image = (colour[..., 1] / 255.0) ** _GAMMA
    np.savez(out, seconds=seconds, image=image, version=pyrender.__version__)


if __name__ == "__main__":
    main()
