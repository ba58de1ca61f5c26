// One work-item a pixel. Writes its mean over the samples, three floats a pixel.
#include "castor/shared/wave_columns.h"
#include "device/exact.cl"

kernel void resolve(const uint pixel_count, const uint sample_count, CASTOR_READ(film_sum), CASTOR_WRITE(pixel_means))
{
    const uint pixel = get_global_id(0);
    if (pixel >= pixel_count) return;
    const float count = (float)sample_count;
    const float3 sum = film_sum[pixel].xyz;
    const float3 mean = (float3)(divide(sum.x, count), divide(sum.y, count), divide(sum.z, count));
    vstore3(mean, pixel, pixel_means);
}
