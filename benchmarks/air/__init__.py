"""The air against photons followed one by one, and what it costs."""
