"""
The OpenGL 3.3 core device, in hardware or software.

    Device -> Target -> State, Program -> Volumes -> stencil or float counts

``Device`` is a context and its capabilities, ``Target`` a framebuffer, ``State`` the sole
owner of OpenGL state, ``Program`` shaders from ``shaders/``, and ``Volumes`` the casters of
a scene and their shadow volumes. Only this package imports moderngl, when first needed.
"""
