"""
Copy pictures into the documentation, small: at most 1200 pixels wide, 256 colours.

    python docs/shrink.py PICTURE... FOLDER
"""

import sys
from pathlib import Path

from PIL import Image

WIDTH = 1200

*pictures, folder = map(Path, sys.argv[1:])
folder.mkdir(parents=True, exist_ok=True)
for path in pictures:
    picture = Image.open(path).convert("RGB")
    if picture.width > WIDTH:
        height = round(picture.height * WIDTH / picture.width)
        picture = picture.resize((WIDTH, height), Image.Resampling.LANCZOS)
    # Error diffusion would grow the file and speckle flat tints.
    # Without k-means a legend's small bands share a colour with their neighbours.
    small = picture.quantize(256, Image.Quantize.MEDIANCUT, kmeans=2, dither=Image.Dither.NONE)
    small.save(folder / path.name, optimize=True)
