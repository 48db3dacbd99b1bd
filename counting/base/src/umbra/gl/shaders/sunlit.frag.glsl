// So many hours where a surface is turned to a sun, in what the stencil leaves.

uniform sampler2D places;  // normals and depth keys
uniform vec3 sun;
uniform float hours;

layout(location = 0) out vec4 added;

void main() {
    vec4 seen = texelFetch(places, ivec2(gl_FragCoord.xy), 0);
    added = vec4(dot(seen.xyz, sun) > 0.0 ? hours : 0.0);
}
