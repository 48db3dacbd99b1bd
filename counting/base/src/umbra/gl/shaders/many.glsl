// How many lamps one draw adds, ``MOST_LAMPS`` in ``shading.py``.

const int MOST_LAMPS = 32;
