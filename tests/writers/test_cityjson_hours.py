"""Hours as attributes of CityJSON: each polygon has the figures of its own surface."""

import copy
import json

import numpy as np
import pytest
from support.cities import DAY, FACES, write_city

import umbra
from umbra.readers.cityjson_choice import flatten, walk_values
from umbra.writers.output_formats import Job
from umbra.writers.outputs import write_formats

HOUSES = [
    ("low", 85000.0, 447000.0, 0.0, 12.0, 8.0, 6.0, 0.3),
    ("tower", 85018.0, 447003.0, 0.0, 9.0, 9.0, 30.0, 0.9),
    ("plain", 85040.0, 447003.0, 0.0, 9.0, 9.0, 9.0, 0.0),
]
SOUTH = 3  # of FACES: a wall that is cut in two polygons, one with a window's meaning


def write_houses(path):
    """Write houses whose walls share one meaning; the last has no meanings."""
    city = json.loads(write_city(path, HOUSES).read_text())
    for name in ("low", "tower"):
        [solid] = city["CityObjects"][name]["geometry"]
        solid["semantics"] = {
            "surfaces": [
                {"type": "GroundSurface"},
                {"type": "RoofSurface", "color": "red"},
                {"type": "WallSurface", "children": [3]},
                {"type": "Window", "parent": 2},
            ],
            "values": [[0, 1, 2, 3, 2, 2]],
        }
    city["CityObjects"]["low"]["attributes"] = {"storeys": 2}
    path.write_text(json.dumps(city))
    return path


def run(*paths, **more):
    scene = umbra.read(*paths)
    options = {**DAY, "receivers": "surfaces", "spacing": 1.0, **more}
    return umbra.shadow_study(scene, umbra.find_site(scene), **options)


def find_normal(city, ring):
    """Return the unit normal of a polygon's first three corners."""
    points = np.array(city["vertices"])[ring[:3]] * city["transform"]["scale"]
    normal = np.cross(points[1] - points[0], points[2] - points[1])
    return normal / np.linalg.norm(normal)


def test_each_polygon_has_the_figures_of_its_surface(tmp_path):
    path = write_houses(tmp_path / "block.city.json")
    study = run(path, date="2026-03-21,2026-06-21")
    told = []
    (tmp_path / "out").mkdir()
    job = Job(study.result, tmp_path / "out", say=told.append)
    assert write_formats(job, ["cityjson"]) == ["hours.city.json"]
    before = json.loads(path.read_text())
    city = json.loads((tmp_path / "out" / "hours.city.json").read_text())
    data = study.dataset
    owner = data.part.values[data.surface_part.values]
    figures = ("mean", "least", "most")
    for name, item in city["CityObjects"].items():
        mine = np.flatnonzero(owner == name)
        area = data.surface_area.values[mine]
        mean = np.average(data.surface_mean_sun_hours.values[mine], weights=area)
        assert item["attributes"]["mean_sun_hours_sum"] == pytest.approx(mean, abs=1e-3)
        assert item["attributes"]["measured_area"] == pytest.approx(area.sum(), abs=1e-2)
        [solid] = item["geometry"]
        if name == "plain":
            assert "semantics" not in solid
            continue
        known, values = solid["semantics"]["surfaces"], solid["semantics"]["values"]
        indices = list(walk_values(values, solid["boundaries"], 1))
        assert len(indices) == len(set(indices)) == len(FACES)
        kinds = [known[index]["type"] for index in indices]
        assert kinds == ["GroundSurface", "RoofSurface", *["WallSurface"] * 1, "Window",
                         "WallSurface", "WallSurface"]  # fmt: skip
        assert known[indices[1]]["color"] == "red"
        [wall] = {one["parent"] for one in known if one["type"] == "Window"}
        assert known[wall]["type"] == "WallSurface"
        for polygon, index in zip(flatten(solid), indices, strict=True):
            normal = find_normal(city, polygon[0])
            if normal[2] < -0.5:
                assert set(known[index]) == {"type"}
                continue
            tilt = np.degrees(np.arccos(np.clip(normal[2], -1, 1)))
            turn = np.degrees(np.arctan2(normal[0], normal[1])) - study.result.site.true_north
            apart = np.abs(data.surface_tilt.values[mine] - tilt)
            if tilt > 1:
                turned = data.surface_azimuth.values[mine] - turn
                apart += np.nan_to_num(np.abs((turned + 180) % 360 - 180), nan=99.0)
            surface = mine[apart.argmin()]
            assert apart.min() < 0.1
            for which in figures:
                expected = float(data[f"surface_{which}_sun_hours"][surface])
                assert known[index][f"{which}_sun_hours_sum"] == pytest.approx(expected, abs=1e-3)
            months = [key for key in known[index] if key.startswith("mean_sun_hours_2026")]
            assert months == ["mean_sun_hours_2026-03", "mean_sun_hours_2026-06"]
    assert any("1 objects without semantic surfaces" in line for line in told)
    # All else is as it was.
    for item in (*city["CityObjects"].values(), *before["CityObjects"].values()):
        [solid] = item["geometry"]
        solid.pop("semantics", None)
        attributes = item.pop("attributes", {})
        if "storeys" in attributes:
            assert attributes["storeys"] == 2
    assert city == before


def test_a_file_that_changed_or_is_no_cityjson_is_named(tmp_path):
    path = write_houses(tmp_path / "block.city.json")
    study = run(path)
    city = json.loads(path.read_text())
    other = copy.deepcopy(city)
    other["CityObjects"].pop("plain")
    path.write_text(json.dumps(other))
    with pytest.raises(umbra.InputError, match=r"block.city.json is gone, or not as it was"):
        study.write(tmp_path / "out", "cityjson", pictures=False)
    model = tmp_path / "box.obj"
    corners = [(x, y, z) for z in (0, 5) for x, y in ((0, 0), (4, 0), (4, 4), (0, 4))]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    lines += ["f " + " ".join(str(k + 1) for k in face) for face in FACES]
    model.write_text("\n".join(lines) + "\n")
    scene = umbra.read(model)
    study = umbra.shadow_study(
        scene, umbra.Site(48.0, 16.0, "Europe/Vienna"), **{**DAY, "receivers": "surfaces"}
    )
    with pytest.raises(umbra.InputError, match=r"CityJSON files of a study, and box.obj is OBJ"):
        study.write(tmp_path / "out", "cityjson", pictures=False)


@pytest.mark.parametrize("layers", [("", ""), ("p:q=", "p_q="), ("one=", "one=")])
def test_files_of_one_layer_and_of_like_names_are_kept_apart(tmp_path, layers):
    paths = []
    for folder, height in (("a", 6.0), ("b", 30.0)):
        (tmp_path / folder).mkdir()
        houses = [("house", 85000.0 + 100 * len(paths), 447000.0, 0.0, 12.0, 8.0, height, 0.0)]
        paths.append(write_city(tmp_path / folder / "city.json", houses))
    study = run(*(f"{layer}{path}" for layer, path in zip(layers, paths, strict=True)))
    names = write_formats(Job(study.result, tmp_path, say=lambda _: None), ["cityjson"])
    assert len(set(names)) == 2
    data = study.dataset
    owner = data.surface_part.values
    for part, name in enumerate(names):
        city = json.loads((tmp_path / name).read_text())
        attributes = city["CityObjects"]["house"]["attributes"]
        area = data.surface_area.values[owner == part].sum()
        assert attributes["measured_area"] == pytest.approx(area, abs=1e-2)
