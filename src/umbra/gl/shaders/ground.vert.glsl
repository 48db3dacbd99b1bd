// The plane z = height without end: four triangles from below the eye to infinity.

uniform mat4 projection;
uniform float height;  // relative to the eye

invariant gl_Position;

const vec2 WAYS[4] = vec2[4](vec2(1, 0), vec2(0, 1), vec2(-1, 0), vec2(0, -1));

void main() {
    int way = gl_VertexID / 3 + gl_VertexID % 3;
    vec4 far_away = vec4(WAYS[(way + 3) % 4], 0.0, 0.0);
    gl_Position = projection * (gl_VertexID % 3 == 0 ? vec4(0.0, 0.0, height, 1.0) : far_away);
}
