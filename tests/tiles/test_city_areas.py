"""Named areas beside a city's tiles are those of one study, however they are cut."""

import numpy as np
import pytest
from support.cities import DAY, read_store
from tiles.test_bytes import check_tiles

import umbra
from umbra.errors import InputError, UmbraError
from umbra.receivers import single
from umbra.tiles.city_areas import list_tasks
from umbra.tiles.run import count_serially
from umbra.writers.folder.named_tables import AREAS, write_area_table

shapely = pytest.importorskip("shapely")

OPTIONS = {
    **DAY, "every": "1h", "receivers": "ground", "cell": 7.5,
    "extent": (85080, 447080, 85200, 447200),
}  # fmt: skip
GARDENS = {
    "long": shapely.box(85020, 447090, 85200, 447102),
    "bent": shapely.Polygon([(85090, 447150), (85130, 447150), (85090, 447190)]),
    "yard": shapely.box(85150, 447100, 85160, 447112),
}


def test_areas_hold_the_bytes_of_one_study(city, tmp_path):
    """With what a proposal replaces, on two dates, and a measure of the sky."""
    made, whole = check_tiles(
        city, tmp_path, (60,), areas=GARDENS, proposed=["west 11"], replace=["west 2?"],
        measure="sun_hours,sky_view_factor", sky_directions="tregenza",
        **{**OPTIONS, "date": "2026-12-21,2026-03-21"},
    )  # fmt: skip
    assert whole.share_2h.shape == (3, 2)
    assert (whole.mean_sun_hours != whole.mean_sun_hours_before).any()
    assert list(made.areas["name"]) == ["long", "long", "bent", "bent", "yard", "yard"]


@pytest.mark.parametrize(
    "more",
    [
        {
            "areas_on": "mean+2",
            "band": ["5,10", "10,30"],
            "ground": "feet",
            "roads": {"road": shapely.box(85020, 447102, 85200, 447108)},
        },
        {"areas_on": "top", "areas": ["west 15", "west 16"]},
    ],
    ids=["bands", "roofs"],
)
def test_bands_and_roofs_are_those_of_one_study(city, tmp_path, more):
    _, whole = check_tiles(city, tmp_path, (60,), **{**OPTIONS, "areas": GARDENS, **more})
    assert len(whole.name) == (6 if "band" in more else 2)


def test_sums_of_an_area_do_not_depend_on_others(city, monkeypatch):
    """Also where they fill several chunks of samples."""
    monkeypatch.setattr(single, "CHUNK", 904)
    scene = umbra.read(*city)
    site = umbra.find_site(scene)
    options = {**OPTIONS, "receivers": "areas", "cell": 1.0}
    many = umbra.shadow_study(scene, site, **options, areas=GARDENS)
    assert np.bincount(many.result.laid.owner).min() < 904 < many.result.laid.shape[0] / 3
    alone = umbra.shadow_study(scene, site, **options, areas={"bent": GARDENS["bent"]})
    for name, values in alone.result.areas.columns.items():
        assert values.tobytes() == many.result.areas.columns[name][1:2].tobytes(), name


def test_areas_go_on_after_a_break(city, tmp_path):
    whole = umbra.city_study(city, out=tmp_path / "whole", tiles=60, **OPTIONS, areas=GARDENS)
    tasks = list_tasks(whole.job)
    assert [task.number for task in tasks if task.areas] == [4, 5, 6]
    counted = []

    def break_off(job, tiles):
        for tile, record in count_serially(job, tiles):
            counted.append(tile.number)
            yield tile, OSError("no luck") if tile.number == 5 else record
            if tile.number == 5:
                (tmp_path / "broken/tiles/000005.json").unlink()

    given = {**OPTIONS, "out": tmp_path / "broken", "tiles": 60, "areas": GARDENS}
    with pytest.raises(UmbraError, match="1 of 7 tiles failed"):
        umbra.city_study(city, **given, engine=break_off)
    counted.clear()
    again = umbra.city_study(city, **given, engine=lambda job, tiles: _list(job, tiles, counted))
    assert counted == [5]
    assert read_store(tmp_path / "broken") == read_store(tmp_path / "whole")
    (tmp_path / "broken/tiles/000004/areas.npz").write_bytes(b"half")
    counted.clear()
    umbra.city_study(city, **given, engine=lambda job, tiles: _list(job, tiles, counted))
    assert counted == [4]
    for one in (whole, again):
        write_area_table(one.folder, one.run.areas)
    texts = [(one.folder / AREAS).read_text() for one in (whole, again)]
    assert texts[0] == texts[1]
    with pytest.raises(InputError) as caught:
        umbra.city_study(city, **{**given, "areas": {"yard": GARDENS["yard"]}})
    assert caught.value.option == "out"


def _list(job, tiles, counted):
    counted += [tile.number for tile in tiles]
    return count_serially(job, tiles)
