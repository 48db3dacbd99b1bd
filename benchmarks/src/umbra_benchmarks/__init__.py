"""
Measuring umbra against its peers: ``umbra bench``.

Each benchmark runs umbra and a peer in turn in one process, so that whatever
slows the machine slows both, and compares their answers as well as their times::

    scenes -> study, frame, silhouette -> measure -> report
    meshes    what is run                 in turn    medians and ratios

Peers that draw with OpenGL have processes of their own and answer through pipes::

    scenes -> gl_frame -> ours_gl
                       -> peer -> peers/ogre.py, peers/workbench.py
"""

__version__ = "0.2.0"
