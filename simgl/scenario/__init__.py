"""Scenario files: TOML, strict, turned into the pure data that everything else works on."""
