// Of the irradiance by the sky on a free surface, the share that arrives at gather points.
#include "common/group.glsl"
#include "interreflection/sparse.glsl"

layout(std430, binding = 2) readonly buffer Cells { float cells[]; };  // radiance, mean of the bands
layout(std430, binding = 3) readonly buffer Free { float free[]; };    // one over what all rays bring
layout(std430, binding = 4) readonly buffer Rows { uint rows[]; };     // of each point, in that table
layout(std430, binding = 5) readonly buffer Complement { float complement[]; };  // 1 where the rest is given
layout(std430, binding = 6) writeonly buffer Share { float share[]; };
uniform int points;

void main() {
    int i = int(gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x + gl_GlobalInvocationID.x);
    if (i >= points) return;
    float seen = 0.0;
    for (uint k = starts[i]; k < starts[i + 1]; ++k) {
        seen += uintBitsToFloat(entries[k].y) * cells[entries[k].x];
    }
    share[i] = complement[i] + seen * free[rows[i]];
}
