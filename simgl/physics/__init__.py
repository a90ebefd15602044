"""Formulas and published models as pure functions on numpy arrays; no OpenGL, no scenario.

constants, spectrum            physical constants; bands R, G, B, N and black-body light
frames, times, ephemeris       rotations and poses; time scales; Sun, Moon and the Earth's rotation
solar_disc, eclipse            limb darkening; sunlight past the Earth, its atmosphere and the Moon
atmosphere, skylight, airglow  optical depths; multiple scattering; light of the upper atmosphere
spectral_form, band_air, earth_spectra
                               surfaces, gases, ground and clouds in bands of a scenario
land_reflectance, sea_surface, regolith, lunar_model
                               reflectance of planetary surfaces
starlight, planets             band irradiance and directions of stars; the bright planets
zodiacal_light                 light between the stars
directional_albedo             look-up table of the GGX lobe

Imports ``arrays`` only. A new formula goes to the module of its subject, with its
source in the docstring and a test against a published number in tests/physics.
"""
