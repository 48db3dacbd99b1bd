"""Windows: where they are found, and what comes to their panes, by hand."""

import numpy as np
import pytest
from support.days import around, parts
from support.shapes import box, sheet

import umbra
from umbra.readers.window_files import read_windows
from umbra.receivers.window_search import count_windows, list_panes

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-03-21", "every": "1h", "threads": 1, "receivers": "windows"}
HEAD = "name,x,y,z,azimuth,width,height"


@pytest.fixture(scope="module")
def house():
    """A house of 20 by 10 by 10 m, its south face at y = 0, and a wall of 10 m before it."""
    return parts(
        house=box((-10, 0, 0), (10, 10, 10)), wall=box((-300, -11, 0), (300, -10, 10))
    )  # fmt: skip


def write(tmp_path, *lines, head=HEAD):
    path = tmp_path / "windows.csv"
    path.write_text("\n".join([head, *lines]))
    return path


def study(scene, path, site=SITE, **given):
    return umbra.shadow_study(scene, site, **{**DAY, "windows": path, **given}).windows


def at_noon(noon):
    return {"date": None, "every": None, **around(noon), "refraction": "none"}


def test_a_pane_is_lit_as_far_as_the_shadow_does_not_reach(house, at_45, noon, tmp_path):
    """The sun 45 degrees high in the south: the wall 10 m away hides what is below 0 m + 0."""
    path = write(tmp_path, "low,0,0,1,180,2,2", "half,0,0,0.5,180,2,3", "north,0,10,5,0,2,2")
    # Its shadow meets the house at the ground: the pane from -1 to 2 m is lit above 0.
    found = study(house, path, at_45, judge="pane", **at_noon(noon))
    lit = found["sun_hours"].to_numpy() * 1800
    assert lit == pytest.approx([1.0, 2 / 3, 0.0], abs=1 / 24)
    centre = study(house, path, at_45, **at_noon(noon))["sun_hours"].to_numpy() * 1800
    assert centre == pytest.approx([1, 1, 0])
    sill = study(house, path, at_45, judge="sill", **at_noon(noon))["sun_hours"].to_numpy() * 1800
    assert sill == pytest.approx([1, 0, 0])


@pytest.mark.parametrize(("reveal", "share"), [(0.0, 1.0), (0.5, 0.75), (1.0, 0.5), (2.0, 0.0)])
def test_a_reveal_hides_the_upper_part_of_the_pane(house, at_45, noon, tmp_path, reveal, share):
    """Under a sun 45 degrees high the lintel's shadow is as high as the reveal is deep."""
    path = write(tmp_path, f"w,0,0,5,180,2,2,{reveal}", head=f"{HEAD},reveal")
    found = study(house, path, at_45, judge="pane", **at_noon(noon))
    assert found["sun_hours"][0] * 1800 == pytest.approx(share, abs=0.01)
    flat = study(house, path, at_45, judge="pane", reveal="none", **at_noon(noon))
    assert flat["sun_hours"][0] * 1800 == pytest.approx(1.0)


def test_the_sill_behind_a_reveal_sees_under_the_lintel(house, at_45, noon, tmp_path):
    path = write(tmp_path, "w,0,0,5,180,2,2,0.5", head=f"{HEAD},reveal")
    found = study(house, path, at_45, judge="sill", **at_noon(noon))
    assert found["sun_hours"][0] * 1800 == pytest.approx(1.0)


def test_a_pane_within_the_wall_by_its_reveal_is_judged_there(house, at_45, noon, tmp_path):
    deep = write(tmp_path, "w,0,0.5,5,180,2,2,0.5", head=f"{HEAD},reveal")
    found = study(house, deep, at_45, judge="pane", **at_noon(noon))
    assert found["sun_hours"][0] * 1800 == pytest.approx(0.75, abs=0.01)
    buried = umbra.shadow_study(
        house, SITE, **DAY, windows=write(tmp_path, "w,0,0.5,5,180,2,2")
    )  # fmt: skip
    assert buried.windows["sun_hours"][0] == 0
    (note,) = buried.result.laid.notes
    assert "'w' in 'house'" in note


def test_a_default_reveal_is_for_windows_that_tell_none(house, at_45, noon, tmp_path):
    path = write(tmp_path, "a,-5,0,5,180,2,2,", "b,5,0,5,180,2,2,0", head=f"{HEAD},reveal")
    found = study(house, path, at_45, judge="pane", reveal=0.5, **at_noon(noon))
    assert found["sun_hours"].to_numpy() * 1800 == pytest.approx([0.75, 1.0], abs=0.01)


def test_hours_are_those_of_points_at_the_panes(house, tmp_path):
    path = write(tmp_path, "s,0,0,5,180,1,1", "e,10,5,5,90,1,1", "n,0,10,5,0,1,1")
    places = [(0, -1e-3, 5, 0, -1, 0), (10.001, 5, 5, 1, 0, 0), (0, 10.001, 5, 0, 1, 0)]
    measures = {"measure": "sun_hours,sky_view_factor,sky_component", "sky_directions": 500}
    points = umbra.shadow_study(
        house, SITE, **{**DAY, "receivers": "points"}, points=places, **measures
    )  # fmt: skip
    found = study(house, path, **measures)
    for name in ("sun_hours", "sky_view_factor", "sky_component"):
        np.testing.assert_allclose(found[name], points[name].to_numpy(), atol=1e-6)


def test_exact_times_and_skies_of_windows(house, tmp_path):
    path = write(tmp_path, "s,0,0,5,180,1,1")
    exact = study(house, path, measure="sun_hours,sky_component", exact=True)
    steps = study(house, path, measure="sun_hours,sky_component", every="5min")
    assert exact["sun_hours"][0] == pytest.approx(steps["sun_hours"][0], abs=0.1)
    assert exact["sky_component"][0] == pytest.approx(steps["sky_component"][0], abs=0.3)
    deep = write(tmp_path, "s,0,0,5,180,1,1,0.2", head=f"{HEAD},reveal")
    with pytest.raises(umbra.InputError) as caught:
        study(house, deep, exact=True)
    assert caught.value.option == "exact"


def test_azimuths_are_from_true_north(house, tmp_path):
    """True north along x: a pane that faces y faces west."""
    turned = umbra.Site(48.2, 16.37, "Europe/Vienna", true_north=90.0)
    path = write(tmp_path, "w,0,10,5,270,1,1")
    found = umbra.shadow_study(house, turned, **DAY, windows=path)
    np.testing.assert_allclose(found.result.laid.local.normals, [[0, 1, 0]], atol=1e-12)
    assert found.windows["azimuth"][0] == pytest.approx(270)


def test_tables_by_room_flat_and_storey(house, tmp_path):
    path = write(
        tmp_path, "a,-5,0,5,180,1,2,1,bath,", "b,5,0,5,180,1,1,1,living,",
        "c,0,10,5,0,2,1,2,living,", head=f"{HEAD},flat,room,storey",
    )  # fmt: skip
    result = umbra.shadow_study(
        house, SITE, **{**DAY, "date": "2026-03-21,2026-06-21"}, windows=path, proposed="wall"
    )
    result.write(tmp_path / "out")
    head, *rows = (tmp_path / "out" / "windows.csv").read_text().splitlines()
    assert head.startswith("name,storey,flat,room,x,y,z,azimuth,area_m2,")
    assert {"sun_hours_2026-03-21", "hours_lost_2026-06-21"} <= {*head.split(",")}
    assert len(rows) == 3
    rooms = (tmp_path / "out" / "windows_by_room.csv").read_text().splitlines()
    assert rooms[0].startswith("flat,room,windows,area_m2,mean_sun_hours_2026-03-21,least_")
    assert [row.split(",")[:4] for row in rooms[1:]] == [
        ["1", "bath", "1", "2"], ["1", "living", "1", "1"], ["2", "living", "1", "2"],
    ]  # fmt: skip
    assert (tmp_path / "out" / "windows_by_flat.csv").exists()
    assert not (tmp_path / "out" / "windows_by_storey.csv").exists()


def make_element(low, high, name="w", kind="IfcWindow", **more):
    return umbra.Part(name, kind, umbra.Mesh(*box(low, high)), **more)


def make_holed_wall():
    """Wall from y = 0 to 0.4 with a hole from x = -1 to 1, z = 1 to 3, and rooms behind it."""
    blocks = [((-5, 0, 0), (-1, 0.4, 5)), ((1, 0, 0), (5, 0.4, 5)), ((-1, 0, 0), (1, 0.4, 1)),
              ((-1, 0, 3), (1, 0.4, 5)), ((-5, 6, 0), (5, 6.4, 5)), ((-5, 0.4, 0), (-4.6, 6, 5)),
              ((4.6, 0.4, 0), (5, 6, 5)), ((-5, 0, 5), (5, 6.4, 5.3))]  # fmt: skip
    return [make_element(*block, name=f"b{k}", kind="IfcWall") for k, block in enumerate(blocks)]


def test_windows_of_an_element_face_out_and_lie_on_its_front():
    glass = umbra.Material(opacity=0.2)
    tags = ("storey=EG", "space=Kitchen")
    window = [
        make_element((-1, 0.15, 1), (1, 0.25, 3), tags=tags),  # the frame
        make_element((-0.8, 0.19, 1.2), (0.8, 0.21, 2.8), material=glass, tags=tags),
    ]
    inner = make_element((-1, 3, 0), (1, 3.1, 2), name="hatch")
    scene = umbra.make_scene([*make_holed_wall(), *window, inner])
    assert count_windows(scene) == 2
    result = umbra.shadow_study(scene, SITE, **DAY, ground=0.0)
    (row,) = result.windows.to_dict("records")
    assert (row["name"], row["storey"], row["room"]) == ("w", "EG", "Kitchen")
    assert (row["x"], row["y"], row["z"]) == pytest.approx((0, 0.15, 2))
    assert row["azimuth"] == pytest.approx(180)
    assert row["area_m2"] == pytest.approx(1.6 * 1.6)
    assert result.result.laid.records[0].reveal == pytest.approx(0)  # its holes are the model's
    assert "'hatch'" in result.result.laid.notes[0]
    outer = umbra.shadow_study(scene, SITE, **DAY, ground=0.0, reveal="none").windows
    assert outer["y"][0] == pytest.approx(0)
    assert outer["sun_hours"][0] >= row["sun_hours"] > 0


@pytest.mark.parametrize("opacity", [0.2, 1.0])
def test_a_slim_window_in_a_deep_frame_looks_across_its_pane(opacity):
    # The jambs have more area across the width than the pane has across the depth.
    bars = [((-0.35, 0, 1), (-0.25, 0.4, 3)), ((0.25, 0, 1), (0.35, 0.4, 3)),
            ((-0.25, 0, 1), (0.25, 0.4, 1.1)), ((-0.25, 0, 2.9), (0.25, 0.4, 3))]  # fmt: skip
    glass = umbra.Material(opacity=opacity)
    pane = make_element((-0.25, 0.19, 1.1), (0.25, 0.2, 2.9), material=glass)
    (found,) = list_panes(umbra.make_scene([*(make_element(*bar) for bar in bars), pane]))
    assert np.abs(found.normal) == pytest.approx([0, 1, 0])
    assert found.height == pytest.approx(1.8 if opacity < 1 else 2.0)
    assert found.width == pytest.approx(0.5 if opacity < 1 else 0.7)


def test_glass_that_is_no_window_is_told():
    glass = umbra.Material(opacity=0.2)
    front, fixed = (("IfcCurtainWall", "Glass"), ("IfcCurtainWall", "IfcWindow"))
    scene = umbra.make_scene([
        make_element((0, 0, 1), (1, 0.1, 2), material=glass),
        make_element((2, 0, 0), (4, 0.1, 3), "front", front[0], tags=front[1:], material=glass),
        make_element((4, 0, 0), (6, 0.1, 3), "front", front[0], tags=front[1:], material=glass),
        make_element((6, 0, 0), (7, 0.1, 3), "vent", fixed[0], tags=fixed[1:], material=glass),
        make_element((8, 0, 0), (9, 0.1, 2), "door", "IfcDoor", material=glass),
        make_element((10, 0, 0), (11, 0.1, 2), "shut", "IfcDoor"),
        make_element((12, 0, 0), (13, 0.1, 1), "table", "IfcFurniture", material=glass),
    ])  # fmt: skip
    result = umbra.shadow_study(scene, SITE, **DAY)
    (note,) = result.result.laid.notes
    assert list(result.windows["name"]) == ["w", "vent"]
    assert "curtain walls 1, doors 1 (first: 'front')" in note
    with pytest.raises(umbra.InputError, match="doors 1"):
        umbra.shadow_study(umbra.make_scene([scene.parts[4]]), SITE, **DAY)


def test_windows_of_surfaces_are_one_each():
    wall = umbra.Part("house", "WallSurface", umbra.Mesh(*box((-5, 0.01, 0), (5, 6, 5))))
    panes = [sheet([(x, 0, 1), (x + 1, 0, 1), (x + 1, 0, 3), (x, 0, 3)]) for x in (-3, 0, 2)]
    both = (np.concatenate([p[0] for p in panes]),
            np.concatenate([p[1] + 4 * k for k, p in enumerate(panes)]))  # fmt: skip
    scene = umbra.make_scene([wall, umbra.Part("house", "Window", umbra.Mesh(*both))])
    found = umbra.shadow_study(scene, SITE, **DAY, ground=0.0).windows
    assert list(found["name"]) == ["house window 1", "house window 2", "house window 3"]
    assert found["area_m2"].to_numpy() == pytest.approx(2.0)
    assert found["azimuth"].to_numpy() == pytest.approx(180)
    assert sorted(found["x"]) == pytest.approx([-2.5, 0.5, 2.5])


def test_a_model_without_windows_says_how_to_give_them(house):
    with pytest.raises(umbra.InputError, match=r"name,x,y,z,azimuth,width,height") as caught:
        umbra.shadow_study(house, SITE, **DAY)
    assert caught.value.option == "windows"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        (HEAD, "holds no window"),
        ("name,x,y,z,width\na,0,0,0,1", "lacks the columns azimuth, height"),
        (f"{HEAD}\na,0,0,1,400,1,1", r"line 2: azimuth is a number from 0 to 360 .*'400'"),
        (f"{HEAD}\na,0,0,1,10,-1,1", "line 2: width"),
        (f"{HEAD}\na,0,zero,1,10,1,1", "line 2: y is a number"),
        (f"{HEAD}\na,0,0,1,10,1,1\na,1,0,1,10,1,1", "2 windows are called 'a'"),
        (f"{HEAD}\na,0,0,1,10", "line 2: width"),
    ],
)
def test_slips_in_tables(tmp_path, text, words):
    path = tmp_path / "w.csv"
    path.write_text(text)
    with pytest.raises(umbra.InputError, match=words) as caught:
        read_windows(path)
    assert caught.value.option == "windows"
    assert "\n" not in str(caught.value)


def test_semicolons_and_decimal_commas(tmp_path):
    path = tmp_path / "w.csv"
    path.write_text("name;x;y;z;azimuth;width;height\n;1,5;2;3;0;1;1\n")
    (row,) = read_windows(path)
    assert (row.name, row.x) == ("window 1", 1.5)


def test_options_of_windows(house, tmp_path):
    path = write(tmp_path, "a,0,0,5,180,1,1")
    for given, option in (({"judge": "corner"}, "judge"), ({"reveal": "deep"}, "reveal")):
        with pytest.raises(umbra.InputError) as caught:
            study(house, path, **given)
        assert caught.value.option == option
    with pytest.raises(umbra.InputError, match="not for receivers='top'"):
        umbra.shadow_study(house, SITE, date="2026-03-21", receivers="top", windows=path)
