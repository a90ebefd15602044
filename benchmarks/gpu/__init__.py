"""Measurements on a GPU: what it is, the physics tests on it, frame times and start times."""
