// How far night has fallen where the Sun stands at a sine over the horizon: 0 by day, 1 from 2.4 deg
// below it; as in simgl/view/tiles.py.
float nightfall(float mu_sun) {
    return clamp(0.5 - 12.0 * mu_sun, 0.0, 1.0);
}
