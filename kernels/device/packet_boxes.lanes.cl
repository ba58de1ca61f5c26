// The interval test of a bundle against CASTOR_LANES boxes (see lanes.cl).
#include "device/intersect_box.lanes.cl"
#include "device/packet.cl"

CASTOR_INLINE Real LANES(least_entry)(const Real plane, const float least, const float greatest,
                                      const float entry_of_least, const float entry_of_greatest)
{
    return LANES(smaller)(fma(plane, (Real)(least), (Real)(entry_of_least)),
                          fma(plane, (Real)(greatest), (Real)(entry_of_greatest)));
}

CASTOR_INLINE Real LANES(greatest_exit)(const Real plane, const float least, const float greatest,
                                        const float exit_of_least, const float exit_of_greatest)
{
    return LANES(larger)(fma(plane, (Real)(least), (Real)(exit_of_least)),
                         fma(plane, (Real)(greatest), (Real)(exit_of_greatest)));
}

// Returns bounds of when rays of the bundle are in boxes, no later than `limit`; entry > exit: none is. Near planes are
// those of the bundle.
CASTOR_INLINE LANES(Interval)
    LANES(packet_interval)(const Packet *packet, const LANES(BoxPlanes) planes, const float limit)
{
    const float3 least = packet->least_inverse, greatest = packet->greatest_inverse;
    const float3 entry_of_least = packet->entry_of_least, entry_of_greatest = packet->entry_of_greatest;
    const float3 exit_of_least = packet->exit_of_least, exit_of_greatest = packet->exit_of_greatest;
    const Real entry_x = LANES(least_entry)(planes.near_x, least.x, greatest.x, entry_of_least.x, entry_of_greatest.x);
    const Real entry_y = LANES(least_entry)(planes.near_y, least.y, greatest.y, entry_of_least.y, entry_of_greatest.y);
    const Real entry_z = LANES(least_entry)(planes.near_z, least.z, greatest.z, entry_of_least.z, entry_of_greatest.z);
    const Real exit_x = LANES(greatest_exit)(planes.far_x, least.x, greatest.x, exit_of_least.x, exit_of_greatest.x);
    const Real exit_y = LANES(greatest_exit)(planes.far_y, least.y, greatest.y, exit_of_least.y, exit_of_greatest.y);
    const Real exit_z = LANES(greatest_exit)(planes.far_z, least.z, greatest.z, exit_of_least.z, exit_of_greatest.z);
    LANES(Interval) interval;
    interval.entry =
        LANES(larger)(LANES(larger)(entry_x, entry_y), LANES(larger)(entry_z, (Real)(packet->least_t_min)));
    interval.exit = LANES(smaller)(LANES(smaller)(exit_x, exit_y), LANES(smaller)(exit_z, (Real)(limit)));
    return interval;
}
