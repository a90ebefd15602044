"""A model file by itself: what is in it, and how it looks from all sides."""
