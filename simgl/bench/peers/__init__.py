"""Other renderers on the target of source_600 before a black sky, where they are installed.

``peer_scene``         the scene as plain arrays, and simgl's image of it
``lambertian``         its surfaces, all Lambertian: the law that the renderers share
``run_peers``          each renderer in a process of its own, and the difference of the images
``pyrender_frames``    pyrender: plain, 8 bits, no shadows
``mitsuba_frames``     Mitsuba 3
``cycles_frames``      Cycles by Blender's ``bpy``

The last three are programs: they import no simgl, so that an interpreter with other versions of
its packages can run them. Another renderer is one more such program and a line in ``run_peers``.
"""
