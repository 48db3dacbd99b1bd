"""The renderer of umbra.web in a real browser: pages, models, counts."""

import base64
import json
from pathlib import Path

import numpy as np

from umbra.web.bundle import bundle
from umbra.web.pack import pack_model

SMALL = (320, 200)
"""A page's own shape, for its picture where there is no WebGL: in full that takes a second."""

SCRIPT = """
window.load = async (base64, width, height, options) => {
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  window.model = await window.unpackModel(bytes);
  const canvas = document.getElementById('c');
  canvas.style.width = width + 'px'; canvas.style.height = height + 'px';
  window.picture?.dispose();
  window.picture = new window.Renderer(canvas, window.model, options);
};
window.encode = (array) => {
  const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
  let text = '';
  for (let i = 0; i < bytes.length; i += 8192) {
    text += String.fromCharCode(...bytes.subarray(i, i + 8192));
  }
  return btoa(text);
};
"""


class Picture:
    """A canvas with a model, asked from Python."""

    def __init__(self, page):
        self.page = page

    def load(self, scene, size, site=None, **options):
        self.size = size
        block = base64.b64encode(pack_model(scene, site)).decode()
        width, height = size
        self.page.ask(f"load('{block}', {width}, {height}, {json.dumps(options)})")

    def set(self, name, value):
        self.page.ask(f"picture.{name} = {json.dumps(value)}")

    def count(self, light=0, times="undefined"):
        found = self.page.ask(f"encode(picture.readCounts({light}, {times}))")
        cols, rows = self.size
        return np.frombuffer(base64.b64decode(found), np.int32).reshape(rows, cols)

    def draw(self):
        self.page.ask("picture.draw()")
        return self.page.ask("picture.statistics")


def make_page(folder):
    """Write a page with the renderer alone, and return its path."""
    exports = {"model": "unpackModel", "renderer": "Renderer", "sun_masks": "SunMasks",
               "moved": "Proposal"}  # fmt: skip
    scripts = [f"{{ {bundle(module)} window.{name} = ${module}.{name}; }}"
               for module, name in exports.items()]  # fmt: skip
    script = "\n".join([*scripts, SCRIPT])
    file = Path(folder, "picture.html")
    body = "<body style='margin:0'><canvas id=c></canvas>"
    file.write_text(f"<!doctype html><meta charset=utf-8>{body}<script>{script}</script>")
    return file


def describe_camera(camera, scene):
    """Give a camera as the renderer takes it, about a packed scene's origin."""
    said = {name: list(getattr(camera, name)) for name in ("eye", "target", "up")}
    for name in ("eye", "target"):
        said[name] = (np.array(said[name]) - scene.origin).tolist()
    lens = {"fov": camera.fov} if camera.height is None else {"height": camera.height}
    return {**said, **lens, "near": camera.near}


def describe_light(light, scene):
    """Give a light as the renderer takes it."""
    x, y, z, w = light.position.tolist()
    if w:
        return {"position": (np.array([x, y, z]) - scene.origin).tolist()}
    return {"direction": [x, y, z]}


def unpack(picture):
    """Give the vertices and faces that the browser unpacked."""
    places, faces = (
        np.frombuffer(base64.b64decode(picture.page.ask(f"encode(model.{name})")), kind)
        for name, kind in (("places", np.float64), ("faces", np.uint32))
    )
    return places.reshape(-1, 3), faces.reshape(-1, 3)
