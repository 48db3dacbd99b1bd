// Even light of sky and ground, as much of each as a surface faces.

vec3 find_ambient(vec3 normal) {
    return mix(FROM_GROUND, FROM_SKY, 0.5 + 0.5 * normal.z);
}
