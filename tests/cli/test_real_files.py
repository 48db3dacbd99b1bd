"""Real models from the command line, on small rasters."""

import numpy as np
import pytest
import xarray as xr
from support.model_files import DATA

import umbra

VIENNA = ["--lat", "48.2", "--lon", "16.37", "--tz", "Europe/Vienna"]
DAY = ["--date", "2026-09-18", "--every", "2h", "--size", "150x120", "--masks"]

MODELS = [
    ("vienna_lod2.city.jsonl", VIENNA, "Europe/Vienna"),
    ("zurich_lod2.city.json", [], "Europe/Zurich"),
    ("delft.city.json", [], "Europe/Amsterdam"),
    ("denhaag.city.json", ["--lat", "52.08", "--lon", "4.31"], "Europe/Amsterdam"),
    ("engel_house.obj", VIENNA, "Europe/Vienna"),
    ("urban_block.obj", VIENNA, "Europe/Vienna"),
    ("fzk_haus.ifc", [], "Europe/Berlin"),
    ("tokyo_footprints.geojson", [], "Asia/Tokyo"),
]
ON_SLOPES = ("vienna_lod2.city.jsonl", "zurich_lod2.city.json")
"""Files without terrain whose buildings' feet differ by more than a storey."""


def find_roofed(path, result):
    """Find the cells with anything of the model above them, by rays from below."""
    scene = umbra.read(path)
    x, y = np.meshgrid(result.x, result.y)
    below = np.full(x.shape, scene.bounds()[0, 2] - 1)
    points = np.stack([x, y, below], -1).reshape(-1, 3)
    return umbra.count(scene, points, [(0, 0, 1)])[:, 0].reshape(x.shape) != 0


@pytest.mark.parametrize("receivers", ["ground", "top"])
@pytest.mark.parametrize(("name", "site", "zone"), MODELS)
def test_study(umbra_here, no_pictures, tmp_path, name, site, zone, receivers):
    path = DATA / name
    if not path.exists():
        pytest.skip(f"the real model {name} is not in ../shared/data")
    if path.suffix == ".ifc":
        pytest.importorskip("ifcopenshell")
    said = umbra_here(
        "study", path, *site, *DAY, "--receivers", receivers, "--out", tmp_path / "out"
    )
    assert said.status == 0, said
    assert all(line.startswith("note: ") for line in said.err.splitlines())
    with xr.open_dataset(tmp_path / "out" / "study.nc") as result:
        assert result.attrs["time_zone"] == zone
        assert result.shadow_hours.shape == (120, 150)
        total = result.shadow_hours.values + result.sun_hours.values
        # Beside a ground of its own, as Delft's, nothing receives, nor under what stands on a
        # ground that is assumed through the feet.
        is_land = np.isfinite(total)
        assert ("ground_feet" in result.attrs) == (name in ON_SLOPES)
        through_feet = name in ON_SLOPES and receivers == "ground"
        assert is_land.all() == ((name[:5], receivers) != ("delft", "top") and not through_feet)
        np.testing.assert_allclose(total[is_land], 8, rtol=1e-6)
        dark = 2 * result.in_shadow.sum("time").values
        np.testing.assert_allclose(dark[is_land], result.shadow_hours.values[is_land])
        assert 0 < float(result.shadow_hours.mean()) < 8
        if receivers == "top":
            assert float(np.ptp(result.receiver_z.values[is_land])) > 5
        elif through_feet:
            np.testing.assert_array_equal(np.isfinite(result.receiver_z), is_land)
            assert float(np.ptp(result.receiver_z.values[is_land])) > 5
            roofed = find_roofed(path, result)
            assert is_land.mean() > 0.5
            assert roofed[~is_land].mean() > 0.99
            assert (~is_land)[roofed].mean() > 0.85  # else under eaves
        else:
            assert float(np.ptp(result.receiver_z.values)) == 0
