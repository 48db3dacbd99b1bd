"""The bytes of a result do not depend on its tiles, and are those of a study of all files."""

import numpy as np
import pytest
from support.cities import DAY

import umbra

EXTENT = (84950, 446950, 85520, 447290)


@pytest.mark.parametrize("receivers", ["ground", "top"])
@pytest.mark.parametrize("more", [{}, {"spells": True}])
def test_tiles_hold_the_bytes_of_one_study(city, tmp_path, receivers, more):
    options = {**DAY, **more, "receivers": receivers, "cell": 2.0, "extent": EXTENT}
    scene = umbra.read(*city)
    whole = umbra.shadow_study(scene, umbra.find_site(scene), **options).dataset
    assert 0.1 < float(whole.shadow_hours.mean() / 7.5) < 0.9
    for side in (1000, 220, 57):
        made = umbra.city_study(city, out=tmp_path / str(side), tiles=side, **options)
        found = made.dataset.load()
        assert set(found.variables) == set(whole.variables)
        for name in whole.variables:
            assert found[name].dims == whole[name].dims
            if name != "xyz":
                np.testing.assert_array_equal(found[name], whole[name], name)
        assert made.facts["merged_objects"] == 3
