"""How far a device's own rounding bears a method: asked of the device, not assumed."""

from umbra.gl.context import Device
from umbra.gl.masks.method import Method
from umbra.gl.masks.painter import Painter
from umbra.gl.state import Pass, State
from umbra.gl.target import Target

__all__ = ["find_limit"]

_DEEPEST = 2  # of the states before: lit, in one shadow, in two


def find_limit(device: Device, method: Method, painter: Painter) -> int:
    """
    Find how many fronts and backs may come at once before lit and shaded are confused.

    A pixel is taken through all the states and back in the method's own target, for it is
    the driver that says whether 255 / 2 is 127 or 128.

    Parameters
    ----------
    device : Device
    method : Method
    painter : Painter

    Returns
    -------
    limit : int
        At most ``method.at_once``; 0 if the method does not work here at all.
    """
    steps = (method.up, method.down)
    first, second = steps if method.first == "up" else steps[::-1]
    with Target(device, (1, 1), (method.format,)) as target, State(device) as state:
        for limit in range(method.at_once):
            for before in range(_DEEPEST + 1):
                target.use()
                state.use(Pass(color_write=True))
                target.clear_color(method.start)
                for step in [method.up] * before + [first] * (limit + 1) + [second] * (limit + 1):
                    painter.draw_rectangle(state, step, method.write)
                for step in method.black:
                    painter.draw_rectangle(state, step, method.write)
                value = float(target.read()[0, 0, method.channel])
                value /= 255.0 if method.format == "rgba8" else 1.0
                # Half of 255 is not exact: what was lit is 254 or 255 again.
                is_lit = method.lit[0] <= value <= method.lit[1]
                if is_lit != (before == 0):
                    return limit
    return method.at_once
