// The planes of features that kernels/denoise_level.lanes.cl reads and host/render/denoise.cpp fills.
#ifndef CASTOR_SHARED_DENOISE_PLANES_H
#define CASTOR_SHARED_DENOISE_PLANES_H

#define CASTOR_DENOISE_MARGIN 32           // pixels around the picture: two of the largest step
#define CASTOR_DENOISE_NORMAL 0            // three: the mean shading normal
#define CASTOR_DENOISE_POSITION 3          // three: the mean position in the world
#define CASTOR_DENOISE_ALBEDO_RGB 6        // three
#define CASTOR_DENOISE_NORMAL_FACTOR 9     // of the squared difference of normals
#define CASTOR_DENOISE_DISTANCE_FACTOR 10  // of the squared distance from the plane of the pixel's surface
#define CASTOR_DENOISE_FEATURES 11

#endif
