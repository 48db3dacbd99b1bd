// How far behind the near plane a place in clip space is; below 0 it is before it.

float find_distance(vec4 place) {
#ifdef REVERSED
    return place.w - place.z;
#else
    return 0.5 * (place.w + place.z);
#endif
}
