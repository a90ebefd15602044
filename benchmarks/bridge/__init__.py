"""Long proofs of the image service: a soak, a fuzzer, and the cost of the loop itself."""
