"""Temperatures of spacecraft: a thermal network of the patches of a mesh, lit by the scene.

``body`` makes the ``network`` of a model (nodes: its patches, one for the structure of each part,
``inner_nodes``) from ``view_factors``; ``heat_loads`` has the light that a scene sends to it, that
of the Earth by ``sky_light``, which the renderer draws; ``history`` steps it along a trajectory,
``scene_temperatures`` all spacecraft of a scene. ``thermal_view`` is what a thermal camera sees of
them, ``infrared_surroundings`` Earth and space in any band, which passes then draw. Nothing of it
imports OpenGL. May import ``radiosity``, ``scenario`` and what lies below. A new source of heat
belongs into ``heat_loads``, a new path between nodes into ``body``.
"""
