// One more step in shadow where the surface is turned from the sun.

uniform isampler2D faces;        // which face each cell sees, negative where it is the ground
uniform samplerBuffer planes;    // its outward normal as the file winds it
uniform vec3 sun;

layout(location = 0) out float steps;

void main() {
    int face = texelFetch(faces, ivec2(gl_FragCoord.xy), 0).r;
    vec3 normal = face < 0 ? vec3(0.0, 0.0, 1.0) : texelFetch(planes, face).xyz;
    // Seen from above its upper side shows, however it is wound.
    if (dot(normal, sun) * (normal.z < 0.0 ? -1.0 : 1.0) > 0.0) {
        discard;
    }
    steps = 1.0;
}
