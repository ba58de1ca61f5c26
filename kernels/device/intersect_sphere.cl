// Ray and sphere: the quadratic a t^2 + 2 b t + c = 0 of |o + t d - centre|^2 = r^2. In plain floats its discriminant drowns where the
// sphere is far, and c where it is large (Haines, Günther, Akenine-Möller 2019, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems ch. 7);
// 48-bit coefficients settle both. The smaller root is c / q, without cancellation (Press et al., Numerical Recipes §5.6).
#include "castor/shared/layout.h"
#include "device/double_float.cl"
#include "device/intersect_primitive.cl"

CASTOR_INLINE DoubleFloat add_scaled(const DoubleFloat sum, const DoubleFloat a, const DoubleFloat b)
{
    return add_double_float(sum, multiply_double_float(a, b));
}

CASTOR_INLINE DoubleFloat from_float(const float a)
{
    DoubleFloat exact;
    exact.high = a;
    exact.low = 0.0f;
    return exact;
}

// The nearer of the two points of the ray's line with t in [t_min, t_max].
CASTOR_INLINE Candidate intersect_sphere_line(const TraceRay ray, const float3 center, const float radius)
{
    const DoubleFloat ox = two_sum(ray.origin.x, -center.x);
    const DoubleFloat oy = two_sum(ray.origin.y, -center.y);
    const DoubleFloat oz = two_sum(ray.origin.z, -center.z);
    const DoubleFloat dx = from_float(ray.direction.x);
    const DoubleFloat dy = from_float(ray.direction.y);
    const DoubleFloat dz = from_float(ray.direction.z);

    const DoubleFloat a = add_scaled(add_scaled(multiply_double_float(dx, dx), dy, dy), dz, dz);
    const DoubleFloat b = add_scaled(add_scaled(multiply_double_float(ox, dx), oy, dy), oz, dz);
    const DoubleFloat minus_r2 = negate_double_float(two_product(radius, radius));
    const DoubleFloat c = add_scaled(add_scaled(add_scaled(minus_r2, ox, ox), oy, oy), oz, oz);
    const DoubleFloat discriminant = add_double_float(multiply_double_float(b, b), negate_double_float(multiply_double_float(a, c)));
    if (!(discriminant.high >= 0.0f)) return no_candidate();

    const float root = square_root(discriminant.high);
    const int centre_is_behind = b.high > 0.0f;
    const float q = centre_is_behind ? -(b.high + root) : root - b.high;
    const float first = divide(q, a.high);
    const float second = divide(c.high, q);
    const float near_t = centre_is_behind ? first : second;
    const float far_t = centre_is_behind ? second : first;

    Candidate candidate = no_candidate();
    candidate.t = near_t >= ray.t_min && near_t <= ray.t_max ? near_t : far_t;
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
