"""Who takes many frames of one scene: this process, or workers on this and other machines."""
