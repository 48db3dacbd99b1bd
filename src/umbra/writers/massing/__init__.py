"""
Files of an envelope of heights.

    files.py        GeoTIFF, OBJ, GLB, CityJSON
    picture.py      the sheet: plan with heights, axonometry
    axonometry.py   a shaded parallel view
"""
