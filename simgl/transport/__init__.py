"""Light between the surfaces of one spacecraft: baked once with a ray tracer, solved per frame.

mesh -> subdivided mesh -> sites and patches -> rays -> Transport (a file in the cache)
Transport, Sun, Earth, lamps -> radiosity of the patches -> irradiance of the vertices
"""
