"""Real models from the command line, on small rasters."""

import numpy as np
import pytest
import xarray as xr
from support.model_files import DATA

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
        # Beside a ground of its own, as Delft's, nothing receives.
        is_land = np.isfinite(total)
        assert is_land.all() == ((name[:5], receivers) != ("delft", "top"))
        np.testing.assert_allclose(total[is_land], 8, rtol=1e-6)
        dark = 2 * result.in_shadow.sum("time").values
        np.testing.assert_allclose(dark[is_land], result.shadow_hours.values[is_land])
        assert 0 < float(result.shadow_hours.mean()) < 8
        if receivers == "top":
            assert float(np.ptp(result.receiver_z.values[is_land])) > 5
        else:
            assert float(np.ptp(result.receiver_z.values)) == 0
