"""
The exact sky of a point: no patch, no ray, no sector.

Data flows one way::

    casters -> skyline -> gather -> events -> sweep -> tensors, outlines -> view
    a scene    what is    faces     order     pieces   integrals, loops     SkyView
               hidden     as seen   changes   of free
                                              sky

``wall_cover`` and ``occluders`` say what walls and faces add to what is hidden. ``view_factors``
measures many points at once, ``nearest`` says what takes the rest.
"""
