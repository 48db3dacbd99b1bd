"""
Drawings as vectors: what a camera sees of a model, and its shadows, as exact polygons.

::

    regions     triangles of a part that lie in one plane
    -> covers   what lies between a region and the eye or a light, in the picture
    -> overlay  unions and differences of polygons
    -> surfaces visible part of each region, and the shadows on it
    -> lines    visible part of each edge
    -> seen     all of it together
"""

from umbra.drawing.seen import SeenModel, see_model

__all__ = ["SeenModel", "see_model"]
