"""
Vectors: shadow outlines of each instant and lines of equal hours, for GIS and CAD.

``loops.py`` assembles silhouettes into loops, ``outlines.py`` resolves them into
polygons, ``hour_lines.py`` finds contours, ``places.py`` knows the CRS; ``geojson.py``,
``geopackage.py`` and ``dxf.py`` write what they find.
"""
