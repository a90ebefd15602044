"""What a scene consists of, as frozen data in SI units; no graphics, no files of scenarios.

state             SceneState: everything that an image depends on, at one instant
spacecraft, mesh  SpacecraftModel and its triangles, primitives, moved joints
smooth_surfaces   pieces of a mesh that a pixel may average
materials, surface_layers, textures, mean_materials   surfaces
band_materials    models in the bands of a scenario
lamps             spot lights and their irradiance
lamp_response     the lamps as the pixels of a detector respond to their spectra
earth             the Earth's shape, maps, clouds, atmosphere
star_catalogue    the shipped Hipparcos stars
noise_volume, noise_projection, cyclones   procedural detail of ground and clouds

May import camera, motion, physics and below. A new kind of object is described here, read in
simgl.scenario or simgl.model_files, and drawn by a pass.
"""
