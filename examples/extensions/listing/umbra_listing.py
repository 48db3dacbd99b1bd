"""An output for umbra: the mean, the least and the most of each variable, as text."""

from pathlib import Path

import numpy as np

from umbra.extending import Output, Study


class Listing(Output):
    """``listing.txt``: a line for each variable that has a value for each receiver."""

    def write(self, study: Study, folder: Path) -> list[str]:
        """Write the list."""
        dataset = study.to_dataset()
        lines = []
        for name, array in dataset.data_vars.items():
            if array.dims != study.dims or array.dtype.kind != "f":
                continue
            values = array.values[np.isfinite(array.values)]
            if values.size:
                unit = array.attrs.get("units", "1")
                mean, least, most = values.mean(), values.min(), values.max()
                lines.append(f"{name} [{unit}]: {mean:.6g} ({least:.6g} to {most:.6g})\n")
        (folder / "listing.txt").write_text("".join(lines), "utf-8")
        return ["listing.txt"]
