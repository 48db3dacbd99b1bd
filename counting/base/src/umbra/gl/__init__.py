"""
The OpenGL 3.3 core device, in hardware or software.

    Scene --> Geometry: points         Camera --> CameraProjection
                 |                                    |
              Body: shells and edges --> Planner <----+
                                           |  for each light:
                                           |  KeptLight, BodyVolumes: sides and caps, on demand
                                           |  select_lights: what to draw, in McGuire's cases
                                           |  bound_nearby: whether 8 bits hold the count
                                           v
    SceneRenderer --> surfaces --> Target   VolumePlan: draws of one index list
                                |          |
                                +--------> VolumeCounter: the stencil, or floats
                                           |
              LightPasses: light where it is 0, or GlFrameCounter and GlSweep: counts read back

``Device`` is a context and its capabilities, ``Target`` a framebuffer, ``State`` the sole
owner of OpenGL state, and ``Program`` shaders from ``shaders/``. Soft shadows are in ``soft``,
masks without a stencil in ``masks``. Only this package imports moderngl, when first needed.
"""
