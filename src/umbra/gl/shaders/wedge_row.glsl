// What an edge's row of a table holds: its ends, the normals of its wedge's four planes, and, for
// spots, those of its two faces. Half its weight and its turn lie beside the ends.

#ifdef HAS_SPOTS
const int TEXELS = 8;
#else
const int TEXELS = 6;
#endif
