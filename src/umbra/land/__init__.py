"""
The land around a model: rasters of heights, and the horizon that they make.

    rays.py       geodesics in a raster's cells           Eye, make_rays
    march.py      kernels: the highest slope along them
    peaks.py      kernels: what is higher between them    raise_peaks
    raster.py     the raster: place, unit, blocks         LandFile
    view.py       what eyes see of it, in a child         view_land
    horizon.py    the horizon of a place                  find_horizon
    named_land.py the horizon that a caller named         settle_horizon
"""
