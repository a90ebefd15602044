"""Everything about a camera: description, presets, and the parts of its model that run on the CPU.

camera, lens, detector, lidar, event_sensor
                                cameras as data; units SI
presets, *_schema, *_tables     preset files and ``[camera.NAME]`` tables, read into that data
spectral_response               response over wavelength; light of other spectra than sunlight
projections                     where a lens images a ray: pinhole, fisheye, double sphere
calibration                     files of OpenCV, ROS and Kalibr, read and written
event_pixels                    from photo-current to the events of an event camera
infrared_detector               thermal detectors: bolometers and photon detectors, radiance to DN
camera_equation                 radiance to irradiance and electrons; exposure values
chebyshev                       polynomials through values at Chebyshev nodes
distortion                      pinhole field of view behind a distorting lens; fall-off
diffraction, psf_kernel, convolution, ghosts, point_spread
                                point spread function, stray light and ghosts of a lens
image_margin                    how far beyond the image such a lens sees light
row_curve                       row on which a line of sight ends behind such a lens
rolling_shutter, noise_streams, blooming, particle_hits, demosaic
                                row timing, random numbers, charge effects, colour images from DN

Imports ``config``, ``motion`` and lower layers. The GPU parts are simgl/passes/optics, spread,
compute_spread, exposure and readout. A new effect gets its key in a schema, its field in lens or
detector, and its formula here or in the pass.
"""
