"""Passes behind the spacecraft: Earth with its air, Sun, Moon, stars.

``planet`` draws the Earth: ``earth_maps`` and ``cloud_map`` make its maps, ``map_levels`` their
halvings, ``earth_textures`` holds them on the GPU, ``planet_blocks`` packs its uniforms,
``tile_kinds`` and ``planet_variants`` choose its programs, which ``planet_programs`` holds.
``air`` has the look-up tables of the views, which ``air_march`` draws, ``air_tables`` those of the
atmosphere, ``earth_air`` their sums.
``sun``, ``moon`` (both with ``discs``), ``stars`` and ``diffuse_sky`` draw what lies beyond.
``environment_probe`` stores the sky around each spacecraft.
"""
