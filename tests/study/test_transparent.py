"""Studies take glass and leaves as opaque, and say so."""

import numpy as np
import pytest
from support.glass import BLUE, card, leaf_image
from support.shapes import box

import umbra
from umbra.casters import describe_opaque
from umbra.scene import Material, Mesh, Part, make_scene

SITE = umbra.Site(latitude=48.2, longitude=16.4, zone="Europe/Vienna")
FENCE = [(-4, 6, 0), (4, 6, 0), (4, 6, 3), (-4, 6, 3)]


def make(pane, leaf):
    return make_scene([
        Part("pane", "", Mesh(*box((-3, -1, 1), (3, 1, 2))), material=pane),
        Part("fence", "", card(FENCE), material=leaf),
    ])  # fmt: skip


def study(scene, **options):
    return umbra.shadow_study(
        scene, SITE, date="2026-06-18", start="09:00", end="15:00", every="1h", cell=0.5, **options
    )


@pytest.mark.parametrize("options", [
    {}, {"receivers": "camera", "eye": (9, -12, 9), "target": (0, 0, 0), "size": (40, 30)},
])  # fmt: skip
def test_hours_are_those_of_opaque_parts(options):
    glass = make(BLUE, Material((1, 1, 1), leaf_image(), alpha_mode="mask"))
    solid = make(Material(), Material())
    found, plain = study(glass, **options), study(solid, **options)
    np.testing.assert_array_equal(found.shadow_hours, plain.shadow_hours)
    assert found.dataset.attrs["opaque_rule"].startswith("2 parts are transparent or may have")
    assert "opaque_rule" not in plain.dataset.attrs


def test_what_a_canopy_names_is_not_told():
    glass = make(BLUE, Material())
    assert describe_opaque(glass, [0, 1]).startswith("1 part is transparent")
    assert "first: 'pane'" in describe_opaque(glass, [0, 1])
    assert describe_opaque(glass, [1]) is None
    assert "opaque_rule" not in study(glass, canopy="pane").dataset.attrs
