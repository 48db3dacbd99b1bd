"""
The interactive viewer: a window to view, light and measure a scene.

    ViewState -> ViewPainter -> Viewer
    frozen       a picture      glfw, Dear ImGui
      ^                        |
      +---- Controls, panel ---+

``ViewState`` is the complete state of a view, a frozen record independent of any window.
``Controls`` (mouse and keys) and the panel turn events into a new view; ``ViewPainter`` draws
a view on OpenGL; ``Viewer`` owns the loop. glfw and imgui-bundle are imported only in
``window.app`` and ``window.panel``.
"""
