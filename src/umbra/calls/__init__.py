"""
What Python calls, where it is more than one room's work: the functions that commands call, too.

    inputs.py    scenes, cameras and lights as they are given   make_camera
    picture.py   what `umbra render` draws, and its options     render
    study.py     a shadow study, and what it gives (result.py)  shadow_study
    window.py    the window of `umbra view`, or a picture       show
    counts.py    points and lights of one's own                 count
    outlines.py  shadows on a plane as polygons                 shadow_polygons
"""
