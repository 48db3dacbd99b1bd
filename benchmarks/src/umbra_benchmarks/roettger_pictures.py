"""Roettger's figure 3: the mask in alpha, step by step, without a stencil."""

from collections.abc import Callable
from functools import wraps

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from umbra.gl.frame_counter import GlFrameCounter
from umbra.gl.masks import MASKS
from umbra.gl.masks.counter import MaskCounter
from umbra.gl.state import State
from umbra.scene import Camera, Mesh, Part, make_scene, point_light
from umbra_benchmarks.scenes import make_boxes

__all__ = ["draw_figure_3"]


def draw_figure_3(size: tuple[int, int]) -> Image.Image:
    """Draw the mask of two blocks as it begins, after backs, after fronts, and normalised."""
    blocks = make_boxes([[-1.2, 0.4, 1.0], [1.0, -0.6, 0.7]], [[0.6, 0.6, 1.0], [0.5, 0.5, 0.7]])
    camera = Camera(np.array([-6.0, -8.0, 6.0]), np.array([0, 0, 0.4]), size=size, fov=40.0)
    light = point_light((4.0, -3.0, 7.0))
    scene = make_scene([Part("blocks", "", Mesh(*blocks))])
    steps: list[tuple[str, NDArray[np.float32]]] = []
    with GlFrameCounter(scene, ground=0.0) as frames:
        view, _ = frames.see(camera)
        frames.count(view, camera, light, "alpha")
        counter, _ = frames.masks.choose("alpha", frames.counter)
        assert isinstance(counter, MaskCounter)
        assert frames.plan is not None
        assert frames._target is not None
        method, painter = MASKS["alpha"], counter.painter

        def watch(draw: Callable[..., None], name: str) -> Callable[..., None]:
            @wraps(draw)
            def keep(*given: object, **more: object) -> None:
                draw(*given, **more)
                mask = counter._mask.target
                assert mask is not None
                what = f"{name} {given[-1]}" if name == "faces" else name
                steps.append((what, mask.read()[..., method.channel].copy()))

            return keep

        painter._draw_batch = watch(painter._draw_batch, "faces")  # type: ignore[method-assign]
        painter.draw_rectangle = watch(painter.draw_rectangle, "rectangle")  # type: ignore[method-assign]
        with State(frames.device) as state:
            counter.count(state, frames._target, frames.plan)
    sheet = Image.new("L", (size[0] * len(steps), size[1]))
    pen = ImageDraw.Draw(sheet)
    for place, (name, mask) in enumerate(steps):
        values = np.clip(mask / (255 if mask.max() > 1 else 1), 0, 1)
        picture = Image.fromarray(np.rint(255 * values).astype(np.uint8))
        sheet.paste(picture, (place * size[0], 0))
        pen.text((place * size[0] + 6, 4), f"{place + 1} {name}", fill=128)
    return sheet
