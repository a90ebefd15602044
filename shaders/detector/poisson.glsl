#include "common/philox.glsl"

// A Poisson count of mean m >= 0 from three random words.
//
// Below 30 by inversion of the distribution, exact. Above, a rounded Gaussian with the
// Cornish-Fisher skew term (z^2 - 1) / 6; 5/36 = 1/12 + 1/18 takes the variance of rounding and of the
// skew term out of the Gaussian's, so that mean and variance both equal m.
float poisson(float m, uvec3 bits) {
    if (!(m > 0.0)) return 0.0;
    if (m < 30.0) {
        float u = uniform_01(bits.x);
        float term = exp(-m), sum = term;
        int count = 0;
        while (u > sum && count < 200) {
            ++count;
            term *= m / float(count);
            sum += term;
        }
        return float(count);
    }
    float z = gaussian(bits.yz);
    return max(floor(m + sqrt(m - 5.0 / 36.0) * z + (z * z - 1.0) / 6.0 + 0.5), 0.0);
}
