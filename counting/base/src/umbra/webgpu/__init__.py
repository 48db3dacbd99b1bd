"""
WebGPU: the same plans, counted by wgpu on Vulkan, Metal, Direct3D or OpenGL.

    adapter.py        the device, with the features that counting needs
    frame_counter.py  visible faces and counts of frames, as the gl device's
    shaders/          surface.wgsl, volume.wgsl

Volumes come as the arrays of ``umbra.gl.plan_arrays``, which know no graphics API.
"""
