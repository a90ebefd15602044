// How far night has fallen where the Sun stands at a sine over the horizon; simgl/passes/background/planet.py
// knows where these are 0.

// For lamps: from 2.4 deg over to 2.4 deg under the horizon.
float dusk(float mu_sun) {
    return clamp(0.5 - 12.0 * mu_sun, 0.0, 1.0);
}

// For the airglow, which twilight outshines: from 6 to 10 deg under it.
float nightfall(float mu_sun) {
    return clamp(-1.25 - 12.5 * mu_sun, 0.0, 1.0);
}
