"""Frames of one scene in this process, or in workers on this and other machines."""
