// What gather points see of the light that leaves patches, and of sunlight between surfaces the share
// that other spacecraft leave.
#include "common/group.glsl"
#include "interreflection/sparse.glsl"

layout(std430, binding = 2) readonly buffer Exitance { vec4 exitance[]; };  // [W m-2]
layout(std430, binding = 3) writeonly buffer Light { vec4 light[]; };       // irradiance [W m-2]
layout(std430, binding = 4) writeonly buffer Left { float left[]; };
#ifdef TAKEN
// Of a Sun of 1 W m-2 what others take, and all that there is.
layout(std430, binding = 5) readonly buffer AtPatches { vec2 at_patches[]; };
layout(std430, binding = 6) readonly buffer AtPoints { vec2 at_points[]; };
#endif
uniform int points;

void main() {
    int i = int(gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x + gl_GlobalInvocationID.x);
    if (i >= points) return;
    vec4 seen = vec4(0.0);
    vec2 taken = vec2(0.0);
    for (uint k = starts[i]; k < starts[i + 1]; ++k) {
        uvec2 entry = entries[k];
        float weight = uintBitsToFloat(entry.y);
        seen += weight * exitance[entry.x];
#ifdef TAKEN
        taken += weight * at_patches[entry.x];
#endif
    }
    light[i] = seen;
#ifdef TAKEN
    taken += at_points[i];
#endif
    left[i] = taken.y > 0.0 ? clamp(1.0 - taken.x / taken.y, 0.0, 1.0) : 1.0;
}
