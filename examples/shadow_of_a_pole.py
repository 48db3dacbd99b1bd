"""
Check a study against a calculation by hand: the shadow of a pole.

    python examples/shadow_of_a_pole.py

A pole of height h under a sun at altitude a casts a shadow of length h / tan(a), straight
away from the sun. So at 45 degrees a 10 m pole casts a shadow of 10 m. Where and when is
the sun at 45 degrees? At 45 degrees north at an equinox, at solar noon (nearly: the equinox is an
instant, and refraction lifts the sun by a minute of arc).
"""

import sys

import numpy as np

import umbra

HEIGHT = 10.0  # of the pole [m]
SIDE = 0.2  # of its square section [m]
CELL = 0.02  # of the raster [m]

x, y, z = np.meshgrid([-SIDE / 2, SIDE / 2], [-SIDE / 2, SIDE / 2], [0, HEIGHT], indexing="ij")
vertices = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
faces = [
    (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
    (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
]  # fmt: skip
pole = umbra.make_scene(vertices, faces, name="pole")

# On the Greenwich meridian solar noon falls at 12:07 UTC that day.
site = umbra.Site(latitude=45.0, longitude=0.0, zone="UTC")
sun = umbra.find_sun(site, np.datetime64("2026-03-20T12:07:30"))
altitude, azimuth = float(sun.altitude[0]), float(sun.azimuth[0])
print(f"the sun stands at altitude {altitude:.2f}°, azimuth {azimuth:.2f}°")

# One step of a minute, judged at its middle; the shadow of the one instant is kept.
study = umbra.shadow_study(
    pole, site, date="2026-03-20", start="12:07", end="12:08", every="1min",
    extent=(-1, -1, 1, 11), cell=CELL, masks=True,
)  # fmt: skip
shadow = study.in_shadow.isel(time=0)

# The pole's north face stands at y = SIDE / 2; its top edge casts the shadow's tip.
length = float(study.y[shadow.any("x")].max()) + CELL / 2 - SIDE / 2
by_hand = HEIGHT / np.tan(np.radians(altitude)) * -np.cos(np.radians(azimuth))
print(f"the shadow reaches {length:.2f} m due north, by hand {by_hand:.2f} m")

area = float(shadow.sum()) * CELL**2  # with the pole's own foot
by_hand_area = SIDE * (by_hand + SIDE)
print(f"it covers {area:.3f} m², by hand {by_hand_area:.3f} m²")

if abs(length - by_hand) > CELL or abs(area - by_hand_area) > 0.01 * by_hand_area:
    sys.exit("they disagree")
