"""Spacecraft models from files and arrays.

model_library   load_model: shipped models, model cards (TOML), glTF, OBJ, STL; units and axes
model_from_mesh  models from vertices and triangles in memory
gltf_schema -> gltf_file -> gltf_images -> gltf_materials -> gltf_model   glTF 2.0, read strictly
joint_tables    the [[joint]] tables of a model card
surface_tables  materials, finishes and calibration shapes as tables

May import config, motion and scene; not scenario. A new file format is a module here and a suffix
in model_library.
"""
