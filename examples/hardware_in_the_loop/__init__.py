"""Images on a screen before a real camera, in real time.

``frame_clock``   when each frame is due by the wall clock, and what came late
``pixel_map``     from radiance to the pixels of the screen
``full_screen``   the screen, by GLFW
``__main__``      ``python -m examples.hardware_in_the_loop SCENARIO --camera NAME``
"""
