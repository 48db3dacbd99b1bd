"""glTF's materials, textures and lights."""

import base64
import io

import numpy as np
import PIL.Image
import pytest
from support.gltf_files import Document

import umbra
from umbra import InputError
from umbra.casters import describe_opaque
from umbra.readers import checks as companions
from umbra.scene.material import sample

PIXELS = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 0]]], np.uint8)
LOST = "m.glb: textures that are missing or in an unknown format, left out: 1"


def encode(form="PNG", pixels=PIXELS):
    held = io.BytesIO()
    PIL.Image.fromarray(pixels).save(held, form)
    return held.getvalue()


class Square(Document):
    """A square of 1 m in glTF's x and y with everything a vertex may carry."""

    def __init__(self):
        super().__init__()
        points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "f4")
        self.tree["materials"] = [{"name": "brick"}]
        self.material = self.tree["materials"][0]
        self.attributes = {
            "POSITION": self.accessor(points),
            "NORMAL": self.accessor(np.tile(np.array([0, 0, 1], "f4"), (4, 1))),
            "TEXCOORD_0": self.accessor(np.array([[0, 1], [1, 1], [1, 0], [0, 0]], "f4")),
        }
        self.primitive = {
            "attributes": self.attributes,
            "indices": self.accessor(np.array([0, 1, 2, 0, 2, 3], "u1")),
            "material": 0,
        }
        self.node(mesh=self.mesh(self.primitive), name="wall")

    def paint(self, image=None, **more):
        """Give the material a base colour texture."""
        image = image or {"bufferView": self.view(encode()), "mimeType": "image/png"}
        self.tree["images"] = [image]
        self.tree["textures"] = [{"source": 0}]
        self.material["pbrMetallicRoughness"] = {"baseColorTexture": {"index": 0} | more}


@pytest.fixture
def made():
    return Square()


@pytest.fixture
def read(tmp_path):
    def write_and_read(document):
        path = tmp_path / "m.glb"
        path.write_bytes(document.glb())
        return umbra.read(path)

    return write_and_read


def test_what_a_vertex_carries_is_kept(made, read):
    made.attributes["COLOR_0"] = made.accessor(
        np.array([[255, 0, 51, 9]] * 4, "u1"), normalized=True
    )
    (part,) = read(made).parts
    assert part.mesh.vertices.shape == (4, 3)  # and still shared by both triangles
    np.testing.assert_array_equal(part.mesh.normals, [[0, 0, 1]] * 4)
    np.testing.assert_array_equal(part.mesh.uv, [[0, 1], [1, 1], [1, 0], [0, 0]])
    np.testing.assert_allclose(part.mesh.colors, [[1, 0, 0.2]] * 4, rtol=1e-6)
    assert part.material.texture is None


@pytest.mark.parametrize("form", ["PNG", "JPEG", "WEBP"])
def test_a_texture_in_the_file(made, read, form):
    flat = np.broadcast_to(np.array([40, 160, 90], np.uint8), (8, 8, 3))
    made.paint({"bufferView": made.view(encode(form, flat))})
    (part,) = read(made).parts
    assert part.material.texture.shape == (8, 8, 4)
    np.testing.assert_allclose(part.material.texture[..., :3], flat, atol=4)
    assert part.material.color == (1, 1, 1)


def test_texels_are_where_the_coordinates_say(made, read):
    made.paint()
    made.material["pbrMetallicRoughness"]["baseColorFactor"] = [0.5, 1, 1, 0.25]
    (part,) = read(made).parts
    np.testing.assert_array_equal(part.material.texture[..., :3], PIXELS)
    # The vertex at (0, 1), up in the model, has (0, 0): the first row's first texel.
    np.testing.assert_allclose(sample(part.material.image, [0.25, 0.25]), [1, 0, 0, 1])
    assert part.color == (0.5, 1, 1)
    assert part.material.opacity == 1  # an opaque material's alpha says nothing
    assert not part.material.is_transparent


def test_textures_are_decoded_only_when_asked(made, read, monkeypatch, umbra_decodes):
    made.paint()
    scene = read(made)
    scene.bounds()
    assert umbra_decodes == []
    _ = scene.parts[0].material.texture
    assert umbra_decodes == ["m.glb: image 0"]


@pytest.fixture
def umbra_decodes(monkeypatch):
    """Names of the pictures that are decoded."""
    names, decode = [], companions._decode

    def watched(name, fetch):
        names.append(name)
        return decode(name, fetch)

    monkeypatch.setattr(companions, "_decode", watched)
    return names


def test_textures_beside_the_file_and_as_data(made, read, tmp_path):
    (tmp_path / "red brick.png").write_bytes(encode())
    made.paint({"uri": "red%20brick.png"})
    np.testing.assert_array_equal(read(made).parts[0].material.texture[..., :3], PIXELS)
    inside = "data:image/png;base64," + base64.b64encode(encode()).decode()
    made.paint({"uri": inside})
    np.testing.assert_array_equal(read(made).parts[0].material.texture[..., :3], PIXELS)


def test_a_texture_that_is_not_there_is_noted_and_drawn_plain(made, read):
    made.material["pbrMetallicRoughness"] = {}
    made.paint({"uri": "lost.png"})
    scene = read(made)
    assert scene.parts[0].material.texture is None
    assert scene.notes == (LOST,)
    made.tree["textures"][0] = {"extensions": {"KHR_texture_basisu": {"source": 0}}}
    assert read(made).notes == (LOST,)
    made.tree["textures"] = []
    assert read(made).notes == (LOST,)


def test_a_picture_that_is_damaged_is_named_when_it_is_drawn(made, read):
    noise = np.random.default_rng(0).integers(0, 255, (40, 40, 3), np.uint8)
    half = encode(pixels=noise)[:2000]
    for data, reason in ((half, "truncated"), (b"no picture at all", "format is unknown")):
        made.paint({"bufferView": made.view(data), "name": "bricks"})
        scene = read(made)  # shadows do without it
        with pytest.raises(InputError, match=f"'m.glb: image 0, bricks' cannot be read.*{reason}"):
            _ = scene.parts[0].material.texture


def test_other_coordinates_and_their_transform(made, read):
    second = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0.5]], "f4")
    made.attributes["TEXCOORD_1"] = made.accessor(second)
    made.paint(texCoord=1)
    np.testing.assert_array_equal(read(made).parts[0].mesh.uv, second)
    transform = {"offset": [0.5, 0.25], "scale": [2, 4], "rotation": np.pi / 2}
    made.paint(texCoord=0, extensions={"KHR_texture_transform": transform | {"texCoord": 1}})
    # Scaled, turned counter-clockwise as it is seen (v runs down: u to -v), then moved.
    np.testing.assert_allclose(
        read(made).parts[0].mesh.uv, [[0.5, 0.25], [0.5, -1.75], [4.5, 0.25], [2.5, -0.75]],
        atol=1e-6,
    )  # fmt: skip


def test_samplers_say_how_pictures_go_on(made, read):
    made.paint()
    made.tree["samplers"] = [{"wrapS": 33071, "wrapT": 33648}]
    made.tree["textures"][0]["sampler"] = 0
    assert read(made).parts[0].material.image.wrap == ("clamp", "mirror")


def test_opacity_and_holes(made, read):
    made.material |= {
        "alphaMode": "BLEND",
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.25]},
    }
    material = read(made).parts[0].material
    assert (material.opacity, material.alpha_mode) == (0.25, "blend")
    made.material |= {"alphaMode": "MASK", "alphaCutoff": 0.2}
    material = read(made).parts[0].material
    # A quarter of the texture's alpha is compared with 0.2.
    assert (material.opacity, material.alpha_mode) == (1, "mask")
    assert material.alpha_cutoff == pytest.approx(0.8)


def test_glass_is_covered_by_what_it_does_not_transmit(made, read):
    """Of the light at right angles glass of index 1.5 reflects 4 %; masks have no glass."""
    glass = {"transmissionFactor": 0.75}
    made.material |= {"extensions": {"KHR_materials_transmission": glass}}
    scene = read(made)
    assert scene.notes == ()
    material = scene.parts[0].material
    assert material.alpha_mode == "blend"
    assert material.opacity == pytest.approx(1 - 0.96 * 0.75)
    made.material |= {
        "alphaMode": "BLEND",
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]},
    }
    assert read(made).parts[0].material.opacity == pytest.approx(0.5 * (1 - 0.96 * 0.75))
    glass["transmissionTexture"] = {"index": 0}
    assert len(read(made).notes) == 1
    made.material["alphaMode"] = "MASK"
    scene = read(made)
    assert (scene.parts[0].material.opacity, len(scene.notes)) == (1, 1)
    made.material["extensions"] = {"KHR_materials_transmission": {}}  # none, by default
    made.material["alphaMode"] = "OPAQUE"
    scene = read(made)
    assert (scene.parts[0].material.alpha_mode, scene.notes) == ("opaque", ())


def test_glow_and_unlit(made, read):
    made.material |= {
        "emissiveFactor": [0.5, 0, 1],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}},
    }
    assert read(made).parts[0].material.emission == (2, 0, 4)
    made.material["extensions"]["KHR_materials_unlit"] = {}
    material = read(made).parts[0].material
    assert material.is_unlit
    assert material.emission == (0, 0, 0)


def test_glow_and_occlusion_by_textures(made, read):
    made.paint()
    made.material |= {
        "emissiveFactor": [0.5, 0, 1],
        "emissiveTexture": {"index": 0},
        "occlusionTexture": {"index": 0, "strength": 0.25},
    }
    material = read(made).parts[0].material
    assert material.emission == (0.5, 0, 1)
    assert material.emission_image is material.image  # both colours
    assert material.occlusion_image.is_data
    assert material.occlusion == 0.25
    made.material["emissiveFactor"] = [0, 0, 0]
    assert read(made).parts[0].material.emission_image is None
    made.material |= {"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 9}}
    scene = read(made)  # what is mostly black is not to glow everywhere
    assert scene.parts[0].material.emission == (0, 0, 0)
    assert scene.notes == (LOST,)
    made.material["extensions"] = {"KHR_materials_unlit": {}}
    material = read(made).parts[0].material
    assert (material.emission_image, material.occlusion_image) == (None, None)


def test_what_is_not_read_of_a_material_is_noted(made, read):
    made.material["extensions"] = {"KHR_materials_clearcoat": {"clearcoatFactor": 1}}
    assert read(made).notes == ("m.glb: materials' KHR_materials_clearcoat left out: 1",)


def test_opacity_of_vertices(made, read):
    made.attributes["COLOR_0"] = made.accessor(np.full((4, 4), 0.5, "f4"))
    for mode, is_transparent, has_holes in ("BLEND", True, False), ("MASK", False, True):
        made.material["alphaMode"] = mode
        (part,) = read(made).parts
        assert part.mesh.alpha.tolist() == [[0.5]] * 4
        assert (part.is_transparent, part.has_holes) == (is_transparent, has_holes)
        assert part.transmits
        assert "1 part is transparent" in describe_opaque(read(made), [0])
    made.attributes["COLOR_0"] = made.accessor(np.ones((4, 4), "f4"))
    assert not read(made).parts[0].transmits
    made.material["alphaMode"] = "OPAQUE"
    made.attributes["COLOR_0"] = made.accessor(np.full((4, 4), 0.5, "f4"))
    assert read(made).parts[0].mesh.alpha is None


def test_colours_of_older_files(made, read):
    old = {"diffuseFactor": [0.1, 0.2, 2, 1]}
    made.material["extensions"] = {"KHR_materials_pbrSpecularGlossiness": old}
    assert read(made).parts[0].color == (0.1, 0.2, 1)  # and no more than all


def test_odd_attributes_are_noted_and_left_out(made, read):
    made.attributes["NORMAL"] = made.accessor(np.zeros((3, 3), "f4"))
    made.attributes["TEXCOORD_0"] = 99
    scene = read(made)
    assert scene.parts[0].mesh.normals is None
    assert scene.parts[0].mesh.uv is None
    (note,) = scene.notes
    assert note.endswith("that do not fit their vertices, left out: 2")


def shine(document, **light):
    document.tree["extensions"] = {"KHR_lights_punctual": {"lights": [light]}}
    # glTF's x, y, z are east, up and south.
    half = float(np.sqrt(0.5))
    document.node(
        translation=[1, 2, 3],
        rotation=[-half, 0, 0, half],  # -z, where lights shine, turns down
        scale=[2, 2, 2],
        extensions={"KHR_lights_punctual": {"light": 0}},
    )


def test_points_directions_and_cones(made, read):
    shine(made, type="point", intensity=60, color=[1, 0.5, 0], range=12)
    (light,) = read(made).lights
    np.testing.assert_allclose(light.position, [1, -3, 2, 1])
    assert light.color == (60, 30, 0)
    assert (light.range, light.attenuation, light.axis) == (12, (0, 0, 1), None)
    # At 3 m: candela by the square of the distance, faded toward the range.
    np.testing.assert_allclose(
        light.find_intensity(np.array([1.0, -3, 5])), np.array([60, 30, 0]) / 9 * (1 - 1 / 256)
    )
    made.tree["extensions"]["KHR_lights_punctual"]["lights"] = [{"type": "directional"}]
    (light,) = read(made).lights
    np.testing.assert_allclose(
        light.position[:3] / np.linalg.norm(light.position), [0, 0, 1], atol=1e-9
    )
    assert not light.is_point
    cone = {"outerConeAngle": np.pi / 6, "innerConeAngle": np.pi / 9}
    made.tree["extensions"]["KHR_lights_punctual"]["lights"] = [{"type": "spot", "spot": cone}]
    (light,) = read(made).lights
    np.testing.assert_allclose(light.axis, [0, 0, -1], atol=1e-9)
    np.testing.assert_allclose([light.half_angle, light.inner_angle], [30, 20])
    assert light.range == np.inf


def test_lights_that_are_not_there_or_unknown_are_named(made, read):
    shine(made, type="laser")
    with pytest.raises(InputError, match="light 0 is of the kind 'laser'"):
        read(made)
    made.tree["extensions"]["KHR_lights_punctual"]["lights"] = []
    with pytest.raises(InputError, match=r"KHR_lights_punctual names lights\[0\]"):
        read(made)


def test_trimesh_writes_textures_that_we_read(tmp_path):
    import trimesh  # noqa: PLC0415 - slow to import

    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    picture = PIL.Image.fromarray(PIXELS)
    material = trimesh.visual.material.PBRMaterial(
        baseColorTexture=picture, baseColorFactor=[255, 128, 255, 255]
    )
    made = trimesh.Trimesh(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
        [[0, 1, 2], [0, 2, 3]],
        visual=trimesh.visual.TextureVisuals(uv, material=material),
        process=False,
    )
    path = tmp_path / "m.glb"
    path.write_bytes(trimesh.Scene(made).export(file_type="glb"))
    (part,) = umbra.read(path, up="z").parts
    np.testing.assert_array_equal(part.material.texture[..., :3], PIXELS)
    # trimesh counts v from the bottom, as OBJ does.
    np.testing.assert_allclose(part.mesh.uv, np.stack([uv[:, 0], 1 - uv[:, 1]], 1), atol=1e-6)
    assert part.color[1] == pytest.approx(0.5, abs=0.01)


def test_metal_roughness_and_normals_are_read(made, read):
    made.paint()
    base = made.material["pbrMetallicRoughness"]
    base |= {
        "metallicFactor": 0.25,
        "roughnessFactor": 0.5,
        "metallicRoughnessTexture": {"index": 0},
    }
    made.material["normalTexture"] = {"index": 0, "scale": 0.75}
    (part,) = read(made).parts
    material = part.material
    assert (material.metallic, material.roughness, material.normal_scale) == (0.25, 0.5, 0.75)
    assert not material.image.is_data
    assert material.gloss_image.is_data
    assert material.normal_image is material.gloss_image
    # Numbers are as stored, colours are decoded from sRGB.
    np.testing.assert_array_equal(
        sample(material.normal_image, np.array([0.25, 0.25]))[:3], (1, 0, 0)
    )


def test_defaults_of_metal_and_roughness_are_gltfs(made, read):
    made.material["pbrMetallicRoughness"] = {}
    (part,) = read(made).parts
    assert (part.material.metallic, part.material.roughness) == (1.0, 1.0)
    made.material["extensions"] = {"KHR_materials_unlit": {}}
    (part,) = read(made).parts
    assert part.material.roughness is None


def test_two_sets_of_coordinates_and_no_third(made, read):
    second = np.array([[0, 0], [0.5, 0], [0, 0.5], [0.5, 0.5]], "f4")
    made.attributes["TEXCOORD_1"] = made.accessor(second)
    made.paint()
    made.material["normalTexture"] = {"index": 0, "texCoord": 1}
    made.material["occlusionTexture"] = {"index": 0, "texCoord": 1}
    scene = read(made)
    (part,) = scene.parts
    material = part.material
    assert (material.image.uv_set, material.normal_image.uv_set) == (0, 1)
    assert material.occlusion_image is material.normal_image
    np.testing.assert_array_equal(part.mesh.uv2, second)
    assert scene.notes == ()
    # The tangents are those of the normals' own coordinates: u runs along x and against x.
    assert part.mesh.tangents.any()
    twice = {"KHR_texture_transform": {"scale": [2, 2]}}
    made.material["occlusionTexture"] = {"index": 0, "extensions": twice}
    scene = read(made)
    assert scene.parts[0].material.occlusion_image is None
    assert scene.notes == (
        "m.glb: textures of a material with a third set of coordinates, left out: 1",
    )
    del made.material["normalTexture"]
    (part,) = read(made).parts
    assert part.material.occlusion_image.uv_set == 1
    np.testing.assert_array_equal(part.mesh.uv2, 2 * part.mesh.uv)


def test_tangents_are_the_files_or_those_of_mikktspace(made, read):
    made.paint()
    (plain,) = read(made).parts
    assert plain.mesh.tangents is None  # without a normal map nothing needs them
    made.material["normalTexture"] = {"index": 0}
    (found,) = read(made).parts
    np.testing.assert_allclose(found.mesh.tangents, [(1, 0, 0, 1)] * 4, atol=1e-6)
    given = np.tile(np.array([0, 1, 0, -1], "f4"), (4, 1))
    made.attributes["TANGENT"] = made.accessor(given)
    (part,) = read(made).parts
    np.testing.assert_array_equal(part.mesh.tangents, given)
    made.primitive["targets"] = [{"POSITION": made.attributes["POSITION"]}]
    (bending,) = read(made).parts
    assert bending.mesh.tangents is None
    del made.primitive["targets"], made.attributes["NORMAL"]
    (flat,) = read(made).parts
    assert flat.mesh.tangents is None


def test_a_lost_gloss_makes_no_metal(made, read):
    made.paint()
    made.tree["images"].append({"uri": "nowhere.png"})
    made.tree["textures"].append({"source": 1})
    made.material["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {"index": 1}
    scene = read(made)
    assert scene.parts[0].material.roughness is None
    assert scene.parts[0].material.image is not None
