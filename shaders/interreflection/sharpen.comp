// Values at gather points between which light has the means that rays found around each
// (simgl/radiosity/interpolation.py): irradiance by patches, and the share of the sky.
#include "common/group.glsl"
#include "interreflection/sparse.glsl"

layout(std430, binding = 2) readonly buffer MeanLight { vec4 mean_light[]; };  // [W m-2]
layout(std430, binding = 3) readonly buffer MeanShare { float mean_share[]; };
layout(std430, binding = 4) writeonly buffer Light { vec4 light[]; };
layout(std430, binding = 5) writeonly buffer Share { float share[]; };
uniform int points;

void main() {
    int i = int(gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x + gl_GlobalInvocationID.x);
    if (i >= points) return;
    vec4 light_there = vec4(0.0);
    float share_there = 0.0;
    for (uint k = starts[i]; k < starts[i + 1]; ++k) {
        uvec2 entry = entries[k];
        float weight = uintBitsToFloat(entry.y);
        light_there += weight * mean_light[entry.x];
        share_there += weight * mean_share[entry.x];
    }
    light[i] = light_there;
    share[i] = share_there;
}
