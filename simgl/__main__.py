"""``python -m simgl``."""

from simgl.cli import main

if __name__ == "__main__":
    main()
