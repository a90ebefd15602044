"""Frames of Cycles by Blender's ``bpy``: 128 samples a pixel, no denoising.

python cycles_frames.py SCENE.npz FRAMES.npz WIDTH HEIGHT COUNT; knows no simgl.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

SAMPLES = 128


def _add_mesh(bpy: Any, arrays: Any) -> None:
    mesh = bpy.data.meshes.new("target")
    mesh.from_pydata(arrays["positions"].tolist(), [], arrays["triangles"].tolist())
    mesh.polygons.foreach_set("material_index", arrays["material"])
    mesh.polygons.foreach_set("use_smooth", np.ones(len(arrays["triangles"]), dtype=bool))
    mesh.normals_split_custom_set_from_vertices(arrays["normals"].tolist())
    for index, reflectance in enumerate(arrays["reflectance"]):
        material = bpy.data.materials.new(str(index))
        material.use_nodes = True
        nodes = material.node_tree.nodes
        nodes.clear()
        diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
        diffuse.inputs["Color"].default_value = (*reflectance.tolist(), 1.0)
        material.node_tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
        mesh.materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("target", mesh))


def _add_sun_and_camera(bpy: Any, arrays: Any) -> None:
    from mathutils import Matrix, Vector

    scene = bpy.context.scene
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = 1.0, float(arrays["sun_angle"])
    sun = bpy.data.objects.new("Sun", light)
    # It shines along its -z.
    sun.rotation_mode = "QUATERNION"
    sun.rotation_quaternion = Vector(arrays["sun_direction"].tolist()).to_track_quat("Z", "Y")
    scene.collection.objects.link(sun)
    lens = bpy.data.cameras.new("camera")
    lens.sensor_fit, lens.angle = "HORIZONTAL", float(arrays["fov"])
    lens.clip_start, lens.clip_end = 1.0, 1e3
    camera = bpy.data.objects.new("camera", lens)
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[:3, 3] = arrays["camera_position"]
    camera.matrix_world = Matrix(pose.tolist())
    scene.collection.objects.link(camera)
    scene.camera = camera


def _configure(bpy: Any, width: int, height: int) -> None:
    scene = bpy.context.scene
    # A world of its own would add grey light.
    scene.world = None
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.pixel_filter_type = "BOX"
    # The scene stays in the renderer from frame to frame, as in the others.
    scene.render.use_persistent_data = True
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"


def _render(bpy: Any, path: Path, samples: int) -> float:
    """Seconds of one frame, in a file."""
    bpy.context.scene.cycles.samples = samples
    bpy.context.scene.render.filepath = str(path)
    start = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    return time.perf_counter() - start


def main() -> None:
    """Draw frames and write their times and the last image."""
    source, out = sys.argv[1:3]
    width, height, count = (int(word) for word in sys.argv[3:6])
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    arrays = np.load(source)
    _add_mesh(bpy, arrays)
    _add_sun_and_camera(bpy, arrays)
    _configure(bpy, width, height)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "frame.exr")
        _render(bpy, path, 1)
        seconds = [_render(bpy, path, SAMPLES) for _ in range(count)]
        loaded = bpy.data.images.load(str(path))
        pixels = np.array(loaded.pixels[:]).reshape(height, width, -1)
    # Blender's rows go up.
    image = pixels[::-1, :, 1]
    np.savez(out, seconds=seconds, image=image, version=bpy.app.version_string)


if __name__ == "__main__":
    main()
