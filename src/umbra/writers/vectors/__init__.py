"""
Vectors: shadow outlines of each instant and lines of equal hours, for GIS and CAD.

``outlines.py`` finds the polygons of shadows, ``layers.py`` lines of equal hours and the layers
of all; ``gis_files.py`` writes GeoJSON, GeoPackage and GeoTIFF by the model's CRS, ``dxf.py`` CAD.
"""
