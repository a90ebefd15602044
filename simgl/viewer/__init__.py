"""A window on a scenario: the renderer's radiance, a free camera, and one display step.

    ViewSettings -> viewer_state -> frame_view -> Renderer.radiance -> DisplayPass -> window

``view_settings``  what the user chose to see, as a frozen value, and the keys that change it
``orbit_camera``   the camera that circles a spacecraft
``viewport``       from settings to the pixels of a window
``window``         GLFW: events replace the settings, frames follow them

May import the renderer, ``cli_progress`` and ``output``. A new key is a line in
``view_settings.COMMANDS``.
"""
