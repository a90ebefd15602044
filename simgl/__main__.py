"""``python -m simgl``."""

from simgl.cli import main

main()
