"""Many pictures drawn at random from one scene, on many workers, with labels to learn from."""
