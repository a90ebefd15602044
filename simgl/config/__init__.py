"""Strict reading of TOML and YAML files, whatever they describe.

validation     TOML text to msgspec tables; errors that name file, table, key and value
yaml_files     YAML text to tables, lists and texts
value_types    base class of all tables, value types with limits, band values and directions
curve_files    curves over wavelength in CSV files
path_sandbox   base folders of relative paths, restricted for scenarios that clients send

Imports ``physics`` and lower layers. The tables themselves are next to what they describe
(simgl/scenario, simgl/camera, simgl/model_files); a value type that several of them need goes here.
"""
