"""Images, plots and pages for people, from what a capture or a run holds.

``displays``      display images with a scale, and pixel values, of a capture
``maps``          radiance, electrons, DN and depth as PNG files with a scale
``false_colour``  false colours of the lighting study
``heat_map``      temperatures of a spacecraft as images and tables
``style``         style of all plots, light and dark
``html_page``     self-contained pages from templates

May import the simulator and ``output``. A new way to show an image is a branch in
``displays.display``.
"""
