// Ray and sphere: the quadratic a t^2 + 2 b t + c = 0 of |o + t d - centre|^2 = r^2. In plain floats its discriminant
// drowns where the sphere is far, and c where it is large (Haines, Günther, Akenine-Möller 2019, "Precision
// Improvements for Ray/Sphere Intersection", Ray Tracing Gems ch. 7); 48-bit coefficients settle both. The smaller root
// is c / q, without cancellation (Press et al., Numerical Recipes §5.6).
#include "device/double_float.cl"
#include "device/intersect_primitive.cl"
#include "device/simd.cl"

// For the type T, of suffix S: sphere_roots, the two t at which lines o + t d meet spheres; NaN where they do not. `a`
// is d.d. DIVIDE and ROOT are correctly rounded.
#define CASTOR_DEFINE_SPHERE_ROOTS(T, S, DIVIDE, ROOT)                                                             \
    typedef struct SphereRoots##S {                                                                                \
        T near_t;                                                                                                  \
        T far_t;                                                                                                   \
    } SphereRoots##S;                                                                                              \
                                                                                                                   \
    CASTOR_INLINE SphereRoots##S sphere_roots##S(const T origin_x, const T origin_y, const T origin_z, const T dx, \
                                                 const T dy, const T dz, const DoubleFloat##S a, const T center_x, \
                                                 const T center_y, const T center_z, const T radius)               \
    {                                                                                                              \
        const DoubleFloat##S ox = two_sum##S(origin_x, -center_x);                                                 \
        const DoubleFloat##S oy = two_sum##S(origin_y, -center_y);                                                 \
        const DoubleFloat##S oz = two_sum##S(origin_z, -center_z);                                                 \
        const DoubleFloat##S b =                                                                                   \
            add_double_float##S(add_double_float##S(scale_double_float##S(ox, dx), scale_double_float##S(oy, dy)), \
                                scale_double_float##S(oz, dz));                                                    \
        const DoubleFloat##S o2 = add_double_float##S(                                                             \
            add_double_float##S(multiply_double_float##S(ox, ox), multiply_double_float##S(oy, oy)),               \
            multiply_double_float##S(oz, oz));                                                                     \
        const DoubleFloat##S c = add_double_float##S(o2, two_product##S(-radius, radius));                         \
        DoubleFloat##S minus_a = a;                                                                                \
        minus_a.high = -a.high;                                                                                    \
        minus_a.low = -a.low;                                                                                      \
        const DoubleFloat##S discriminant =                                                                        \
            add_double_float##S(multiply_double_float##S(b, b), multiply_double_float##S(minus_a, c));             \
        const T root = ROOT(discriminant.high);                                                                    \
        const T q = b.high > 0.0f ? -(b.high + root) : root - b.high;                                              \
        const T first = DIVIDE(q, a.high);                                                                         \
        const T second = DIVIDE(c.high, q);                                                                        \
        SphereRoots##S roots;                                                                                      \
        roots.near_t = b.high > 0.0f ? first : second;                                                             \
        roots.far_t = b.high > 0.0f ? second : first;                                                              \
        return roots;                                                                                              \
    }

// Whether rays surely miss spheres, in plain floats and without branches: of such a ray sphere_roots are NaN, or less
// than t_min.
//
// With p = o - c, the discriminant is (p.d)^2 - d.d (p.p - r^2), each of its terms in magnitude at most d.d S, S = p.p
// + r^2. Rounding p, the sums, squares and products takes at most 9 * 2^-24 d.d S in the first term and as much in the
// second; the 48-bit discriminant is off by far less. So where the float is below -2^-19 d.d S = -32 * 2^-24 d.d S,
// both are negative. A ray that starts outside, p.p - r^2 > 2^-19 S, and goes away, p.d > 0, has both roots before 0;
// and if it is only rounding that says it goes away, then (p.d)^2 is less than 2^-40 d.d S and the discriminant
// negative. The summand covers terms that underflow.
#define CASTOR_DEFINE_SPHERE_MISSED(T, INT, S)                                                                       \
    CASTOR_INLINE INT sphere_missed##S(const T origin_x, const T origin_y, const T origin_z, const T dx, const T dy, \
                                       const T dz, const T a, const T t_min, const T center_x, const T center_y,     \
                                       const T center_z, const T radius)                                             \
    {                                                                                                                \
        const T px = origin_x - center_x;                                                                            \
        const T py = origin_y - center_y;                                                                            \
        const T pz = origin_z - center_z;                                                                            \
        const T b = fma(px, dx, fma(py, dy, pz * dz));                                                               \
        const T p2 = fma(px, px, fma(py, py, pz * pz));                                                              \
        const T r2 = radius * radius;                                                                                \
        const T c = p2 - r2;                                                                                         \
        const T rounding = fma((T)(0x1p-19f), p2 + r2, (T)(0x1p-120f));                                              \
        return (fma(b, b, -(a * c)) < -(a * rounding)) | ((c > rounding) & (b > 0.0f) & (t_min >= 0.0f));            \
    }

CASTOR_DEFINE_SPHERE_MISSED(float4, int4, 4)
CASTOR_DEFINE_SPHERE_MISSED(float16, int16, 16)

CASTOR_DEFINE_SPHERE_ROOTS(float, , divide, square_root)
CASTOR_DEFINE_SPHERE_ROOTS(float4, 4, divide4, square_root4)
CASTOR_DEFINE_SPHERE_ROOTS(float16, 16, divide16, square_root16)

// d.d of a ray.
CASTOR_INLINE DoubleFloat direction_squared(const float3 d)
{
    return add_double_float(add_double_float(two_product(d.x, d.x), two_product(d.y, d.y)), two_product(d.z, d.z));
}

// The nearer of the two points of the ray's line with t in [t_min, t_max].
CASTOR_INLINE Candidate intersect_sphere_line(const TraceRay ray, const float3 center, const float radius)
{
    const SphereRoots roots =
        sphere_roots(ray.origin.x, ray.origin.y, ray.origin.z, ray.direction.x, ray.direction.y, ray.direction.z,
                     direction_squared(ray.direction), center.x, center.y, center.z, radius);
    Candidate candidate = no_candidate();
    candidate.t = roots.near_t >= ray.t_min && roots.near_t <= ray.t_max ? roots.near_t : roots.far_t;
    return candidate;
}

CASTOR_INLINE Candidate intersect_sphere(const TraceRay ray, const float4 center_radius)
{
    const float3 center = center_radius.xyz;
    const float3 lower = center - center_radius.w;
    const float3 upper = center + center_radius.w;
    const float2 interval = box_interval(ray, lower, upper);
    if (!(interval.x <= interval.y)) return no_candidate();
    return within_own_box(ray, lower, upper, intersect_sphere_line(ray, center, center_radius.w));
}
