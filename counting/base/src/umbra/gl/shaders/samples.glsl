// A picture with one sample a pixel, or HAS_SAMPLES, of which one is fetched.

#ifdef HAS_SAMPLES
#define PICTURE sampler2DMS
uniform int which;
#else
#define PICTURE sampler2D
const int which = 0;  // level of detail
#endif
