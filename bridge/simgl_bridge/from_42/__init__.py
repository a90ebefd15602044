"""The simulator 42 as the source of states: its text socket, and the images of what it sends."""
