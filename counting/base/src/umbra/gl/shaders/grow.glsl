// Where a point of an enlarged caster is: scaled layers of a shadow volume (soft/weng.py).
//
// Each component grows across the way from its silhouette's centre to the light, which stays
// where it is: lit faces stay lit, and one list of triangles serves all layers.

uniform samplerBuffer growth;  // for each component: centre, how deep it sinks; way to the light
uniform int growth_row;        // the light's first
uniform float growing;         // 0 is the caster itself

flat out int component;

vec3 find_point(int point) {
    vec4 at = texelFetch(points, point);  // in the scene's frame, and the component's number
    component = int(at.w);
    vec4 center = texelFetch(growth, 2 * (growth_row + component));
    vec3 axis = texelFetch(growth, 2 * (growth_row + component) + 1).xyz;
    if (axis != vec3(0.0)) {
        vec3 apart = at.xyz - center.xyz;
        at.xyz += growing * (apart - dot(apart, axis) * axis) - center.w * axis;
    }
    return (at.xyz - eye_high) - eye_low;
}
