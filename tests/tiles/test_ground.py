"""A ground through the feet of a city's buildings is the same in tiles as in one piece."""

import numpy as np
import pytest
from support.model_files import save_obj
from support.shapes import box

import umbra

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_tiles_have_the_bytes_of_one_piece(tmp_path, receivers):
    houses = {
        f"h{i}{j}": box((i * 20, j * 20, i * 2), (i * 20 + 10, j * 20 + 10, i * 2 + 9))
        for i in range(4)
        for j in range(3)
    }
    file = save_obj(tmp_path / "town.obj", houses)
    asked = {"date": "2026-03-21", "every": "1h", "receivers": receivers, "cell": 1.0}
    one = umbra.shadow_study(umbra.read(file, up="z"), SITE, **asked).dataset
    for tiles in ("30m", "1km"):
        city = umbra.city_study(
            file, SITE, out=tmp_path / tiles, tiles=tiles, reading={"up": "z"}, **asked
        ).dataset
        assert city.attrs["ground"] == one.attrs["ground"]
        assert "12 buildings" in city.attrs["ground"]
        for name in ("shadow_hours", "receiver_z"):
            np.testing.assert_array_equal(city[name].values, one[name].values)
            assert city[name].values.tobytes() == one[name].values.tobytes()
