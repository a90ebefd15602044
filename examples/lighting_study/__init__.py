"""The lighting study's cases beside what it published; writes docs/lighting_study.md."""
