// No layer of a component falls on that component.

uniform isampler2D shown;  // which component each pixel shows

flat in int component;

bool is_own() {
    return texelFetch(shown, ivec2(gl_FragCoord.xy), 0).r == component;
}
