// Which random numbers samples have, as host and kernels know it.
#ifndef CASTOR_SHARED_SAMPLE_ORDER_H
#define CASTOR_SHARED_SAMPLE_ORDER_H

// How RenderParams.flags tells the order in which pixels share samples (see SampleOrder in renderer.h).
// The bits from here on are 0: each pixel has its own samples; or n + 1: pixels share a sequence along a Z curve, each
// with 2^n samples in a row.
#define CASTOR_Z_ORDER_SHIFT 26u

// Added to CASTOR_DIMENSION_OPACITY and those that follow it: how many surfaces the ray has passed before, or how often
// it was scattered within a solid. Of surfaces that are there in part two that follow each other have the coordinates
// of one point: the second one where CASTOR_SECOND_COORDINATE is set. No other dimension of path tracing is as large as
// CASTOR_FIRST_PASSED.
#define CASTOR_SECOND_COORDINATE 256u
#define CASTOR_FIRST_PASSED 512u
#define CASTOR_OPACITY_DIMENSION(dimension, passed_count) ((dimension) + CASTOR_FIRST_PASSED + 256u * (passed_count))

#endif
