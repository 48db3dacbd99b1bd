// Hours on a raster as a surface: each stands as high above the ground as it is long.

uniform samplerBuffer raster;  // hours, row by row; below 0 where the ground is covered
uniform int cols;
uniform vec3 corner;           // centre of the first cell, relative to the eye
uniform vec2 cell;
uniform float lift;            // metres an hour
uniform mat4 projection;

out float hours;
out float open;                // 1 where no corner is covered
out vec3 at;

invariant gl_Position;

const ivec2 CORNERS[6] = ivec2[6](ivec2(0, 0), ivec2(1, 0), ivec2(1, 1),
                                  ivec2(0, 0), ivec2(1, 1), ivec2(0, 1));

void main() {
    int first = gl_VertexID / 6;
    ivec2 place = ivec2(first % (cols - 1), first / (cols - 1)) + CORNERS[gl_VertexID % 6];
    float found = texelFetch(raster, place.y * cols + place.x).r;
    open = found < 0.0 ? 0.0 : 1.0;
    hours = max(found, 0.0);
    at = corner + vec3(cell * vec2(place), lift * hours);
    gl_Position = projection * vec4(at, 1.0);
}
