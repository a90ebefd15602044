"""Frames of Mitsuba 3: paths of all bounces, 64 samples a pixel.

python mitsuba_frames.py SCENE.npz FRAMES.npz WIDTH HEIGHT COUNT; knows no simgl.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

SAMPLES = 64
# The compiled variants depend on the machine's LLVM, and some versions of it end the process.
VARIANT = "scalar_rgb"


def _mesh(arrays: Any, index: int, folder: Path) -> dict[str, Any] | None:
    chosen = arrays["triangles"][arrays["material"] == index]
    if not len(chosen):
        return None
    used, corners = np.unique(chosen, return_inverse=True)
    names = ("x", "y", "z", "nx", "ny", "nz")
    vertices = np.concatenate([arrays["positions"][used], arrays["normals"][used]], axis=1)
    faces = np.empty(len(chosen), dtype=np.dtype([("count", "u1"), ("corner", "<i4", 3)]))
    faces["count"], faces["corner"] = 3, corners.reshape(-1, 3)
    properties = "".join(f"property float {name}\n" for name in names)
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(used)}\n{properties}"
        f"element face {len(faces)}\nproperty list uchar int vertex_index\nend_header\n"
    )
    path = folder / f"{index}.ply"
    path.write_bytes(header.encode() + vertices.astype("<f4").tobytes() + faces.tobytes())
    colour = [float(value) for value in arrays["reflectance"][index]]
    diffuse = {"type": "diffuse", "reflectance": {"type": "rgb", "value": colour}}
    return {"type": "ply", "filename": str(path), "bsdf": {"type": "twosided", "bsdf": diffuse}}


def scene_of(mi: Any, arrays: Any, width: int, height: int) -> Any:
    """The same triangles, colours, camera and light."""
    place = arrays["camera_position"]
    scene: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "path"},
        "sun": {
            "type": "directional",
            "direction": [float(-v) for v in arrays["sun_direction"]],
            "irradiance": {"type": "rgb", "value": [1.0, 1.0, 1.0]},
        },
        "sensor": {
            "type": "perspective",
            "fov": float(np.degrees(arrays["fov"])),
            "near_clip": 1.0,
            "to_world": mi.ScalarTransform4f().look_at(
                origin=[float(v) for v in place],
                target=[float(v) for v in place + np.eye(3)[2]],
                up=[0.0, -1.0, 0.0],
            ),
            "film": {
                "type": "hdrfilm",
                "width": width,
                "height": height,
                "pixel_format": "rgb",
                "rfilter": {"type": "box"},
            },
        },
    }
    with tempfile.TemporaryDirectory() as folder:
        for index in range(len(arrays["reflectance"])):
            mesh = _mesh(arrays, index, Path(folder))
            if mesh is not None:
                scene[f"mesh_{index}"] = mesh
        return mi.load_dict(scene)


def main() -> None:
    """Draw frames and write their times and the last image."""
    source, out = sys.argv[1:3]
    width, height, count = (int(word) for word in sys.argv[3:6])
    import mitsuba as mi

    mi.set_variant(VARIANT)
    scene = scene_of(mi, np.load(source), width, height)
    seconds = []
    np.array(mi.render(scene, spp=1))
    for frame in range(count):
        start = time.perf_counter()
        image = np.array(mi.render(scene, spp=SAMPLES, seed=frame))
        seconds.append(time.perf_counter() - start)
    version = f"{mi.__version__} {VARIANT}"
    np.savez(out, seconds=seconds, image=image[..., 1], version=version)


if __name__ == "__main__":
    main()
