"""
Film the live page through a day, or show it once, as a picture of the documentation.

    python docs/film_page.py SCENE.html OUT.webp
    python docs/film_page.py SCENE.html OUT.png LINK

Chromium draws each moment of the page, which its address names, in software; the tests drive it
in the same way.
"""

import sys
import tempfile
from pathlib import Path

from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.chromium import Chromium, Page, find_chromium

DATE = "2026-03-21"
SIZE = 1200, 750
WIDTH = 800
MOMENTS = range(7 * 60, 18 * 60 + 1, 20)  # minutes of the clock
FRAME = 120  # ms
READY = "document.documentElement.dataset.ready == 'yes' && umbra.waits === 0"
FINE = (
    "umbra.waits === 0 && umbra.stage.renderer.samples === 4 && umbra.stage.canvas.width === "
    "umbra.stage.canvas.clientWidth && (!umbra.state.hasSunHours || umbra.sunHours.isWhole)"
)

scene, out = map(Path, sys.argv[1:3])
links = sys.argv[3:] or [f"at={DATE}T{minutes}" for minutes in MOMENTS]
if find_chromium() is None:
    sys.exit("film_page.py needs Chromium; on Debian and Ubuntu: apt install chromium")
frames = []
with tempfile.TemporaryDirectory() as folder, Chromium() as browser, Page(browser, *SIZE) as page:
    shot = Path(folder, "shot.png")
    page.open(scene.resolve(), READY)
    for link in links:
        # The page hears of its new address before this listener does.
        page.ask("new Promise((done) => { addEventListener('hashchange', done, {once: true}); "
                 f"location.hash = '{link}'; }}).then(() => 0)")  # fmt: skip
        page.wait(FINE)
        page.shoot(shot)
        frames.append(Image.open(shot).convert("RGB"))
if out.suffix == ".png":
    frames[0].quantize(256, dither=Image.Dither.NONE).save(out, optimize=True)
else:
    small = WIDTH, round(WIDTH * SIZE[1] / SIZE[0])
    first, *others = (frame.resize(small, Image.Resampling.LANCZOS) for frame in frames)
    first.save(
        out, save_all=True, append_images=others, duration=FRAME, loop=0, quality=70, method=6
    )
