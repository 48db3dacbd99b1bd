// Only depth and stencil are touched.

#ifdef GROWS
#include "own.glsl"
#endif

void main() {
#ifdef GROWS
    if (is_own()) {
        discard;
    }
#endif
}
