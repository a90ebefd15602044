"""The Earth against what satellites and earthshine measured: ``python -m benchmarks.flight``."""
