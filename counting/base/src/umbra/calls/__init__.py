"""
Python API calls that span several packages; commands call them, too.

    picture.py   pictures of `umbra render`                     render
    study.py     a shadow study, and its result (result.py)     shadow_study
    window.py    the window of `umbra view`, or a picture       show
    counts.py    given points and lights                        count
                 shadows on a plane as polygons                 shadow_polygons
    option_fields.py   options of pictures and windows, also for the commands
    arguments.py checks of scenes, cameras and lights

Importing this package, or the options, loads no numpy: the commands' help needs none.
"""
