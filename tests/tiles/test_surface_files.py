"""Files of surfaces in tiles hold what a study in memory of the same objects writes."""

from dataclasses import replace

import numpy as np
import pytest
from support.cities import DAY

import umbra


def make_alone(city):
    """Return the city's files as one scene without the objects that two files hold."""
    scene = umbra.read(*city)
    left_out = {("b_east", f"east {n}") for n in range(3)}
    parts = tuple(p for p in scene.parts if (p.layer, p.name) not in left_out)
    return replace(scene, parts=parts)


def test_surfaces_in_tiles_have_the_rows_of_a_study_in_memory(city, tmp_path, monkeypatch):
    parquet = pytest.importorskip("pyarrow.parquet")
    # Few rows at a time, so that a file is made of several groups.
    monkeypatch.setattr("umbra.writers.city.surfaces.ROWS", 70)
    options = {**DAY, "date": "2026-12-21,2026-06-21", "receivers": "surfaces", "spacing": 4.0}
    made = umbra.city_study(city, out=tmp_path / "tiles", tiles=100, **options)
    assert made.write() == [tmp_path / "tiles" / "surfaces.parquet"]
    alone = make_alone(city)
    study = umbra.shadow_study(alone, umbra.find_site(alone), **options)
    study.write(tmp_path / "whole", "geoparquet", pictures=False)
    found, whole = (
        parquet.read_table(tmp_path / name / "surfaces.parquet") for name in ("tiles", "whole")
    )
    assert found.num_rows == 5 * (60 + 60 + 4)
    assert found.schema.equals(whole.schema)
    # Parts of a city are always named with their layer.
    labels = {part.name: part.full_name for part in alone.parts}
    assert found["part"].to_pylist() == [labels[name] for name in whole["part"].to_pylist()]
    for name in whole.column_names[1:]:
        np.testing.assert_array_equal(found[name], whole[name], name)
    assert found.schema.metadata[b"geo"] == whole.schema.metadata[b"geo"]
    assert "mean_sun_hours_2026-06" in found.column_names
