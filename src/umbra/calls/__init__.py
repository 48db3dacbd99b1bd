"""
What Python calls, where it is more than one room's work: the functions that commands call, too.

    picture.py   what `umbra render` draws                      render
    study.py     a shadow study, and what it gives (result.py)  shadow_study
    window.py    the window of `umbra view`, or a picture       show
    counts.py    points and lights of one's own                 count
                 shadows on a plane as polygons                 shadow_polygons
    options.py   the options of pictures and windows; the commands' are made from them
    arguments.py scenes, cameras and lights that calls are given, checked

Importing this room, or the options, loads no numpy: the commands' help needs none.
"""
