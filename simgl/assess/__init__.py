"""Assessment: how usable images of a target are, and how good a camera model is.

``target_light``, ``target_background``, ``verdict``  one frame: light, background, usable or not
``exposure_advice``                                   the exposure time for a target
``frame_geometry``                                    Sun, Earth and orbit at one epoch
``trajectory_assessment``, ``timeline``               a trajectory: table and summary
``requirement_check``                                 requirements of a scenario against the table
``uncertainty_draws``, ``uncertainty_bands``          Monte Carlo draws, and what they say together
``report``, ``assessment_tables``                     the page for a review, its tables as CSV
``provenance``, ``model_limits``                      who and with what; what is not modelled
``time_plots``, ``orbit_plots``, ``epoch_images``     the figures of the page
``sweep_axes``, ``sweep``, ``sweep_report``           Sun angles and camera settings at one epoch
``assessment_page``                                   what the pages of all of them show
``photon_transfer``, ``emva1288``, ``camera_plots``   a camera tested by EMVA 1288
``infrared_measurement``                              a thermal detector tested: NETD, response
``visible_stars``                                     catalogue stars in an image, as truth

May import the simulator, ``sequence`` (epochs, journal) and ``workers``. A new quantity of a frame
is a field of ``FrameAssessment`` and a column in ``trajectory_assessment.COLUMNS``.
"""
