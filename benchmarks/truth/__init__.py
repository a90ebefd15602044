"""Truth tables: what light and camera have to show, what simgl shows, and the error's goal."""
