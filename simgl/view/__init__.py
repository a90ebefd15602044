"""Views: the float64 scene of one instant, as float32 values relative to one camera.

``frame_view`` makes the ``FrameView`` of a camera: ``spacecraft_view`` (with ``near_spacecraft``),
``raster_tiles`` that draw them in ``depth_slices`` (but for ``empty_slices``), with
``small_targets`` for what is far away, ``shadow_views``, ``lamp_views`` and ``aerial_perspective``
for each spacecraft, ``background`` (with ``celestial`` and ``background_tiles``) for what lies
behind. ``lidar_pulse`` is the view of a flash lidar, ``image_motion`` and ``motion_in_view`` say
how far things move in an image, ``exposure_parts`` what is then drawn over its exposure,
``snapshot_count`` (with ``turned_faces``) how often, ``exposure_views`` in which layers,
``image_paths`` how these move, ``light_spread`` how light on them changes. ``thermal_exposure`` is
that of thermal detectors, and ``row_clock`` says where spacecraft are at their rows' own times.

A view is plain data without OpenGL. It imports scene, physics, camera and radiosity; passes import
it. What depends on the camera and is the same for all pixels belongs here.
"""
