"""
Ground of a model, one for studies, pictures, windows, pages and tiles.

    feet.py           where each building stands
    level.py          terrain that files bring; the height of level ground
    triangulation.py  triangles that hold given edges
    surface.py        the surface through the feet
    choice.py         which of these is the ground
"""
