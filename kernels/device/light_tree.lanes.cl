// Which light a path sends a ray to, where a tree says what each may give at a point, for CASTOR_LANES lanes (see
// lanes.cl): Conty Estevez, Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting".
//
// From the root on, one of two children is chosen, by what they may give (importance_of_light_node) at the point where
// light is wanted. Probabilities are whole numbers of parts, of which there are 2^24, so that a random number has
// exactly the probability that is said: a child that may give something has one part at least. What is left of the
// random number within the chosen child's parts chooses at the next node, with bits of a hash below its own. What is
// left at the light is a random number still: it draws the point of the light, so that those samples of a pixel that go
// to one light are spread over it as well as if there were no other.
//
// The probability of a light that a ray met by chance is found by the same way down, which Light.trail shows.
#include "castor/shared/types.h"
#include "device/random.lanes.cl"
#include "device/vector.lanes.cl"

#define CASTOR_LIGHT_WORDS 24u  // types.h asserts the sizes
#define CASTOR_LIGHT_NODE_ROWS 3u
#define CASTOR_LIGHT_PARTS 16777216.0f  // 2^24
// What is less is taken for so much, since a device may know no smaller numbers, and what is more likewise: sums stay
// finite.
#define CASTOR_LEAST_IMPORTANCE 0x1p-100f
#define CASTOR_LARGEST_IMPORTANCE 0x1p100f
// Of a light at the horizon, where the normal is rounded.
#define CASTOR_LEAST_RECEIVED 1e-4f

// Points where light is wanted.
typedef struct LANES(Receivers) {
    LANES(Vectors) origin;
    LANES(Vectors) normal;  // unit
    Mask has_both_sides;    // light from below counts, too
} LANES(Receivers);

typedef struct LANES(ChosenLights) {
    Whole number;
    Real probability;
    Real rest;  // of at.x, where the light was drawn: in [0, 1), a multiple of 2^-24, independent of the light
} LANES(ChosenLights);

// Packs unit vectors and a bit into words: 16 bits of the octahedron's x, 15 of its y (Meyer, Suessmuth, Sussner,
// Stamminger 2010, "On Floating-Point Normal Vectors").
CASTOR_INLINE Whole LANES(packed_normals)(const LANES(Vectors) normal, const Mask bit)
{
    const Real one = (Real)(1.0f), zero = (Real)(0.0f);
    const Real sum = fabs(normal.x) + fabs(normal.y) + fabs(normal.z);
    const Real inverse = LANES(divide)(one, sum > 0.0f ? sum : one);
    const Real x = normal.x * inverse, y = normal.y * inverse;
    const Real folded_x = (1.0f - fabs(y)) * (x < zero ? -one : one),
               folded_y = (1.0f - fabs(x)) * (y < zero ? -one : one);
    const Mask is_below = normal.z < zero;
    const Real across = is_below ? folded_x : x, down = is_below ? folded_y : y;
    const Whole of_x = LANES(convert_uint)(fma(clamp(across, -one, one), (Real)(32767.0f), (Real)(32768.5f)));
    const Whole of_y = LANES(convert_uint)(fma(clamp(down, -one, one), (Real)(16383.0f), (Real)(16384.5f)));
    return of_x | (of_y << 16u) | (bit ? (Whole)(0x80000000u) : (Whole)(0u));
}

// Returns points, with what packed_normals made.
CASTOR_INLINE LANES(Receivers) LANES(receivers)(const LANES(Vectors) origin, const Whole packed)
{
    const Real one = (Real)(1.0f), zero = (Real)(0.0f);
    const Real x = (LANES(convert_float)(packed & 65535u) - 32768.0f) * 3.051851e-5f;
    const Real y = (LANES(convert_float)((packed >> 16u) & 32767u) - 16384.0f) * 6.1038882e-5f;
    const Real z = 1.0f - fabs(x) - fabs(y);
    const Mask is_below = z < zero;
    const Real folded_x = (1.0f - fabs(y)) * (x < zero ? -one : one),
               folded_y = (1.0f - fabs(x)) * (y < zero ? -one : one);
    LANES(Receivers) receiver;
    receiver.origin = origin;
    receiver.normal = LANES(normalized_vectors)(LANES(vectors)(is_below ? folded_x : x, is_below ? folded_y : y, z));
    receiver.has_both_sides = (packed >> 31u) != 0u;
    return receiver;
}

// Angles of [0, pi].
typedef struct LANES(Angles) {
    Real cosine, sine;
} LANES(Angles);

CASTOR_INLINE LANES(Angles) LANES(angles)(const Real cosine)
{
    LANES(Angles) angle;
    angle.cosine = clamp(cosine, (Real)(-1.0f), (Real)(1.0f));
    angle.sine = LANES(square_root)(fma(-angle.cosine, angle.cosine, (Real)(1.0f)));
    return angle;
}

// Returns a - b, or 0 where b is larger.
CASTOR_INLINE LANES(Angles) LANES(difference_of_angles)(const LANES(Angles) a, const LANES(Angles) b)
{
    const Mask is_within = a.cosine > b.cosine;
    LANES(Angles) angle;
    angle.cosine = is_within ? (Real)(1.0f) : fma(a.cosine, b.cosine, a.sine * b.sine);
    angle.sine = is_within ? (Real)(0.0f) : fma(a.sine, b.cosine, -(a.cosine * b.sine));
    return angle;
}

// Nodes as a point sees them.
typedef struct LANES(SeenNodes) {
    Real importance;  // 0: none of the lights gives anything there
    Whole first;
    Whole flags;
} LANES(SeenNodes);

// Returns an estimate of the irradiance from nodes, about the most that there can be: flux * cosine at the light *
// cosine at the receiver / distance^2, with the smallest angles that are possible for lights in the node's sphere.
CASTOR_INLINE LANES(SeenNodes)
    LANES(seen_light_nodes)(const global LightNode *restrict nodes, const Whole number, const LANES(Receivers) at)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const global float4 *const rows = (const global float4 *)nodes;
    const Whole row = CASTOR_LIGHT_NODE_ROWS * number;
    const LANES(Rows) sphere = LANES(gather_rows)(rows, row), cone = LANES(gather_rows)(rows, row + 1u),
                      rest = LANES(gather_rows)(rows, row + 2u);
    LANES(SeenNodes) seen;
    seen.first = LANES(as_uint)(rest.z);
    seen.flags = LANES(as_uint)(rest.w);
    const Mask is_far = (seen.flags & CASTOR_LIGHT_NODE_FAR) != 0u;
    const LANES(Vectors) axis = LANES(vectors_of_rows)(cone);
    const LANES(Vectors) to = LANES(difference_of_vectors)(LANES(vectors_of_rows)(sphere), at.origin);
    const Real distance_squared = LANES(dot_products)(to, to);
    const Real radius_squared = LANES(larger)(sphere.w * sphere.w, (Real)(0x1p-80f));
    const Mask is_within = !is_far & !(distance_squared > radius_squared);
    const Real inverse_squared = LANES(divide)(one, LANES(larger)(distance_squared, radius_squared));
    const Real inverse = LANES(square_root)(inverse_squared);
    const LANES(Vectors) wi =
        LANES(choose_vectors)(is_far, LANES(scaled_vectors)(axis, -one), LANES(scaled_vectors)(to, inverse));
    const LANES(Angles) normals = LANES(angles)(cone.w);
    LANES(Angles) extent;  // of the sphere; of directions without a place
    extent.sine = is_far ? normals.sine : LANES(smaller)(sphere.w * inverse, one);
    extent.cosine = is_far ? normals.cosine : LANES(square_root)(fma(-extent.sine, extent.sine, one));

    const Real along = -LANES(dot_products)(axis, wi);
    const Mask has_both_sides = (seen.flags & CASTOR_LIGHT_NODE_BOTH_SIDES) != 0u;
    const LANES(Angles) off_axis = LANES(angles)(has_both_sides ? fabs(along) : along);
    const Real at_light = LANES(difference_of_angles)(LANES(difference_of_angles)(off_axis, normals), extent).cosine;
    const Mask has_any_direction = is_within | is_far;
    const Mask sends = has_any_direction | (at_light > LANES(larger)(rest.y, zero));

    const Real above = LANES(dot_products)(at.normal, wi);
    const LANES(Angles) off_normal = LANES(angles)(at.has_both_sides ? fabs(above) : above);
    const Real nearest = LANES(difference_of_angles)(off_normal, extent).cosine;
    const Real at_receiver = is_within ? one : nearest;
    const Mask receives = at_receiver > -CASTOR_LEAST_RECEIVED;

    const Real cosines =
        (has_any_direction ? one : at_light) * LANES(larger)(at_receiver, (Real)(CASTOR_LEAST_RECEIVED));
    const Real value = rest.x * cosines * (is_far ? one : inverse_squared);
    const Real importance = clamp(value, (Real)(CASTOR_LEAST_IMPORTANCE), (Real)(CASTOR_LARGEST_IMPORTANCE));
    seen.importance = (sends & receives & (rest.x > zero)) ? importance : zero;
    return seen;
}

// Returns how many of 2^24 parts are the first child's. Where one has a place and the other has not, neither has less
// than a quarter: what hides the sun in a hall, or the lamps from a lawn, is not known.
CASTOR_INLINE Whole LANES(parts_of_first)(const LANES(SeenNodes) first, const LANES(SeenNodes) second)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const Real sum = first.importance + second.importance;
    const Mask is_either = sum > zero;
    Real share = LANES(divide)(is_either ? first.importance : one, is_either ? sum : (Real)(2.0f));
    const Mask has_first = first.importance > zero, has_second = second.importance > zero;
    const Mask is_mixed = ((first.flags ^ second.flags) & CASTOR_LIGHT_NODE_FAR) != 0u;
    share = (is_mixed & has_first & has_second) ? fma(share, (Real)(0.5f), (Real)(0.25f)) : share;
    const Real parts = share * CASTOR_LIGHT_PARTS;
    const Real least = (has_first | !is_either) ? one : zero;
    const Real most = CASTOR_LIGHT_PARTS - ((has_second | !is_either) ? one : zero);
    return LANES(convert_uint)(clamp(parts, least, most));
}

// Goes down the tree, where `counts`: along the trails of lights, or where `is_drawn`, as random numbers at.x lead,
// which at.y makes longer. Returns the lights there, and their probabilities at these points.
CASTOR_ONCE LANES(ChosenLights)
    LANES(walk_light_tree)(const global LightNode *restrict nodes, const LANES(Receivers) receiver, const Mask counts,
                           const int is_drawn, const Whole trail, const LANES(Points) at)
{
    const Real one = (Real)(1.0f);
    Whole part = LANES(convert_uint)(at.x * CASTOR_LIGHT_PARTS);
    Whole bits = LANES(combine_hashes)(part, LANES(convert_uint)(at.y * CASTOR_LIGHT_PARTS));
    Whole first = (Whole)(nodes[0].first);
    LANES(ChosenLights) light;
    light.probability = one;
    Mask is_inner = counts;
    for (uint level = 0; level < CASTOR_LIGHT_LEVELS && LANES(mask_of)(is_inner); ++level) {
        const Whole child = is_inner ? first : (Whole)(1u);
        const LANES(SeenNodes) a = LANES(seen_light_nodes)(nodes, child, receiver),
                               b = LANES(seen_light_nodes)(nodes, child + 1u, receiver);
        const Whole of_first = LANES(parts_of_first)(a, b);
        const Mask is_first = is_drawn ? part < of_first : ((trail >> level) & 1u) == 0u;
        const Whole parts = is_first ? of_first : (uint)CASTOR_LIGHT_PARTS - of_first;
        const Real size = LANES(convert_float)(parts);
        light.probability = is_inner ? light.probability * (size * 0x1p-24f) : light.probability;
        if (is_drawn) {
            bits = LANES(hash_uint)(bits);
            const Real place = LANES(convert_float)(is_first ? part : part - of_first) + LANES(unit_float)(bits);
            const Real next = LANES(divide)(place, LANES(larger)(size, one)) * CASTOR_LIGHT_PARTS;
            const Whole left = LANES(convert_uint)(LANES(smaller)(next, (Real)(CASTOR_LIGHT_PARTS - 1.0f)));
            part = is_inner ? left : part;
        }
        const Whole chosen = is_first ? a.first : b.first;
        first = is_inner ? chosen : first;
        is_inner &= ((is_first ? a.flags : b.flags) & CASTOR_LIGHT_NODE_LEAF) == 0u;
    }
    light.number = first;
    light.rest = LANES(convert_float)(part) * (1.0f / CASTOR_LIGHT_PARTS);
    return light;
}
