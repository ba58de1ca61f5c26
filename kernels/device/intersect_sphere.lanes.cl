// Rays and spheres, paired lane by lane, for CASTOR_LANES lanes (see lanes.cl): the quadratic a t^2 + 2 b t + c = 0 of
// |o + t d - centre|^2 = r^2. In plain floats its discriminant drowns where the sphere is far, and c where it is large
// (Haines, Günther, Akenine-Möller 2019, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems ch. 7);
// 48-bit coefficients settle both. The smaller root is c / q, without cancellation (Press et al., Numerical Recipes
// §5.6).
#include "device/double_float.lanes.cl"
#include "device/intersect_primitive.lanes.cl"

// Rays o + t d as spheres see them; `a` is d.d.
typedef struct LANES(SphereRay) {
    Real ox, oy, oz;
    Real dx, dy, dz;
    LANES(DoubleFloat) a;
} LANES(SphereRay);

typedef struct LANES(Spheres) {
    Real x, y, z;
    Real radius;
} LANES(Spheres);

typedef struct LANES(SphereRoots) {
    Real near_t;
    Real far_t;
    Real root;  // of the discriminant; 0: the line touches the sphere
} LANES(SphereRoots);

// Returns the two t at which the rays' lines meet the spheres; NaN where they do not.
CASTOR_INLINE LANES(SphereRoots) LANES(sphere_roots)(const LANES(SphereRay) ray, const LANES(Spheres) sphere)
{
    const LANES(DoubleFloat) ox = LANES(two_sum)(ray.ox, -sphere.x);
    const LANES(DoubleFloat) oy = LANES(two_sum)(ray.oy, -sphere.y);
    const LANES(DoubleFloat) oz = LANES(two_sum)(ray.oz, -sphere.z);
    const LANES(DoubleFloat) b = LANES(add_double_float)(
        LANES(add_double_float)(LANES(scale_double_float)(ox, ray.dx), LANES(scale_double_float)(oy, ray.dy)),
        LANES(scale_double_float)(oz, ray.dz));
    const LANES(DoubleFloat) o2 = LANES(add_double_float)(
        LANES(add_double_float)(LANES(multiply_double_float)(ox, ox), LANES(multiply_double_float)(oy, oy)),
        LANES(multiply_double_float)(oz, oz));
    const LANES(DoubleFloat) c = LANES(add_double_float)(o2, LANES(two_product)(-sphere.radius, sphere.radius));
    LANES(DoubleFloat) minus_a = ray.a;
    minus_a.high = -ray.a.high;
    minus_a.low = -ray.a.low;
    const LANES(DoubleFloat) discriminant =
        LANES(add_double_float)(LANES(multiply_double_float)(b, b), LANES(multiply_double_float)(minus_a, c));
    const Real root = LANES(square_root)(discriminant.high);
    const Real q = b.high > 0.0f ? -(b.high + root) : root - b.high;
    const Real first = LANES(divide)(q, ray.a.high);
    const Real second = LANES(divide)(c.high, q);
    LANES(SphereRoots) roots;
    roots.root = root;
    roots.near_t = b.high > 0.0f ? first : second;
    roots.far_t = b.high > 0.0f ? second : first;
    return roots;
}

// Returns which rays surely miss their spheres, in plain floats and without branches: sphere_roots of such a ray are
// NaN, or less than t_min.
//
// With p = o - c, the discriminant is (p.d)^2 - d.d (p.p - r^2), each of its terms in magnitude at most d.d S, S = p.p
// + r^2. Rounding p, the sums, squares and products takes at most 9 * 2^-24 d.d S in the first term and as much in the
// second; the 48-bit discriminant is off by far less. So where the float is below -2^-19 d.d S = -32 * 2^-24 d.d S,
// both are negative. A ray that starts outside, p.p - r^2 > 2^-19 S, and goes away, p.d > 0, has both roots before 0;
// and if it is only rounding that says it goes away, then (p.d)^2 is less than 2^-40 d.d S and the discriminant
// negative. The summand covers terms that underflow.
CASTOR_INLINE Mask LANES(sphere_missed)(const LANES(SphereRay) ray, const Real t_min, const LANES(Spheres) sphere)
{
    const Real px = ray.ox - sphere.x;
    const Real py = ray.oy - sphere.y;
    const Real pz = ray.oz - sphere.z;
    const Real b = fma(px, ray.dx, fma(py, ray.dy, pz * ray.dz));
    const Real p2 = fma(px, px, fma(py, py, pz * pz));
    const Real r2 = sphere.radius * sphere.radius;
    const Real c = p2 - r2;
    const Real rounding = fma((Real)(0x1p-19f), p2 + r2, (Real)(0x1p-120f));
    return (fma(b, b, -(ray.a.high * c)) < -(ray.a.high * rounding)) | ((c > rounding) & (b > 0.0f) & (t_min >= 0.0f));
}

// Returns the nearer of the two points of the rays' lines with t in [t_min, t_max], if there is one.
CASTOR_INLINE LANES(PrimitiveHits)
    LANES(sphere_hits)(const LANES(SphereRay) ray, const Real t_min, const Real t_max, const LANES(Spheres) sphere)
{
    const LANES(SphereRoots) roots = LANES(sphere_roots)(ray, sphere);
    const Mask near_counts = (roots.near_t >= t_min) & (roots.near_t <= t_max);
    LANES(PrimitiveHits) hits;
    hits.t = near_counts ? roots.near_t : roots.far_t;
    hits.u = (Real)(0.0f);
    hits.v = (Real)(0.0f);
    hits.determinant = (Real)(1.0f);  // spheres are never culled
    hits.accepted = hits.t == hits.t;
    return hits;
}

CASTOR_INLINE LANES(BoxPlanes) LANES(planes_of_spheres)(const LANES(Slabs) slabs, const LANES(Spheres) sphere)
{
    return LANES(box_planes)(slabs, sphere.x - sphere.radius, sphere.y - sphere.radius, sphere.z - sphere.radius,
                             sphere.x + sphere.radius, sphere.y + sphere.radius, sphere.z + sphere.radius);
}
