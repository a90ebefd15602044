"""Short scripts, each for one feature; examples/README.md lists them."""
