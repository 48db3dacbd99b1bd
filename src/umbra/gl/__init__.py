"""
The device that draws with OpenGL 3.3 core, in hardware or software.

    Device -> Target -> State, Program -> Volumes -> stencil or float counts

``Device`` is a context and its facts, ``Target`` a framebuffer, ``State`` the one owner
of what is enabled, ``Program`` shaders from ``shaders/``, and ``Volumes`` the casters of
a scene and their shadow volumes. Only this room imports moderngl, when first needed.
"""
