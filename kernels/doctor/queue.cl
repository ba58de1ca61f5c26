// What queues, events and atomics are tried with by castor doctor.
#include "castor/shared/layout.h"

// Doubles and adds one: no two orders of launches give the same.
kernel void next_value(const uint count, const uint addend, global uint *restrict values)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    values[i] = values[i] * 2u + addend;
}

// Every work-item a number of its own.
kernel void take_tickets(const uint count, volatile global uint *restrict counter, global uint *restrict tickets)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    tickets[i] = atomic_inc(counter);
}

// `rounds` dependent steps.
kernel void work(const uint count, const uint rounds, global uint *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    uint x = i;
    for (uint k = 0; k < rounds; ++k) x = x * 1664525u + 1013904223u;
    results[i] = x;
}
