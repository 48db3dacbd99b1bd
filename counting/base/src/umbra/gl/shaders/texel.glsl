// Which texel lies at a place beyond a texture: 0 repeats, 1 mirrors, 2 clamps.

int wrap_texel(int at, int count, int how) {
    if (how == 2) {
        return clamp(at, 0, count - 1);
    }
    int period = how == 0 ? count : 2 * count;
    at -= period * int(floor((float(at) + 0.5) / float(period)));
    return how == 0 ? at : min(at, 2 * count - 1 - at);
}
