"""Weng's figure 16: a cube and a sphere before a wall and over a floor."""

import numpy as np
from PIL import Image, ImageDraw

from umbra.cpu.frame import FrameCounter
from umbra.rays.depth import NOTHING
from umbra.scene import Camera, Mesh, Part, make_scene, point_light
from umbra.soft import ball_light, find_method
from umbra_benchmarks.scenes import make_ball, make_boxes

__all__ = ["draw_figure_16"]

_LIGHT = ball_light(point_light((2.6, -4.5, 5.0)), 0.35)
_EYE, _TARGET = np.array([-1.5, -8.5, 3.6]), np.array([-0.2, 1.5, 1.3])
_HOW = {"hard": {}, "weng": {"length": 3.0, "gap": 0.3}, "wedges": {}}


def draw_figure_16(size: tuple[int, int]) -> Image.Image:
    """Draw cube and sphere across, by hard shadows, layers and wedges down; ``size`` of each."""
    cube, ball = make_boxes([[0, 0, 0]], [[0.8] * 3]), make_ball(30, 30)
    wall = Part("wall", "", Mesh(*make_boxes([[0.0, 3.4, 2.5]], [[6.0, 0.2, 2.5]])))
    camera = Camera(_EYE, _TARGET, size=size, fov=45.0)
    sheet = Image.new("L", (2 * size[0], len(_HOW) * size[1]), 255)
    pen = ImageDraw.Draw(sheet)
    for across, (name, (vertices, faces)) in enumerate((("cube", cube), ("sphere", ball))):
        caster = Part(name, "", Mesh(vertices + (0.0, 0.0, 1.3), faces))
        counter = FrameCounter(make_scene([caster, wall]), ground=0.0)
        view, frame = counter.see(camera)
        way = _LIGHT.light.position[:3] - frame.position
        slant = np.abs((frame.normal * way).sum(-1)) / np.linalg.norm(way, axis=-1)
        slant *= frame.lit(np.zeros(view.face.shape, np.int32), _LIGHT.light)
        for down, (how, options) in enumerate(_HOW.items()):
            if how == "hard":
                share = counter.count(view, camera, _LIGHT.light) == 0
            else:
                share = find_method(how)(counter, view, frame, camera, _LIGHT, **options)
            value = np.where(view.face == NOTHING, 255, 40 + 200 * np.nan_to_num(share * slant))
            corner = across * size[0], down * size[1]
            sheet.paste(Image.fromarray(value.astype(np.uint8)), corner)
            pen.text((corner[0] + 6, corner[1] + 2), f"{name}, {how}", fill=0)
    return sheet
