"""A small city of boxes in three files."""

import pytest
from support.cities import make_houses, write_city


@pytest.fixture(scope="session")
def city(tmp_path_factory):
    """Return two neighbouring files that share three houses, and one far to the south west."""
    folder = tmp_path_factory.mktemp("city")
    west = make_houses(1, 60, (85000, 447000), (85250, 447240), "west")
    east = make_houses(2, 60, (85230, 447000), (85480, 447240), "east")
    far = make_houses(3, 4, (84500, 446300), (84600, 446400), "far")
    return [
        write_city(folder / "a_west.city.json", [*west, *east[:3]]),
        write_city(folder / "b_east.city.json", east),
        write_city(folder / "c_far.city.json", far),
    ]
