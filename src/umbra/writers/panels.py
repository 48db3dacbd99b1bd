"""Several maps of one extent on one sheet: a panel for each date."""

import math
from collections.abc import Sequence

from umbra.writers.lettering import LINE, SMALL, SUBTITLE, wrap
from umbra.writers.marks import draw_frame, draw_north, draw_scale_bar
from umbra.writers.paper import QUIET, Panel, make_figure, to_pixels
from umbra.writers.plan import AREA, DOTS_PER_INCH, Plan
from umbra.writers.sheet import KEY_WIDTH, MARGIN, Sheet, Words

__all__ = ["make_panels"]

SHAPE = 1.4  # of all maps together: width by height
GAP, CAPTION = 0.2, 0.3  # between maps, and above each [inch]
LEAST_HEIGHT = 3.6  # the key needs this much [inch]


def make_panels(
    plan: Plan, captions: Sequence[str], remarks: Sequence[str] = ()
) -> tuple[Sheet, list[Panel]]:
    """
    Lay out a sheet with a map for each caption, and draw all but the maps' content and the key.

    Parameters
    ----------
    plan : Plan
        Of every map: its extent and its words.
    captions : sequence of str
    remarks : sequence of str
        A line or more below each caption.

    Returns
    -------
    sheet : Sheet
        Whose key is to be drawn; its map is the first.
    panels : list of Panel
    """
    x0, x1, y0, y1 = plan.extent
    aspect, n = (x1 - x0) / (y1 - y0), len(captions)
    cols = min(
        range(1, n + 1), key=lambda c: abs(math.log(c * aspect / (math.ceil(n / c) * SHAPE)))
    )
    rows = math.ceil(n / cols)
    area = min(AREA, 2 * AREA / n)
    w, h = (to_pixels(side) for side in (math.sqrt(area * aspect), math.sqrt(area / aspect)))
    told = [wrap(remark, SMALL, w) for remark in remarks or [""] * n]
    caption_height = CAPTION + max(map(len, told)) * SMALL * LINE
    maps_width = cols * w + (cols - 1) * GAP
    maps_height = max(rows * (h + caption_height) + (rows - 1) * GAP, LEAST_HEIGHT)
    width = to_pixels(MARGIN + maps_width + 0.32 + KEY_WIDTH + MARGIN)
    words = Words.of(plan, width - 2 * MARGIN)
    bottom = to_pixels(words.foot + 0.1)
    height = to_pixels(bottom + maps_height + words.head)
    figure = make_figure(width, height)
    map_size = round(h * DOTS_PER_INCH), round(w * DOTS_PER_INCH)
    left = to_pixels(MARGIN)
    panels = []
    for k, caption in enumerate(captions):
        row, col = divmod(k, cols)
        x = to_pixels(left + col * (w + GAP))
        y = to_pixels(height - words.head - (row + 1) * (h + caption_height) - row * GAP)
        panel = Panel(figure, plan, (x, y, w, h), map_size)
        draw_frame(panel, [], [], 0)
        for n_line, line in enumerate(reversed(told[k])):
            panel.write(x, y + h + 0.07 + n_line * SMALL * LINE, line, SMALL, color=QUIET)
        top = y + h + 0.08 + len(told[k]) * SMALL * LINE
        panel.write(x, top, caption, SUBTITLE, weight="bold")
        panels.append(panel)
    key_x = left + maps_width + 0.32
    key_box = (key_x, bottom + 0.6, KEY_WIDTH, maps_height - 0.6 - 0.95)
    sheet = Sheet(figure, plan, panels[0].map_box, map_size, key_box, is_wide=False)
    words.draw(sheet)
    draw_scale_bar(panels[0], key_x, bottom + 0.03, KEY_WIDTH - 0.25)
    draw_north(panels[0], key_x + 0.3, bottom + maps_height - 0.45)
    return sheet, panels
