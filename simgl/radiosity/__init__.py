"""Light between the surfaces of one spacecraft: form factors traced once, solved per frame."""
