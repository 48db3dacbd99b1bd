"""
Film the live page through a day, as a moving picture of the documentation.

    python docs/film_page.py SCENE.html OUT.webp

Chromium draws each moment of the page, which its address names, in software.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

DATE = "2026-03-21"
SIZE = 1200, 750
WIDTH = 800
MOMENTS = range(7 * 60, 18 * 60 + 1, 20)  # minutes of the clock
FRAME = 120  # ms
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
    "--force-color-profile=srgb",
    "--force-prefers-reduced-motion",
    "--virtual-time-budget=8000",
    f"--window-size={SIZE[0]},{SIZE[1]}",
)

scene, out = map(Path, sys.argv[1:])
browser = shutil.which("chromium") or shutil.which("google-chrome")
if browser is None:
    sys.exit("film_page.py needs Chromium; on Debian and Ubuntu: apt install chromium")
frames = []
with tempfile.TemporaryDirectory() as folder:
    for minutes in MOMENTS:
        shot = Path(folder, f"{minutes}.png")
        address = f"{scene.resolve().as_uri()}#at={DATE}T{minutes}"
        command = [browser, *FLAGS, f"--user-data-dir={folder}/profile", f"--screenshot={shot}"]
        subprocess.run([*command, address], check=True, capture_output=True, timeout=120)
        height = round(WIDTH * SIZE[1] / SIZE[0])
        picture = Image.open(shot).convert("RGB")
        frames.append(picture.resize((WIDTH, height), Image.Resampling.LANCZOS))
frames[0].save(
    out, save_all=True, append_images=frames[1:], duration=FRAME, loop=0, quality=70, method=6
)
