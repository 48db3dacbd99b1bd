"""
The interactive viewer: a window in which a scene is looked at, lit and measured.

    View  ->  Painter  ->  Window
    frozen    a picture    glfw, Dear ImGui
      ^                      |
      +----- Controls, panel-+

``View`` is all that can be seen and chosen, a frozen record that knows no window.
``Controls`` (mouse and keys) and the panel turn events into another view; ``Painter`` draws
a view on OpenGL; ``Window`` owns the loop. glfw and imgui-bundle are imported in
``window.app`` and ``window.panel`` alone.
"""
