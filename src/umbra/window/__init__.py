"""
The interactive viewer: a window in which a scene is looked at, lit and measured.

    ViewState -> ViewPainter -> Viewer
    frozen       a picture      glfw, Dear ImGui
      ^                        |
      +---- Controls, panel ---+

``ViewState`` is all that can be seen and chosen, a frozen record that knows no window.
``Controls`` (mouse and keys) and the panel turn events into another view; ``ViewPainter`` draws
a view on OpenGL; ``Viewer`` owns the loop. glfw and imgui-bundle are imported in
``window.app`` and ``window.panel`` alone.
"""
