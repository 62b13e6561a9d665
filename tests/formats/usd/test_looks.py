"""Materials and lights of stages."""

# ruff: noqa: E501 - exact messages are easier to read, and to find, unbroken

from __future__ import annotations

import math

import numpy as np
import pytest
from PIL import Image

from quiltcli.errors import MeshError, SceneError
from quiltcli.formats.packages import read_file
from quiltcli.scene.importers.usd import read_usd_model
from quiltcli.scene.materials import Surface
from quiltcli.scene.textures.picture import Picture
from tests.helpers.usd_files import bound, material, mesh, moved, needs_usd, notices, parts_of, stage, xform

needs_usd()


def surface(folder, *inputs, nodes="", more="", **meta):
    """The surface of a square that is made of a material."""
    looks = bound("m")
    looks["more"] += f"\n{more}"
    path = stage(folder / "a.usda", material("m", *inputs, nodes=nodes), mesh(**looks), **meta)
    return parts_of(path)[0].surface


def texture(name="t", file="a.png", more="", reader="st"):
    """A node that looks a picture up by a primvar."""
    return (
        f'def Shader "{name}"\n{{\nuniform token info:id = "UsdUVTexture"\nasset inputs:file = @{file}@\n'
        f"float2 inputs:st.connect = </m/{name}_st.outputs:result>\n{more}\n"
        "float3 outputs:rgb\nfloat outputs:r\nfloat outputs:g\nfloat outputs:a\n}\n"
        f'def Shader "{name}_st"\n{{\nuniform token info:id = "UsdPrimvarReader_float2"\n'
        f'string inputs:varname = "{reader}"\nfloat2 outputs:result\n}}\n'
    )


def from_texture(name, output="rgb", node="t"):
    """An input that a picture gives."""
    kind = "color3f" if output == "rgb" else "float"
    return f"{kind} inputs:{name}.connect = </m/{node}.outputs:{output}>"


@pytest.fixture
def folder(tmp_path):
    Image.new("RGBA", (2, 2), (10, 20, 30, 40)).save(tmp_path / "a.png")
    return tmp_path


def test_a_mesh_without_a_material_is_as_other_files_have_it(tmp_path):
    (part,) = parts_of(stage(tmp_path / "a.usda", mesh(more="uniform bool doubleSided = true")))
    assert part.surface == Surface()


def test_a_material_that_says_nothing_is_the_specifications(tmp_path):
    found = surface(tmp_path)
    assert found.color == pytest.approx((0.18, 0.18, 0.18), abs=1e-7)
    assert (found.metallic, found.roughness, found.opacity, found.alpha) == (0, 0.5, 1, "opaque")
    assert not found.double_sided


def test_numbers_are_taken_as_they_are(tmp_path):
    found = surface(
        tmp_path,
        "color3f inputs:diffuseColor = (0.5, 0.25, 0)",
        "color3f inputs:emissiveColor = (4, 0, 0)",
        "float inputs:metallic = 0.5",
        "float inputs:roughness = 0.75",
        "float inputs:opacity = 0.25",
    )
    assert (found.color, found.emission) == ((0.5, 0.25, 0), (4, 0, 0))
    assert (found.metallic, found.roughness, found.opacity, found.alpha) == (0.5, 0.75, 0.25, "blend")


def test_a_threshold_makes_a_mask(tmp_path):
    found = surface(tmp_path, "float inputs:opacity = 0.25", "float inputs:opacityThreshold = 0.5")
    assert (found.alpha, found.cutoff, found.opacity) == ("mask", 0.5, 0.25)


def test_inputs_may_come_from_the_materials_interface(tmp_path):
    path = stage(
        tmp_path / "a.usda",
        material(
            "m", "float inputs:roughness.connect = </m.inputs:rough>", nodes="float inputs:rough = 0.125"
        ),
        mesh(**bound("m")),
    )
    assert parts_of(path)[0].surface.roughness == 0.125


def test_the_specular_workflow_has_no_metal(tmp_path):
    found = surface(
        tmp_path,
        "int inputs:useSpecularWorkflow = 1",
        "float inputs:metallic = 1",
        "color3f inputs:specularColor = (0.02, 0.02, 0.02)",
    )
    assert (found.metallic, found.specular) == (0, pytest.approx(0.5))


def test_pictures_vary_what_they_are_connected_to(folder):
    found = surface(
        folder,
        from_texture("diffuseColor"),
        from_texture("roughness", "g"),
        from_texture("opacity", "a"),
        nodes=texture(
            more='token inputs:wrapS = "clamp"\ntoken inputs:wrapT = "mirror"\nfloat4 inputs:scale = (1, 0.5, 1, 1)'
        ),
    )
    assert (found.color, found.roughness, found.opacity, found.alpha) == ((1, 0.5, 1), 1, 1, "blend")
    by_role = {one.role: one for one in found.textures}
    assert set(by_role) == {"color", "roughness", "opacity"}
    assert by_role["roughness"].channel == "g"
    assert by_role["roughness"].gain == (0, 0.5)
    assert by_role["opacity"].channel == "a"
    assert by_role["color"].opaque
    assert by_role["color"].wrap == ("clamp", "mirror")
    assert by_role["color"].picture == Picture(str(folder / "a.png"))
    assert by_role["color"].use == "material /m, diffuseColor"


def test_raw_pictures_are_not_decoded(folder):
    found = surface(
        folder, from_texture("diffuseColor"), nodes=texture(more='token inputs:sourceColorSpace = "raw"')
    )
    assert found.textures[0].raw


def test_normal_maps_of_the_usual_scale_have_the_strength_1(folder):
    more = "float4 inputs:scale = (2, 2, 2, 1)\nfloat4 inputs:bias = (-1, -1, -1, 0)"
    found = surface(folder, from_texture("normal"), nodes=texture(more=more))
    assert (found.textures[0].role, found.textures[0].strength) == ("normal", 1)


def test_coordinates_are_scaled_then_turned_then_moved(folder):
    change = (
        'def Shader "change"\n{\nuniform token info:id = "UsdTransform2d"\n'
        "float2 inputs:in.connect = </m/t_st.outputs:result>\nfloat inputs:rotation = 90\n"
        "float2 inputs:scale = (2, 3)\nfloat2 inputs:translation = (0.25, 0.5)\nfloat2 outputs:result\n}\n"
    )
    nodes = texture().replace("</m/t_st.outputs:result>", "</m/change.outputs:result>", 1) + change
    (found,) = surface(folder, from_texture("diffuseColor"), nodes=nodes).textures
    rows = np.array(found.matrix).reshape(2, 3)
    for u, v in ((0, 0), (1, 0), (0.25, 0.75)):
        # (u, v) · (2, 3), a quarter turn against the clock, then the shift; v up.
        expected = -3 * v + 0.25, 2 * u + 0.5
        across, down = rows @ (u, 1 - v, 1)
        np.testing.assert_allclose((across, 1 - down), expected, atol=1e-12)


def test_two_sets_of_coordinates_are_told_apart_by_their_primvars(folder):
    sets = (
        'texCoord2f[] primvars:a = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")\n'
        'texCoord2f[] primvars:b = [(0, 0), (2, 0), (2, 2), (0, 2)] (interpolation = "faceVarying")'
    )
    nodes = texture("t", reader="a") + texture("s", reader="b")
    looks = bound("m")
    looks["more"] += f"\n{sets}"
    path = stage(
        folder / "a.usda",
        material("m", from_texture("diffuseColor"), from_texture("roughness", "g", "s"), nodes=nodes),
        mesh(**looks),
    )
    (part,) = parts_of(path)
    assert {one.role: one.uv_set for one in part.surface.textures} == {"color": 0, "roughness": 1}
    assert part.uv[2].tolist() == [1, 1]
    assert part.uv1[2].tolist() == [2, 2]


def test_colors_may_come_from_a_primvar(tmp_path):
    nodes = (
        'def Shader "c"\n{\nuniform token info:id = "UsdPrimvarReader_float3"\n'
        'string inputs:varname = "tint"\nfloat3 outputs:result\n}\n'
    )
    looks = bound("m")
    looks["more"] += '\ncolor3f[] primvars:tint = [(0.5, 0, 0)] (interpolation = "constant")'
    path = stage(
        tmp_path / "a.usda",
        material("m", "color3f inputs:diffuseColor.connect = </m/c.outputs:result>", nodes=nodes),
        mesh(**looks),
    )
    (part,) = parts_of(path)
    assert part.surface.color == (1, 1, 1)
    np.testing.assert_array_equal(part.colors, [(0.5, 0, 0)] * 4)


def test_colours_of_a_mesh_are_of_no_account_under_a_material(tmp_path):
    looks = bound("m")
    looks["more"] += '\ncolor3f[] primvars:displayColor = [(0.5, 0, 0)] (interpolation = "constant")'
    (part,) = parts_of(stage(tmp_path / "a.usda", material("m"), mesh(**looks)))
    assert part.colors is None


def test_opacities_of_a_mesh_let_light_through(tmp_path):
    more = 'float[] primvars:displayOpacity = [0.5] (interpolation = "constant")'
    (part,) = parts_of(stage(tmp_path / "a.usda", mesh(more=more)))
    assert part.surface.alpha == "blend"
    np.testing.assert_array_equal(part.opacities, [0.5] * 4)


def test_subsets_of_faces_have_materials_of_their_own(tmp_path):
    subset = (
        'def GeomSubset "s" (prepend apiSchemas = ["MaterialBindingAPI"])\n{\nuniform token elementType = "face"\n'
        'uniform token familyName = "materialBind"\nint[] indices = [1]\nrel material:binding = </n>\n}\n'
    )
    looks = bound("m")
    looks["more"] += f"\n{subset}"
    two = mesh(counts=[3, 3], indices=[0, 1, 2, 0, 2, 3], **looks)
    path = stage(
        tmp_path / "a.usda", material("m"), material("n", "color3f inputs:diffuseColor = (1, 0, 0)"), two
    )
    found = {part.material: part for part in parts_of(path)}
    assert set(found) == {"m", "n"}
    np.testing.assert_array_equal(
        found["n"].vertices[found["n"].triangles[0]], [(0, 0, 0), (1, 1, 0), (0, 1, 0)]
    )
    path.write_text(path.read_text().replace("indices = [1]", "indices = [2]"))
    with pytest.raises(MeshError, match=r"/square/s\.indices: names face 2 of 2"):
        parts_of(path)


def test_bindings_are_inherited(tmp_path):
    group = xform(
        "x", mesh(), ops="rel material:binding = </m>", meta='prepend apiSchemas = ["MaterialBindingAPI"]'
    )
    (part,) = parts_of(stage(tmp_path / "a.usda", material("m", "float inputs:roughness = 0.125"), group))
    assert part.surface.roughness == 0.125


def test_materials_of_other_kinds_are_spoken_of(tmp_path):
    other = material("m").replace("UsdPreviewSurface", "ND_standard_surface")
    path = stage(tmp_path / "a.usda", other, mesh(**bound("m")))
    assert notices(path) == ("no UsdPreviewSurface, drawn by displayColor: /m",)
    assert parts_of(path)[0].surface == Surface(double_sided=False)


def test_what_is_not_drawn_of_a_material_is_said_once(tmp_path):
    path = stage(
        tmp_path / "a.usda",
        material("m", "float inputs:clearcoat = 1"),
        material("n", "float inputs:clearcoat = 0.5", "float inputs:ior = 2"),
        mesh("a", **bound("m")),
        mesh("b", **bound("n")),
    )
    assert notices(path) == ("clearcoat is not drawn (/m, /n)", "ior is not drawn (/n)")


def test_pictures_in_tiles_are_an_error(folder):
    with pytest.raises(
        MeshError, match=r"/m/t\.inputs:file: is 'a\.<UDIM>\.png': pictures in UDIM tiles are not read"
    ):
        surface(folder, from_texture("diffuseColor"), nodes=texture(file="a.<UDIM>.png"))


def test_coordinates_that_go_round_are_an_error(folder):
    ring = (
        'def Shader "change"\n{\nuniform token info:id = "UsdTransform2d"\n'
        "float2 inputs:in.connect = </m/change.outputs:result>\nfloat2 outputs:result\n}\n"
    )
    nodes = texture().replace("</m/t_st.outputs:result>", "</m/change.outputs:result>", 1) + ring
    with pytest.raises(MeshError, match="/m/t: has texture coordinates that go round in a circle"):
        surface(folder, from_texture("diffuseColor"), nodes=nodes)


def test_a_picture_without_a_file_gives_its_fallback(folder):
    nodes = texture(more="float4 inputs:fallback = (0.5, 0.25, 0, 1)").replace(
        "asset inputs:file = @a.png@\n", ""
    )
    found = surface(folder, from_texture("diffuseColor"), nodes=nodes)
    assert (found.color, found.textures) == ((0.5, 0.25, 0), ())


def test_a_picture_that_is_not_there_is_where_it_would_be(tmp_path):
    (found,) = surface(tmp_path, from_texture("diffuseColor"), nodes=texture(file="./tex/gone.png")).textures
    with pytest.raises(SceneError, match=r"tex/gone.png: material /m, diffuseColor: no such file"):
        found.picture.size(found.use)


def test_pictures_inside_of_packages_are_read(folder):
    from pxr import UsdUtils

    path = stage(
        folder / "a.usda",
        material("m", from_texture("diffuseColor"), nodes=texture()),
        mesh(**bound("m")),
    )
    assert UsdUtils.CreateNewUsdzPackage(str(path), str(folder / "b.usdz"))
    (folder / "a.png").unlink()
    path.unlink()
    (part,) = parts_of(folder / "b.usdz")
    (found,) = part.surface.textures
    assert found.picture.pixels("x")[0, 0].tolist() == [10, 20, 30, 40]
    with pytest.raises(SceneError, match="no such file in the package"):
        read_file(f"{folder}/b.usdz[0/gone.png]", SceneError, "a picture")


def lights(folder, *body, **meta):
    return read_usd_model(stage(folder / "a.usda", mesh(), *body, **meta)).lights()


def light(kind, *inputs):
    lines = "\n".join(inputs)
    return moved("at", (1, 2, 3), f'def {kind} "light"\n{{\n{lines}\n}}\n')


def test_a_sphere_is_a_point_of_its_intensity(tmp_path):
    (found,) = lights(
        tmp_path,
        light(
            "SphereLight",
            "float inputs:intensity = 10",
            "float inputs:exposure = 1",
            "float inputs:radius = 0.5",
        ),
    )
    assert (found.kind, found.position) == ("point", (1, 2, 3))
    assert found.color == pytest.approx((20 * math.pi / 4,) * 3)


@pytest.mark.parametrize("metres", [1, 0.01])
def test_a_normalized_sphere_is_as_bright_at_any_size(tmp_path, metres):
    more = "float inputs:intensity = 8", "float inputs:radius = 0.125", "bool inputs:normalize = true"
    (found,) = lights(tmp_path, light("SphereLight", *more), metersPerUnit=metres)
    assert found.color == pytest.approx((2 * metres**2,) * 3)


def test_a_sphere_that_is_shaped_to_a_cone_is_a_spot(tmp_path):
    more = "float inputs:shaping:cone:angle = 30", "float inputs:shaping:cone:softness = 0.25"
    (found,) = lights(tmp_path, light("SphereLight", *more))
    assert (found.kind, found.direction) == ("spot", (0, 0, -1))
    assert found.cone == pytest.approx((math.radians(22.5), math.radians(30)))


def test_a_sun_has_the_irradiance_of_its_disc(tmp_path):
    (found,) = lights(
        tmp_path, light("DistantLight", "float inputs:intensity = 1000", "float inputs:angle = 2")
    )
    assert (found.kind, found.direction) == ("directional", (0, 0, -1))
    assert found.color == pytest.approx((1000 * math.pi * math.sin(math.radians(1)) ** 2,) * 3)
    (found,) = lights(
        tmp_path, light("DistantLight", "float inputs:intensity = 3", "bool inputs:normalize = true")
    )
    assert found.color == pytest.approx((3, 3, 3))


def test_a_rectangle_shines_along_its_negative_z(tmp_path):
    more = "float inputs:width = 4", "float inputs:height = 2", "float inputs:intensity = 16"
    (found,) = lights(tmp_path, light("RectLight", *more), metersPerUnit=0.5)
    assert (found.kind, found.position) == ("area", (0.5, 1, 1.5))
    np.testing.assert_allclose(np.cross(found.across, found.along), (0, 0, -0.5))
    assert found.color == (16, 16, 16)
    (found,) = lights(tmp_path, light("RectLight", *more, "bool inputs:normalize = true"))
    assert found.color == (2, 2, 2)


def test_a_dome_without_a_picture_is_ambient(tmp_path):
    (found,) = lights(tmp_path, light("DomeLight", "color3f inputs:color = (1, 0.5, 0)"))
    assert (found.kind, found.color) == ("ambient", (1, 0.5, 0))


def test_a_domes_picture_has_z_in_its_middle(tmp_path):
    (found,) = lights(tmp_path, light("DomeLight", "asset inputs:texture:file = @sky.exr@"))
    assert (found.kind, found.panorama) == ("environment", str(tmp_path / "sky.exr"))
    # Ours has -Z in its middle and X to the right; a dome's +Z and -X.
    axes = np.array(found.axes).reshape(3, 3)
    np.testing.assert_allclose(axes @ (0, 0, -1), (0, 0, 1), atol=1e-12)
    np.testing.assert_allclose(axes @ (1, 0, 0), (-1, 0, 0), atol=1e-12)
    np.testing.assert_allclose(axes @ (0, 1, 0), (0, 1, 0), atol=1e-12)


def test_hidden_lights_and_those_of_other_kinds_do_not_shine(tmp_path):
    body = (
        light("SphereLight", 'token visibility = "invisible"'),
        light("CylinderLight").replace("at", "other", 1),
    )
    assert lights(tmp_path, *body) == ()
    assert notices(tmp_path / "a.usda") == ("/other/light: is a CylinderLight, which does not shine here",)


def test_lights_of_time_change(tmp_path):
    path = stage(
        tmp_path / "a.usda",
        mesh(),
        light("SphereLight", "float inputs:intensity.timeSamples = {0: 0, 24: 8}"),
    )
    model = read_usd_model(path)
    assert model.clips
    assert model.lights(0.5)[0].color[0] == pytest.approx(math.pi)


def test_numbers_of_lights_that_make_no_sense_are_errors(tmp_path):
    with pytest.raises(MeshError, match=r"/at/light.inputs:radius: is -1 \(expected a number, 0 or more\)"):
        lights(tmp_path, light("SphereLight", "float inputs:radius = -1"))
