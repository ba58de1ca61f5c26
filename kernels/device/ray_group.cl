// Sixteen rays made ready for traversal side by side, in columns: RayGroup. A ray is named by its group and its place
// there.
#include "castor/shared/layout.h"
#include "device/scene.cl"

#define CASTOR_GROUP_RAYS 16u

// 1: with the rays' origins, or directions, along the world's axes.
#ifndef CASTOR_GROUPS_HAVE_ORIGINS
#define CASTOR_GROUPS_HAVE_ORIGINS (CASTOR_HAS_SPHERES || CASTOR_HAS_INSTANCES)
#endif
#define CASTOR_GROUPS_HAVE_DIRECTIONS (CASTOR_HAS_SPHERES || CASTOR_HAS_INSTANCES)

typedef float RayFloats[CASTOR_GROUP_RAYS];
typedef uint RayNumbers[CASTOR_GROUP_RAYS];

// The columns are those of TraceRay, unless a comment says otherwise.
typedef struct RayGroup {
    RayFloats inverse_x, inverse_y, inverse_z;
    RayFloats entry_x, entry_y, entry_z;
    RayFloats exit_x, exit_y, exit_z;
    RayFloats t_min, t_max, t_scale;
    RayFloats origin_x, origin_y, origin_z;  // along the axes kx, ky and kz
    RayFloats shear_x, shear_y, shear_z;
    RayNumbers kx, ky, kz;
    RayNumbers near_x, near_y, near_z;  // see near_plane_bytes
#if CASTOR_GROUPS_HAVE_ORIGINS
    RayFloats world_origin_x, world_origin_y, world_origin_z;
#endif
#if CASTOR_GROUPS_HAVE_DIRECTIONS
    RayFloats direction_x, direction_y, direction_z;
#endif
#if CASTOR_HAS_SPHERES
    RayFloats direction_squared_high, direction_squared_low;
#endif
    // The best hit so far; best_t is t_max where there is none.
    RayFloats best_t, best_u, best_v;
    RayNumbers best_primitive;
#if CASTOR_HAS_INSTANCES
    RayNumbers best_instance;
    RayNumbers instance;  // in whose space the ray is, where it is not in the world
#if CASTOR_HAS_MOTION
    RayFloats time;  // of rays in the world
#endif
#endif
#if CASTOR_GROUPS_HAVE_ORIGINS && !CASTOR_HAS_SPHERES && !CASTOR_HAS_INSTANCES
    RayFloats unused;  // see `reserved`
#endif
    uint valid;  // the rays that can hit anything, as bits
    // Columns are cache lines of 64 bytes where groups begin at one. They are an odd number unless rays have times,
    // which lets the same column of several groups be in a cache at once.
    uint reserved[CASTOR_GROUP_RAYS - 1];
} RayGroup;

#define CASTOR_PLANE_BYTES 32u

// 1: all that a ray can hit lies in the boxes of the tree's root.
#define CASTOR_ALL_IS_BOUNDED (!CASTOR_HAS_PLANES && !CASTOR_HAS_INSTANCES)

// A box that holds all that has one. lower > upper: there is nothing.
typedef struct Bounds {
    float3 lower, upper;
} Bounds;
