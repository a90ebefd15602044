// Numbers the pages of a tile: each block of cells has as many as its byte tells (gbuffer/pages.frag), one
// after the other, row by row, as `page_table` in simgl/passes/shading_points.py numbers them on the CPU.
//
// SUMS: how many pages each chunk of blocks has. STARTS, by one workgroup: how many come before each chunk.
// ENTRIES: the entry of each page and the first page of each block.
#include "common/group.glsl"
#include "gbuffer/page_places.glsl"

const int THREADS = GROUP_COLUMNS * GROUP_ROWS;
const int EACH = 8;           // blocks of a chunk for each of its threads
const uint COUNT = 31u;       // of the byte of a block
const int IN_ROW = 4 * SQUARES;
// Of an entry, as in gbuffer/paging.glsl.
const uint PRESENT = 1u << 31u, LAYER_BIT = 26u, ROW_BIT = 13u;

layout(std430, binding = 0) buffer Chunks { uint chunks[]; };
#ifdef STARTS
layout(std430, binding = 1) buffer Pages {
    int drawn_rows;    // end of the rows of points
    uint total;
    uint per_blocks;   // of a tile with more pages than there is room for, how many 256 blocks have
};
uniform int chunk_count;
uniform float block_count;
#else
uniform usampler2D counts;
uniform ivec2 size;    // blocks
#endif
#ifndef SUMS
// As many pages as there is room for; those beyond are left out.
uniform int capacity;
layout(r32ui, binding = 0) writeonly uniform uimage2D entries_image;
#endif
#ifdef ENTRIES
layout(r32ui, binding = 1) writeonly uniform uimage2D first_pages_image;
#endif

shared uint ends[THREADS];

// Sum of what the threads before this one have, and of all.
uint before(uint own, out uint all_of_them) {
    int thread = int(gl_LocalInvocationIndex);
    ends[thread] = own;
    memoryBarrierShared();
    barrier();
    for (int back = 1; back < THREADS; back *= 2) {
        uint more = thread >= back ? ends[thread - back] : 0u;
        barrier();
        ends[thread] += more;
        memoryBarrierShared();
        barrier();
    }
    all_of_them = ends[THREADS - 1];
    return ends[thread] - own;
}

#ifndef SUMS
void store_entry(uint page, uint entry) {
    if (page < uint(capacity))
        imageStore(entries_image, ivec2(int(page) % IN_ROW, int(page) / IN_ROW), uvec4(entry, 0u, 0u, 0u));
}
#endif

#ifdef STARTS
void main() {
    int thread = int(gl_LocalInvocationIndex), each = (chunk_count + THREADS - 1) / THREADS;
    int first = thread * each, last = min(first + each, chunk_count);
    uint own = 0u, all_of_them;
    for (int i = first; i < last; ++i) own += chunks[i];
    uint start = before(own, all_of_them);
    for (int i = first; i < last; ++i) {
        uint count = chunks[i];
        chunks[i] = start;
        start += count;
    }
    // To the end of the last row.
    uint row_end = (all_of_them + uint(IN_ROW - 1)) / uint(IN_ROW) * uint(IN_ROW);
    for (uint page = all_of_them + uint(thread); page < row_end; page += uint(THREADS)) store_entry(page, 0u);
    if (thread == 0) {
        total = all_of_them;
        drawn_rows = 4 * (int(min(row_end, uint(capacity))) / IN_ROW);
        if (all_of_them > uint(capacity))
            per_blocks = max(per_blocks, uint(ceil(256.0 * float(all_of_them) / block_count)));
    }
}
#else
void main() {
    int chunk = int(gl_WorkGroupID.x), blocks = size.x * size.y;
    int first = (chunk * THREADS + int(gl_LocalInvocationIndex)) * EACH;
    uint own[EACH], sum = 0u, all_of_them;
    for (int k = 0; k < EACH; ++k) {
        int block = first + k;
        ivec2 at = ivec2(block % size.x, block / size.x);
        own[k] = block < blocks ? texelFetch(counts, at, 0).r & COUNT : 0u;
        sum += own[k];
    }
    uint start = before(sum, all_of_them);
#ifdef SUMS
    if (gl_LocalInvocationIndex == 0u) chunks[chunk] = all_of_them;
#else
    start += chunks[chunk];
    for (int k = 0; k < EACH; ++k) {
        int block = first + k;
        if (block >= blocks) break;
        ivec2 at = ivec2(block % size.x, block / size.x);
        imageStore(first_pages_image, at, uvec4(own[k] > 0u ? start : 0u, 0u, 0u, 0u));
        uint entry = PRESENT | uint(at.y) << ROW_BIT | uint(at.x);
        for (uint layer = 0u; layer < own[k]; ++layer) store_entry(start + layer, entry | layer << LAYER_BIT);
        start += own[k];
    }
#endif
}
#endif
