"""
Edit views at random for a given time: a kept renderer draws what a fresh one draws.

Sequences take turns: of the window's renderer, and of `umbra.realtime.Renderer`, by name.

``make fuzz``, or ``python tests/fuzz/sequences.py --seconds 600 --seed 3``. Sequence n of a seed is
the same each time; where pixels differ, its number and edits are printed.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.edits import compare
from support.named_edits import compare_by_name

from umbra.errors import UmbraError
from umbra.gl.context import open_device

STEPS = 25
FARS = (0.0, 0.0, 0.0), (85_000.0, 447_000.0, 12.0), (2_600_000.0, 1_200_000.0, 410.0)


def draw_sequences(device, seed, seconds, count=1_000_000):
    """Draw up to ``count`` sequences; return the frames, and a line for each that differs."""
    until, frames, failures = time.monotonic() + seconds, 0, []
    for number in range(count):
        if time.monotonic() >= until:
            break
        first, far = 1000 * seed + number, FARS[number % len(FARS)]
        edited = compare(device, first, STEPS, far)
        if number % 2:
            edited = compare_by_name(device.handle, first, STEPS, far)
        for step, (done, options, differ) in enumerate(edited):
            frames += 1
            if differ:
                failures.append(f"sequence {first}, step {step}: {differ} pixels {done} {options}")
    return frames, failures


def main():
    """Read the command line and run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    try:
        device = open_device()
    except UmbraError as error:
        print(f"no sequences of edits are drawn: {error}")  # noqa: T201
        return 0
    with device, device.current():
        frames, failures = draw_sequences(device, given.seed, given.seconds)
    for line in failures:
        print(line)  # noqa: T201
    print(f"{frames} frames of edited views (seed {given.seed}): {len(failures)} differ")  # noqa: T201
    return min(len(failures), 1)


if __name__ == "__main__":
    sys.exit(main())
