// Where a vertex is: at its place, or extruded away from the light to infinity or the floor.
//
// A vertex number v of an index list names the point v / 2. Even numbers stand for the point
// itself, odd ones for its counterpart at the far end of the shadow volume: no vertex data
// travels when a light moves, only indices. A block of 64 points shares an entry that says
// where their coordinates are stored and which transform moves them, so that instances
// share one copy of a mesh and everything is still one draw.

uniform samplerBuffer points;      // x, y, z in the mesh's own frame; of what grows see grow.glsl
uniform isamplerBuffer blocks;     // what to add to a point's number; transform, or -1
uniform samplerBuffer transforms;  // three rows each, to the scene's frame
uniform vec3 eye_high, eye_low;    // the eye in the scene's frame, in two parts
uniform mat4 projection;           // from coordinates relative to the eye to the clip space
uniform vec4 light;                // homogeneous, relative to the eye
uniform float bottom;              // z relative to the eye at which volumes end
uniform bool is_cut;               // at the bottom, or else at infinity
uniform float top;                 // z relative to the eye at which volumes begin
uniform bool is_low;               // at the top, or else at the points

const int FAR_END = 1;
const int BLOCK_BITS = 6;

#ifdef GROWS
#include "grow.glsl"
#else
vec3 find_point(int point) {
    ivec2 block = texelFetch(blocks, point >> BLOCK_BITS).xy;
    vec4 at = vec4(texelFetch(points, point + block.x).xyz, 1.0);
    if (block.y >= 0) {
        int row = 3 * block.y;
        at.xyz = vec3(dot(texelFetch(transforms, row), at),
                      dot(texelFetch(transforms, row + 1), at),
                      dot(texelFetch(transforms, row + 2), at));
    }
    return (at.xyz - eye_high) - eye_low;
}
#endif

#ifdef HAS_NEARBY
uniform samplerBuffer nearby;  // place in the scene's frame, way from the light
uniform int first_nearby;      // point from which on they are meant
#endif

#ifdef HAS_LEVELS
uniform vec2 slack;  // how far behind a level of detail its volume begins; for each metre more
#endif

// Where the ray from a point that goes down is at a height.
vec4 cut_at(float height, vec3 at, vec3 away) {
    // at + away * (height - at.z) / away.z, times -away.z, which is positive
    return vec4(-away.z * at + (at.z - height) * away, -away.z);
}

vec4 find_place(int vertex) {
#ifdef HAS_NEARBY
    int row = 2 * ((vertex >> 1) - first_nearby);
    vec3 at, away;
    if (row >= 0) {
        at = (texelFetch(nearby, row).xyz - eye_high) - eye_low;
        away = texelFetch(nearby, row + 1).xyz;
    } else {
        at = find_point(vertex >> 1);
        away = light.w * at - light.xyz;
    }
#else
    vec3 at = find_point(vertex >> 1);
    vec3 away = light.w * at - light.xyz;
#endif
    if ((vertex & FAR_END) == 0) {
        if (is_low) {
            return cut_at(top, at, away);
        }
#ifdef HAS_LEVELS
        at += (slack.x + slack.y * length(at)) * normalize(away);
#endif
        return vec4(at, 1.0);
    }
    if (is_cut) {
        return cut_at(bottom, at, away);
    }
    return vec4(away, 0.0);
}
