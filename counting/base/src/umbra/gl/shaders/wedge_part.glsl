// What part of a light an edge takes: Q over the light's area, as umbra/soft/parts.py says.
//
// The edge's line comes by its own three numbers: ends may be a million radii away, where
// it comes near to what is seen, and would leave no digits for how far the line is off.

#ifdef IS_SQUARE
int clip(in vec2 corners[8], int n, vec3 line, out vec2 kept[8]) {
    int count = 0;
    for (int i = 0; i < n; ++i) {
        vec2 one = corners[i], two = corners[i + 1 < n ? i + 1 : 0];
        float here = dot(line, vec3(one, 1.0)), there = dot(line, vec3(two, 1.0));
        if (here >= 0.0) {
            kept[count++] = one;
        }
        if ((here >= 0.0) != (there >= 0.0)) {
            kept[count++] = mix(one, two, here / (here - there));
        }
    }
    return count;
}

float find_part(vec3 line, vec2 a, vec2 b) {
    if (line.z == 0.0) {
        return 0.0;
    }
    float side = line.z > 0.0 ? 1.0 : -1.0;
    vec3 beyond = -side * line;
    if (abs(beyond.x) + abs(beyond.y) + beyond.z <= 0.0) {
        return 0.0;
    }
    vec2 one[8], two[8];
    one[0] = vec2(-1.0, -1.0);
    one[1] = vec2(1.0, -1.0);
    one[2] = vec2(1.0, 1.0);
    one[3] = vec2(-1.0, 1.0);
    int n = clip(one, 4, beyond, two);
    n = clip(two, n, side * vec3(-a.y, a.x, 0.0), one);
    n = clip(one, n, side * vec3(b.y, -b.x, 0.0), two);
    float area = 0.0;
    for (int i = 0; i < n; ++i) {
        vec2 here = two[i], there = two[i + 1 < n ? i + 1 : 0];
        area += here.x * there.y - here.y * there.x;
    }
    return 0.125 * abs(area);
}
#else
const float PI = 3.14159265358979;

float find_part(vec3 line, vec2 a, vec2 b) {
    float size = length(line.xy), d = abs(line.z) / max(size, 1e-30);
    vec2 way = vec2(line.y, -line.x) / max(size, 1e-30);
    if (d >= 1.0) {
        return 0.0;
    }
    float chord = sqrt(1.0 - d * d);
    float t0 = max(dot(a, way), -chord), t1 = min(dot(b, way), chord);
    if (t0 >= t1) {
        return 0.0;
    }
    return 0.5 * (atan(t1, d) - atan(t0, d) - d * (t1 - t0)) / PI;
}
#endif
