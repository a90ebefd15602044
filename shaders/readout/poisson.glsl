// Poisson counts of means m >= 0, one from each uniform number u in (0, 1).
//
// Below FEW by inversion of the distribution, exact. Above, a rounded normal deviate z with the
// expansion of Cornish and Fisher to third order,
//     m + s z + (z^2 - 1) / 6 + (z - z^3) / (72 s),
// whose variance is s^2: s^2 = m - 1/12 leaves room for the variance of rounding, so that mean and
// variance both equal m. At 20 its distribution differs from Poisson's by a chi-square of 1.6e-6 per
// sample, two units in a whole image of 1280 x 960.
const float FEW = 20.0;

vec4 poisson(vec4 m, vec4 u) {
    vec4 z = normal(u);
    vec4 s = sqrt(max(m, FEW) - 1.0 / 12.0);
    vec4 many = floor(m + s * z + (z * z - 1.0) / 6.0 + (z - z * z * z) / (72.0 * s) + 0.5);
    bvec4 is_few = lessThan(m, vec4(FEW));
    // Pixels with many electrons take part with a mean of 0: their sum is 1 at once.
    vec4 mean = mix(vec4(0.0), m, is_few);
    vec4 term = exp(-mean), sum = term, count = vec4(0.0);
    bvec4 open = greaterThan(u, sum);
    for (float k = 1.0; k < 100.0 && any(open); ++k) {
        count += vec4(open);
        term *= mean / k;
        sum += term;
        // Rounding may keep the sum below the largest u: there the terms beyond the mean end it.
        open = greaterThan(min(u - sum, max(term - 3e-8, mean - k)), vec4(0.0));
    }
    return max(mix(many, count, is_few), 0.0);
}
