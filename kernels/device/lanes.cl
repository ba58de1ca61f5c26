// The words in which a function is written once for any number of lanes.
//
// OpenCL C 1.2 has no generic functions. So a file NAME.lanes.cl is a template: its text is for CASTOR_LANES lanes. To
// include "device/NAME.x4.cl" inserts it for 4 lanes, once in a program. 1, 4, 8 and 16 are possible, as far as simd.cl
// has the operations that a template needs; those of waves are for 1 and 16. Never put such an include under #if. A
// template that needs another one for the same number of lanes includes it as "device/OTHER.lanes.cl"
// (host/opencl/kernel_source.cpp does the work). A build log names the template and its line, and the number of lanes
// stands in the names of its functions.
//
//   Real, Whole, Int   float4, uint4 and int4 for 4 lanes; float, uint and int for one lane
//   Mask               the same as Int, for truth values
//   LANES(name)        name4 for 4 lanes, and name itself for one lane; a template defines and calls its functions so.
//                      The host replaces these five, which are not macros. They have no prefix CASTOR_, as they stand
//                      in nearly every line.
//   (Real)(x)          x in every lane
//   c ? a : b          chooses lane by lane, where c is a Mask
//   & | !              combine masks. Never use ~: true is -1 in a vector and 1 in a single lane.
//
// An early return is possible where mask_of (simd.cl) says that no lane goes on. What a lane computes must not
// depend on its neighbours: then hits are the same, bit for bit, however many lanes computed them.
#include "castor/shared/layout.h"

#define CASTOR_PASTE(a, b) a##b
#define CASTOR_PASTE_EXPANDED(a, b) CASTOR_PASTE(a, b)

// Marks a large function of a template. PoCL makes three copies of a kernel, with all that is inlined into it, and
// compiles each: where there are lanes, for which a call costs little, such a function is not inlined. For one lane it
// is. A large kernel hands all of its arguments on to such a function.
#define CASTOR_ONCE CASTOR_PASTE_EXPANDED(CASTOR_ONCE_, CASTOR_LANES)
#define CASTOR_ONCE_1 CASTOR_INLINE
#define CASTOR_ONCE_16 CASTOR_NOINLINE

// Mark a kernel that computes in vectors, so that a compiler that puts work-items into the lanes of vectors, as Intel's
// does for CPUs, leaves it as it is. Otherwise it takes minutes, not seconds, to compile closest_hit_packet.
#define CASTOR_IN_LANES CASTOR_PASTE_EXPANDED(CASTOR_IN_LANES_, CASTOR_LANES)  // a template
#define CASTOR_IN_LANES_1 __attribute__((vec_type_hint(float)))
#define CASTOR_IN_LANES_16 CASTOR_IN_VECTORS
#define CASTOR_IN_VECTORS __attribute__((vec_type_hint(float16)))
