// +1 or -1 added to a float target: counts beyond the stencil's 255.

uniform float front;  // of a face that turns its front to the eye; its back adds the opposite

layout(location = 0) out float count;

void main() {
    count = gl_FrontFacing ? front : -front;
}
