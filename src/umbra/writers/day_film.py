"""The day as a film: GIF for anywhere, MP4 for larger plans."""

import os
from collections.abc import Iterator, Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from umbra.errors import UmbraError
from umbra.study import Study
from umbra.study.preview import Moment, find_moments
from umbra.sun import name_date
from umbra.writers.marks import find_round
from umbra.writers.picture_content import Plan, shade_roofs
from umbra.writers.pixels import resample
from umbra.writers.sun_rose import paste_rose, paste_scale

__all__ = ["draw_frames", "find_frames", "write_gif", "write_mp4", "write_smooth_gif"]

LONGEST = 960
"""Pixels along the longer side of the plan."""
CELLS = 800
"""Cells along it at most."""
STRIP = 44
"""Pixels above the plan, for the clock."""
BAR = 90
"""Longest scale bar [pixels]."""
MOST_FRAMES = 400
SECONDS = 0.15
"""Duration of a frame; up to 0.5 s in short films [s]."""
GROUND = np.array([251, 248, 240], np.float32)
SHADE = np.array([118, 123, 148], np.float32)
INK, QUIET = "#1c1c22", "#5a5a64"


def find_frames(study: Study, at: Sequence[str] = ()) -> list[Moment]:
    """Find the moments with the sun up that a film shows: at clock times, or round ones."""
    return find_moments(study, at, every=None, most=MOST_FRAMES)


def draw_frames(study: Study, moments: Sequence[Moment], title: str = "") -> Iterator[Image.Image]:
    """Draw the plan at some moments: RGB images with sides of even length."""
    grid = study.grid.coarser(CELLS)
    rows, cols = grid.rows, grid.cols
    tile = study.model.make_tile(grid)
    heights = np.where(tile.nothing, np.nan, tile.relief)
    plan = Plan(grid.x, grid.y, heights.astype(np.float32))
    counter = tile.make_counter()
    (dx, dy), side = plan.cell, min(plan.cell)
    # Square cells become squares of whole pixels. H.264 wants even sides.
    times = max(1, int(LONGEST * side // max(rows * dy, cols * dx)))
    whole = round(rows * times * dy / side), round(cols * times * dx / side)
    high, wide = (max(2, length // 2 * 2) for length in whole)

    def enlarge(values: NDArray) -> NDArray[np.float32]:
        enlarged = resample(values, whole)
        return np.pad(enlarged, 1, mode="edge")[1 : high + 1, 1 : wide + 1, None]

    per_metre = times / side
    metres = find_round(BAR / per_metre)
    label = f"{metres / 1000:g} km" if metres >= 2000 else f"{metres:g} m"
    grey, coverage = map(enlarge, shade_roofs(plan, (rows, cols)))
    for moment in moments:
        masks = counter.masks(moment.direction[None]).view(np.bool_)
        shade = enlarge(masks[0] & ~tile.nothing)
        if study.kind.lies_under_roofs:
            image: NDArray = GROUND + shade * (SHADE - GROUND)
            image += coverage * (grey * 255 - image)
        else:
            base = GROUND + coverage * (grey * 255 - GROUND)
            image = base * (1 - shade * (1 - SHADE / 251))
        frame = Image.new("RGB", (wide, high + STRIP), "white")
        pixels = np.clip(np.rint(image[::-1]), 0, 255).astype(np.uint8)
        frame.paste(Image.fromarray(pixels), (0, STRIP))
        local = moment.local
        middle = wide - STRIP / 2 - 4, STRIP / 2 + 2
        way = [(one.azimuth, one.altitude) for one in moments if one.local.date() == local.date()]
        paste_rose(
            frame, middle, 0.3 * STRIP, study.true_north, (moment.azimuth, moment.altitude), way
        )
        at = paste_scale(frame, (wide - 1.5 * STRIP, 0.62 * STRIP), metres * per_metre, label)
        day = f"{name_date(local)}, {local.tzname()}"
        _letter(frame, f"{local:%H:%M}", day, title, round(at))
        yield frame


def _letter(frame: Image.Image, clock: str, day: str, title: str, end: int) -> None:
    """Write the clock, the day and the title into the strip above the plan, up to a column."""
    pen = ImageDraw.Draw(frame)
    large, small = ImageFont.load_default(26), ImageFont.load_default(16)
    pen.text((10, 22), clock, INK, large, anchor="lm")
    at = 20 + pen.textlength(clock, large)
    pen.text((at, 24), day, QUIET, small, anchor="lm")
    room = end - at - pen.textlength(day, small) - 40
    while title and pen.textlength(title, small) > room:
        title = title[:-2].rstrip("….") + "…" if len(title) > 3 else ""
    pen.text((end - 16, 24), title, QUIET, small, anchor="rm")


def find_pace(n: int) -> float:
    """Return the duration of each of n frames [s]."""
    return float(np.clip(6 / max(n, 1), SECONDS, 0.5))


def write_gif(
    path: str | os.PathLike[str],
    frames: Iterator[Image.Image],
    sample: Image.Image,
    n: int,
) -> None:
    """Write n frames of a day as a looping GIF, with one palette to avoid flicker."""
    palette = sample.quantize(96, dither=Image.Dither.NONE)
    indexed = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    pace = round(find_pace(n) * 1000)
    _save_gif(path, indexed, [pace] * (n - 1) + [pace + 1000])


def write_smooth_gif(
    path: str | os.PathLike[str], frames: Iterator[Image.Image], n: int, rate: int
) -> None:
    """
    Write n frames of shaded pictures as a looping GIF, each in 256 colours of its own, dithered.

    A GIF counts hundredths of a second: frames differ in length, and all last n / rate seconds.
    """
    indexed = (frame.quantize(256, dither=Image.Dither.FLOYDSTEINBERG) for frame in frames)
    ends = np.rint(np.arange(n + 1) * (100 / rate))
    _save_gif(path, indexed, [int(pace) * 10 for pace in np.diff(ends)])


def _save_gif(
    path: str | os.PathLike[str], indexed: Iterator[Image.Image], paces: list[int]
) -> None:
    """Save frames, each with its duration [ms]."""
    next(indexed).save(
        path, "GIF", save_all=True, append_images=indexed, duration=paces, loop=0, optimize=False
    )


def write_mp4(
    path: str | os.PathLike[str], frames: Iterator[Image.Image], n: int, pace: float | None = None
) -> None:
    """
    Write n frames, with sides of even length, as H.264 in MP4; raise if there is no encoder.

    A frame takes ``pace`` seconds; by default what suits the day.
    """
    import av  # noqa: PLC0415  (an extra)

    if "libx264" not in av.codecs_available:
        msg = "this build of PyAV has no H.264 encoder; install the wheel from PyPI, or write gif"
        raise UmbraError(msg)
    rate = Fraction(1 / (pace or find_pace(n))).limit_denominator(100)
    with av.open(os.fspath(path), "w", format="mp4", options={"movflags": "faststart"}) as film:
        stream = None
        for frame in frames:
            if stream is None:
                stream = film.add_stream("libx264", rate=rate)
                stream.width, stream.height = frame.size
                stream.pix_fmt = "yuv420p"
                stream.options = {"crf": "20", "preset": "medium", "tune": "animation"}
            film.mux(stream.encode(av.VideoFrame.from_image(frame)))
        if stream is not None:
            film.mux(stream.encode(None))
