"""A window on a scenario: the pipeline's own radiance, a free camera, and one display step.

    Look (what the user chose)  ->  viewer_state  ->  frame_view  ->  Renderer.radiance
                                                        -> DisplayPass -> window

Everything up to the window is pure functions of frozen ``ViewSettings``; keys and mouse replace
them.
"""
