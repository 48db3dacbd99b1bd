// How far behind the near plane a place in clip space is; below 0 it is before it.

uniform vec2 near_plane;  // factors of z and w, by how depth runs in the clip space

float find_distance(vec4 place) {
    return near_plane.x * place.z + near_plane.y * place.w;
}
