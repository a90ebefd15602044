// Bounds on the casters of a map, from left to right: for each cell of 8 texels, over 8, 16, 24, 32,
// 48 ... 256 texels around it (REACHES in simgl/view/shadow_views.py).

const int CASTER_LEVELS = 10;

// The first bounds that tell of all within `reach` texels, CASTER_LEVELS where none does. What they
// tell of is less than 1.5 reach + 16 texels away.
int caster_level(float reach) {
    vec4 all = vec4(reach);
    vec4 shorter = step(vec4(8.0, 16.0, 24.0, 32.0), all) + step(vec4(48.0, 64.0, 96.0, 128.0), all);
    return int(dot(shorter, vec4(1.0)) + dot(step(vec2(192.0, 256.0), all.xy), vec2(1.0)));
}
