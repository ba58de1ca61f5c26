// How RenderParams.flags tells the order in which pixels share samples (see SampleOrder in renderer.h).
#ifndef CASTOR_SHARED_SAMPLE_ORDER_H
#define CASTOR_SHARED_SAMPLE_ORDER_H

// The bits from here on are 0: each pixel has its own samples; or n + 1: pixels share a sequence along a Z curve, each
// with 2^n samples in a row.
#define CASTOR_Z_ORDER_SHIFT 26u

#endif
