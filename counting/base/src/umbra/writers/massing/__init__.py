"""
Files of an envelope of heights.

    folder.py       which files are written
    files.py        GeoTIFF, OBJ, GLB, CityJSON
    picture.py      the sheet: plan with heights, axonometry
    axonometry.py   a shaded parallel view
"""
