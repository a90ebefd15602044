"""Ordered passes, from a view of the scene to images.

``renderer``           from a view to radiance and truth
``exposure_renderer``  the same of a moving scene, over an exposure
``thermal_renderer``   the same of a thermal camera
``sky_renderer``       environment of a spacecraft
``camera_pipeline``    from radiance to DN
``still_scene``        the scene of one camera, at one instant or over an exposure
``scene_frames``       frames of a scene at an epoch: radiance, layers, truth, LIDAR
``thermal_frames``     frames of a thermal camera: radiance, temperature, DN
``image_sizes``        whether the driver can draw a camera's images
``spacecraft_skies``   sky radiation as heat load of spacecraft
``first_image``        tables, maps, light and shaders that the first image needs

May import ``passes`` and what is below.
"""
