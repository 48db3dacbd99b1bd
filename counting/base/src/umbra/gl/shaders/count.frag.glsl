// +1 or -1 added to a float target: counts beyond the stencil's 255.

#ifdef GROWS
#include "own.glsl"
#endif

uniform float front;  // of a face that turns its front to the eye; its back adds the opposite

layout(location = 0) out float count;

void main() {
#ifdef GROWS
    if (is_own()) {
        discard;
    }
#endif
    count = gl_FrontFacing ? front : -front;
}
