// One ray down the 8-wide tree: eight boxes at once, then four triangles or spheres at once.
#include "castor/shared/layout.h"
#include "device/intersect_blocks.cl"

typedef struct WaitingChild {
    float entry;
    uint child;
} WaitingChild;

// What the test of a node's eight boxes needs, splat once a ray. Offsets choose the near and far planes by the direction's signs.
typedef struct WideRay {
    float8 inverse_x, inverse_y, inverse_z;
    float8 entry_x, entry_y, entry_z;
    float8 exit_x, exit_y, exit_z;
    float8 t_min;
    int near_x, near_y, near_z;
} WideRay;

CASTOR_INLINE WideRay make_wide_ray(const TraceRay ray)
{
    WideRay w;
    w.inverse_x = (float8)(ray.inverse.x);
    w.inverse_y = (float8)(ray.inverse.y);
    w.inverse_z = (float8)(ray.inverse.z);
    w.entry_x = (float8)(ray.entry_offset.x);
    w.entry_y = (float8)(ray.entry_offset.y);
    w.entry_z = (float8)(ray.entry_offset.z);
    w.exit_x = (float8)(ray.exit_offset.x);
    w.exit_y = (float8)(ray.exit_offset.y);
    w.exit_z = (float8)(ray.exit_offset.z);
    w.t_min = (float8)(ray.t_min);
    w.near_x = ray.inverse.x < 0.0f;
    w.near_y = 2 + (ray.inverse.y < 0.0f);
    w.near_z = 4 + (ray.inverse.z < 0.0f);
    return w;
}

// The children whose boxes the ray enters no later than t_limit, as bits; *entry is when.
CASTOR_INLINE uint enter_children(const WideRay ray, const global WideNode *node, const float t_limit, float8 *entry)
{
    const global float8 *planes = (const global float8 *)node;
    const float8 entry_x = fma(planes[ray.near_x], ray.inverse_x, ray.entry_x);
    const float8 entry_y = fma(planes[ray.near_y], ray.inverse_y, ray.entry_y);
    const float8 entry_z = fma(planes[ray.near_z], ray.inverse_z, ray.entry_z);
    const float8 exit_x = fma(planes[ray.near_x ^ 1], ray.inverse_x, ray.exit_x);
    const float8 exit_y = fma(planes[ray.near_y ^ 1], ray.inverse_y, ray.exit_y);
    const float8 exit_z = fma(planes[ray.near_z ^ 1], ray.inverse_z, ray.exit_z);
    *entry = larger8(larger8(entry_x, entry_y), larger8(entry_z, ray.t_min));
    const float8 exit = smaller8(smaller8(exit_x, exit_y), smaller8(exit_z, (float8)(t_limit)));
    return mask_of_8(*entry <= exit);
}

// The better of the best hit so far and those of a block.
CASTOR_INLINE Hit nearest_of_block(const SceneColumns scene, const BlockHits block, const global uint *primitives, Hit best)
{
    float t[4], u[4], v[4], determinant[4];
    vstore4(block.t, 0, t);
    vstore4(block.u, 0, u);
    vstore4(block.v, 0, v);
    vstore4(block.determinant, 0, determinant);
    for (uint mask = block.mask; mask; mask &= mask - 1) {
        const uint lane = lowest_bit(mask);
        Candidate candidate;
        candidate.t = t[lane];
        candidate.u = u[lane];
        candidate.v = v[lane];
        candidate.from_behind = determinant[lane] < 0.0f;
        if (!is_culled(scene, primitives[lane], candidate)) best = nearer_hit(best, candidate, primitives[lane]);
    }
    return best;
}

CASTOR_INLINE Hit nearest_in_wide_leaf(const SceneColumns scene, const TraceRay ray, const BlockRay block_ray, const uint leaf, Hit best)
{
    const uint first = leaf & CASTOR_WIDE_FIRST_MASK;
    const uint end = first + ((leaf >> CASTOR_WIDE_COUNT_SHIFT) & CASTOR_WIDE_COUNT_MASK) + 1;
    if (CASTOR_HAS_SPHERES && (leaf & CASTOR_WIDE_SPHERES)) {
        for (uint i = first; i < end; ++i) {
            const global SphereBlock *block = scene.sphere_blocks + i;
            for (uint mask = enter_sphere_boxes(block_ray, block); mask; mask &= mask - 1) {
                const uint lane = lowest_bit(mask);
                best = nearer_hit(best, intersect_sphere(ray, sphere_of_block(block, lane)), block->primitive[lane]);
            }
        }
        return best;
    }
    for (uint i = first; i < end; ++i) {
        const global TriangleBlock *block = scene.triangle_blocks + i;
        const BlockHits hits = intersect_triangle_block(block_ray, block);
        if (hits.mask) best = nearest_of_block(scene, hits, block->primitive, best);
    }
    return best;
}

CASTOR_INLINE int any_in_wide_leaf(const SceneColumns scene, const TraceRay ray, const BlockRay block_ray, const uint leaf)
{
    const uint first = leaf & CASTOR_WIDE_FIRST_MASK;
    const uint end = first + ((leaf >> CASTOR_WIDE_COUNT_SHIFT) & CASTOR_WIDE_COUNT_MASK) + 1;
    if (CASTOR_HAS_SPHERES && (leaf & CASTOR_WIDE_SPHERES)) {
        for (uint i = first; i < end; ++i) {
            const global SphereBlock *block = scene.sphere_blocks + i;
            for (uint mask = enter_sphere_boxes(block_ray, block); mask; mask &= mask - 1)
                if (is_candidate(intersect_sphere(ray, sphere_of_block(block, lowest_bit(mask))))) return 1;
        }
        return 0;
    }
    for (uint i = first; i < end; ++i) {
        const global TriangleBlock *block = scene.triangle_blocks + i;
        const BlockHits hits = intersect_triangle_block(block_ray, block);
        if (!hits.mask) continue;
        if (!(scene.params.flags & CASTOR_TRACE_CULL_BACK_FACES)) return 1;
        if (nearest_of_block(scene, hits, block->primitive, no_hit_yet(ray)).primitive != CASTOR_INVALID_INDEX) return 1;
    }
    return 0;
}

CASTOR_INLINE Hit nearest_wide(const SceneColumns scene, const TraceRay ray)
{
    if (!ray.valid) return miss();
    Hit best = nearest_plane(scene, ray, no_hit_yet(ray));
    const WideRay wide_ray = make_wide_ray(ray);
    const BlockRay block_ray = make_block_ray(ray);

    WaitingChild waiting[CASTOR_MAX_WIDE_STACK];
    int waiting_count = 0;
    uint current = scene.params.wide_root;
    while (current != CASTOR_INVALID_INDEX) {
        while (!(current & CASTOR_WIDE_LEAF)) {
            const global WideNode *node = scene.wide_nodes + current;
            float8 entry;
            uint mask = enter_children(wide_ray, node, best.t, &entry);
            if (!mask) {
                current = CASTOR_INVALID_INDEX;
                break;
            }
            const uint first = lowest_bit(mask);
            current = node->child[first];
            mask &= mask - 1;
            if (!mask) continue;

            // The others wait, the nearest on top.
            float entries[8];
            vstore8(entry, 0, entries);
            float nearest = entries[first];
            const int base = waiting_count;
            for (; mask; mask &= mask - 1) {
                const uint place = lowest_bit(mask);
                WaitingChild other;
                other.entry = entries[place];
                other.child = node->child[place];
                if (other.entry < nearest) {
                    const WaitingChild passed = {nearest, current};
                    nearest = other.entry;
                    current = other.child;
                    other = passed;
                }
                int at = waiting_count++;
                for (; at > base && waiting[at - 1].entry < other.entry; --at) waiting[at] = waiting[at - 1];
                waiting[at] = other;
            }
        }
        if (current != CASTOR_INVALID_INDEX) best = nearest_in_wide_leaf(scene, ray, block_ray, current, best);

        // The next waiting child that is not entered later than the best hit.
        current = CASTOR_INVALID_INDEX;
        while (waiting_count > 0 && current == CASTOR_INVALID_INDEX) {
            --waiting_count;
            if (waiting[waiting_count].entry <= best.t) current = waiting[waiting_count].child;
        }
    }
    return finished_hit(ray, best);
}

CASTOR_INLINE int any_wide(const SceneColumns scene, const TraceRay ray)
{
    if (!ray.valid) return 0;
    if (any_plane(scene, ray)) return 1;
    if (scene.params.wide_root == CASTOR_INVALID_INDEX) return 0;
    const WideRay wide_ray = make_wide_ray(ray);
    const BlockRay block_ray = make_block_ray(ray);

    uint waiting[CASTOR_MAX_WIDE_STACK];
    int waiting_count = 0;
    waiting[waiting_count++] = scene.params.wide_root;
    while (waiting_count > 0) {
        const uint current = waiting[--waiting_count];
        if (current & CASTOR_WIDE_LEAF) {
            if (any_in_wide_leaf(scene, ray, block_ray, current)) return 1;
            continue;
        }
        const global WideNode *node = scene.wide_nodes + current;
        float8 entry;
        for (uint mask = enter_children(wide_ray, node, ray.t_max, &entry); mask; mask &= mask - 1)
            waiting[waiting_count++] = node->child[lowest_bit(mask)];
    }
    return 0;
}
