"""A reader for umbra: nine numbers a line, a triangle each, in metres."""

from pathlib import Path

import numpy as np

from umbra.extending import InputError, Mesh, Part, Reader

NUMBERS = 9


class Raw(Reader):
    """Raw triangles, ``*.raw``."""

    title = "raw triangles"

    def read(self, data: bytes, path: Path) -> list[Part]:
        """Read all triangles as one part, named after the file."""
        rows = [line.split() for line in data.splitlines() if line.strip()]
        wrong = next((n for n, row in enumerate(rows, 1) if len(row) != NUMBERS), None)
        if wrong is not None:
            msg = f"line {wrong} has {len(rows[wrong - 1])} numbers, a triangle has {NUMBERS}"
            raise InputError(msg)
        try:
            corners = np.array(rows, np.float64).reshape(-1, 3)
        except ValueError as error:
            msg = f"holds words that are no numbers ({error}); write nine numbers a line"
            raise InputError(msg) from None
        faces = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
        return [Part(path.stem, "", Mesh(corners, faces))]
