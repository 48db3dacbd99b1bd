// What an edge's row of a table holds: its ends, the normals of its wedge's four planes, and those of
// its two faces. Half its weight and its turn lie beside the ends.

const int TEXELS = 8;
