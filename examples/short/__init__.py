"""Ten lines each: one thing that simgl does; examples/README.md lists them."""
