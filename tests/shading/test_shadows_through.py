"""The shadows of surfaces that light may pass: it is dimmed by what they hold up, and by nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import quiltcli
from quiltcli.scene.lights import Ambient
from quiltcli.scene.scene import ALPHAS
from quiltcli.visibility.rays.blockers import blockers_of
from quiltcli.visibility.rays.embree import has_embree
from tests.helpers.shadow_scene import CENTRE, DISC, RADIUS, WALL, lamp, mesh, scene, seen, sun
from tests.shading.test_shadows import LAMP, circle_of, on_wall

pytestmark = pytest.mark.skipif(not has_embree(), reason="embreex is not installed")


def glassy(found, opacity, alpha="blend", cutoff=0.5):
    """The scene with its second object of this opacity."""
    table = found.materials
    two = {
        name: np.repeat(values, 2, axis=0)
        for name, values in vars(table).items()
        if isinstance(values, np.ndarray)
    }
    two["opacity"] = np.array([1, opacity], np.float32)
    two["alpha"] = np.array([0, ALPHAS.index(alpha)], np.int32)
    two["cutoff"] = np.full(2, cutoff, np.float32)
    return replace(found, materials=replace(table, **two), material=(found.object > 0).astype(np.int32))


def lit(drawn, **render):
    """The wall's red over what it is without anything before it, and how far from the shadow's middle."""
    bare = replace(drawn, triangles=drawn.triangles[:2])
    for name in ("flat", "object", "material"):
        bare = replace(bare, **{name: getattr(bare, name)[:2]})
    here, there = (on_wall(seen(one, **render)) for one in (drawn, bare))
    _, mine, other = np.intersect1d(
        here[0].astype(np.float32).view("f4,f4"),
        there[0].astype(np.float32).view("f4,f4"),
        return_indices=True,
    )
    return here[0][mine], here[1][mine].astype(float) / there[1][other]


@pytest.mark.parametrize("opacity", [0.25, 0.7])
@pytest.mark.parametrize("kind", ["point", "sun"])
def test_a_pane_dims_light_by_its_opacity(opacity, kind):
    light = lamp(LAMP) if kind == "point" else sun((0.5, -0.1, -1.0))
    place, share = lit(glassy(scene(light), opacity))
    middle, radius = circle_of(LAMP)
    if kind == "sun":
        middle, radius = CENTRE + np.array((0.5, -0.1)) * (DISC - WALL), RADIUS
    distance = np.linalg.norm(place - middle, axis=1)
    inside, outside = distance < radius - 1e-3, distance > radius + 1e-3
    assert inside.sum() > 100
    np.testing.assert_allclose(share[inside], 1 - opacity, rtol=2e-3)
    np.testing.assert_allclose(share[outside], 1, rtol=2e-3)


def test_panes_one_behind_the_other_are_multiplied_and_opaque_ones_end_it():
    drawn = scene(lamp(LAMP))
    count = len(drawn.triangles) - 2
    lifted = drawn.vertices.copy()
    lifted[:, 2] += 0.1
    vertices = np.concatenate((drawn.vertices, lifted))
    triangles = np.concatenate((drawn.triangles, drawn.triangles[2:] + len(lifted)))
    both = glassy(mesh(vertices, triangles, [0, 0] + [1] * (2 * count), lamp(LAMP)), 0.5)
    place, share = lit(both)
    middle, _ = circle_of(LAMP)
    near = np.linalg.norm(place - middle, axis=1) < 0.1
    assert near.sum() > 20
    np.testing.assert_allclose(share[near], 0.25, rtol=2e-3)
    assert set(np.round(share[(share < 0.9)], 2)) == {0.25, 0.5}
    shut = replace(both, material=np.where(np.arange(len(triangles)) >= 2 + count, 0, both.material))
    _, share = lit(replace(shut, material=shut.material.astype(np.int32)))
    assert (share[near] == 0).all()


@pytest.mark.parametrize(("opacity", "dark"), [(0.5, True), (0.4999, False)])
def test_a_mask_holds_up_all_or_nothing(opacity, dark):
    place, share = lit(glassy(scene(lamp(LAMP)), opacity, "mask"))
    middle, radius = circle_of(LAMP)
    inside = np.linalg.norm(place - middle, axis=1) < radius - 1e-3
    np.testing.assert_allclose(share[inside], 0 if dark else 1, rtol=2e-3)


def test_light_from_everywhere_is_dimmed_as_well():
    """A sheet close over all of a wall holds up its share of what comes from everywhere."""
    sky = (Ambient(np.full(3, 1, np.float32), shadows=True, rays=64),)
    corners = [(-4, -4, -2), (4, -4, -2), (4, 4, -2), (-4, 4, -2)]
    sheet = [(x * 40, y * 40, -1.9) for x, y, _ in corners]
    drawn = mesh(corners + sheet, [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)], [0, 0, 1, 1], sky)
    # The eye looks through the sheet: of the wall's share of the pixel it takes its own away.
    channels = [seen(replace(glassy(drawn, opacity), triangles=drawn.triangles)) for opacity in (0.5, 0.0)]
    half, none = (found["R"].astype(float) for found in channels)
    np.testing.assert_allclose(half, 0.5 * none + 0.5 * 0.5 * none, rtol=3e-3)


def test_one_scene_of_rays_holds_what_is_opaque_and_one_what_is_not():
    drawn = glassy(scene(lamp(LAMP)), 0.5)
    blockers = blockers_of(drawn)
    assert blockers.soft_triangles.tolist() == list(range(2, len(drawn.triangles)))
    assert blockers_of(replace(drawn, lets_light_by=(1,))).soft is None
    assert blockers_of(glassy(scene(lamp(LAMP)), 0.0)).soft is None


def fence(folder, alpha, shadows):
    """A picture of columns, half of them cut out, over a floor, in the light of a sun straight above."""
    pixels = np.full((8, 8, 4), 255, np.uint8)
    pixels[:, ::2, 3] = 0
    Image.fromarray(pixels).save(folder / "fence.png")
    (folder / "m.mtl").write_text("newmtl a\nmap_Kd fence.png\n")
    (folder / "fence.obj").write_text(
        "mtllib m.mtl\nv -1 1 -1\nv 1 1 -1\nv 1 1 1\nv -1 1 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl a\n"
        "f 1/1 2/2 3/3 4/4\n"
    )
    (folder / "floor.obj").write_text("v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nf 1 2 3 4\n")
    (folder / "d.obj").write_text("v -1 0.1 1\nv 1 0.1 1\nv 1 0.1 -1\nv -1 0.1 -1\nf 1 2 3 4\n")
    (folder / "d.yaml").write_text("quilt_display: 1\nmesh: d.obj\nresolution: {facet_pixels: [64, 16]}\n")
    (folder / "s.yaml").write_text(
        f"quilt_scene: 1\nobjects:\n- {{mesh: fence.obj, material: {{alpha: {alpha}}}}}\n"
        "- {mesh: floor.obj}\n"
        f"lights: [{{type: directional, direction: [0, -1, 0], color: [3, 3, 3], shadows: {shadows}}}]\n"
    )
    (folder / "j.yaml").write_text(
        "quilt_job: 1\ndisplay: d.yaml\nscene: s.yaml\nframes: 1\noutput: {channels: [rgba, P]}\n"
        "viewer: {near: 0.01, far: 9, path: {keyframes: "
        "[{frame: 1, position: [0, 0.9, 0], look_at: [0, 0, 0], up: [0, 0, -1]}]}}\n"
    )
    (frame,) = quiltcli.draw(folder / "j.yaml", threads=1)
    return frame.facet(1)


@pytest.mark.parametrize("alpha", ["mask", "blend"])
def test_a_picture_throws_its_shadow(tmp_path, alpha):
    """Between the middles of columns α runs straight from 0 to 1: what the floor gets is 1 − α there."""
    picture, bare = fence(tmp_path, alpha, "true"), fence(tmp_path, alpha, "false")
    some = np.flatnonzero(picture["A"][8] > 0)
    assert some.size > 50
    share = picture["R"][8][some].astype(float) / bare["R"][8][some]
    at = (picture["P.X"][8][some].astype(float) + 1) / 2 * 8 - 0.5
    rise = at - np.floor(at)
    held = np.where(np.floor(at) % 2 == 0, rise, 1 - rise)
    if alpha == "mask":
        sure = np.abs(held - 0.5) > 0.01
        np.testing.assert_array_equal(share[sure], held[sure] < 0.5)
    else:
        np.testing.assert_allclose(share, 1 - held, atol=4e-3)
