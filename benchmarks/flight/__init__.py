"""Earth and Moon against flight data: ``python -m benchmarks.flight``."""
