"""The same scene by simgl and by an independent path tracer, pixel by pixel.

scenario -> Lambertian scene -> simgl's picture, the tracer's -> differences, pictures, times
"""
