// Even light of sky and ground, as much of each as a surface faces.

uniform vec3 from_sky, from_ground;

vec3 find_ambient(vec3 normal) {
    return mix(from_ground, from_sky, 0.5 + 0.5 * normal.z);
}
