"""A window on a scenario: images of its cameras and of a free one, with what is to be read of them.

    keys, mouse -> ViewSettings -> chosen_state -> Simulator.capture -> Panel -> WindowPainter

``subject``         what a window shows, and who answers its keys: the interface of two of these
``view_settings``   what the user chose to see, as a frozen value
``view_commands``   the keys that change it, and what the window says of each change
``orbit_camera``    the camera that circles a spacecraft
``viewport``        a scenario as a subject: settings, captures, shaders loaded again
``followed``        the previews of a running server as a subject
``read_outs``       lines about an image and about a pixel
``shader_watch``    notices changed shader files
``overlay_boxes``   text, histogram and scale bar as small pictures
``overlay``         where boxes lie; their textures
``window_painter``  draws images and boxes
``window_session``  GLFW's events, saved images, videos
``window``          opens the window
``idle_priority``   scheduling that leaves the processor to everything else

May import the simulator, ``cli_progress``, ``output`` and ``video``. A new key is a line in
``view_commands.COMMANDS``, a new way to show an image a line in ``view_settings.CAMERA_VIEWS``.
"""
