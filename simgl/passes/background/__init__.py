"""Passes behind the spacecraft: Earth with its air, Sun, Moon, stars.

``planet`` draws the Earth: ``earth_maps`` and ``cloud_map`` make its maps, ``earth_textures``
holds them on the GPU, ``planet_blocks`` packs its uniforms, ``tile_kinds`` chooses its programs.
``air`` has the look-up tables of the views, ``air_tables`` those of the atmosphere. ``sun``,
``moon`` (both with ``discs``), ``stars`` and ``diffuse_sky`` draw what lies beyond.
``environment_probe`` stores the sky around each spacecraft.
"""
