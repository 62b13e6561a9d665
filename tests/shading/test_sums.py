"""Sums of samples: mattes that recombine to alpha, whatever the number of names and of workers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.formats.exr.cryptomatte import attributes, identity_bits
from quiltcli.formats.exr.image import write_exr
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from tests.helpers.ball_setup import ball_scene, stage_of_facets
from tests.helpers.in_memory import panel, viewer


def ranks(buffers, layer="CryptoObject"):
    """Identities and coverage (6, pixels)."""
    names = [f"{layer}{k:02d}.{pair}" for k in range(3) for pair in ("RG", "BA")]
    identity = np.stack([buffers[name[:-1]] for name in names]).view(np.uint32)
    return identity, np.stack([buffers[f"{name[:-2]}{name[-1]}"] for name in names])


def drawn(samples, names, channels=("rgba", "cryptoobject", "cryptomaterial")):
    """A ball of so many named objects, triangle by triangle in turn."""
    scene = ball_scene(2, 0.6)
    count = len(scene.triangles)
    scene = replace(
        scene,
        object=np.arange(count, dtype=np.int32) % len(names),
        objects=tuple(names),
        material_names=("skin", "bone"),
        material_name=np.arange(count, dtype=np.int32) // (count // 2),
    )
    stage = stage_of_facets(panel(density=24), scene)
    job = stage.job
    job = job.model_copy(
        update={
            "render": job.render.model_copy(update={"samples": samples}),
            "output": job.output.model_copy(update={"channels": channels}),
        }
    )
    stage = replace(stage, job=job)
    buffers = new_buffers(stage)
    draw_frame(stage, viewer((0.3, 0.2, 2.9)), buffers)
    return buffers


@pytest.mark.parametrize("samples", [1, 4, 13])
def test_mattes_add_up_to_alpha_to_the_last_bit(samples):
    buffers = drawn(samples, ["bunny", "dragon", "armadillo"])
    for layer, names in (
        ("CryptoObject", ("bunny", "dragon", "armadillo")),
        ("CryptoMaterial", ("skin", "bone")),
    ):
        identity, share = ranks(buffers, layer)
        total = share.sum(axis=0, dtype=np.float32)
        np.testing.assert_array_equal(total.astype(np.float16), buffers["A"])
        assert set(np.unique(identity)) == {0, *map(identity_bits, names)}
        assert (np.diff(share, axis=0) <= 0).all(), "the greatest share comes first"
        assert ((share > 0) == (identity != 0)).all()


def test_a_matte_is_the_share_of_samples_that_see_a_name():
    """The bunny alone, as alpha, is the bunny's part of the matte of all."""
    names = ["bunny", "dragon"]
    identity, share = ranks(drawn(16, names))
    bunny = np.where(identity == identity_bits("bunny"), share, 0).sum(axis=0)
    dragon = np.where(identity == identity_bits("dragon"), share, 0).sum(axis=0)
    assert set(np.unique(bunny * 16)) <= set(range(17))
    mixed = np.count_nonzero((bunny > 0) & (dragon > 0))
    assert mixed > 50


def test_names_beyond_the_ranks_are_left_out():
    identity, share = ranks(drawn(64, [f"leaf{k}" for k in range(80)]))
    assert (np.count_nonzero(share, axis=0) == 6).any()
    for column in np.flatnonzero(share[0])[::7]:
        seen = identity[:, column][identity[:, column] > 0]
        assert len(set(seen.tolist())) == len(seen)


def test_two_objects_of_one_name_are_one_matte():
    identity, share = ranks(drawn(4, ["tree", "tree"]))
    assert set(np.unique(identity[0])) == {0, identity_bits("tree")}
    assert not share[1].any()


def test_another_reader_finds_the_same_mattes(tmp_path):
    other = pytest.importorskip("cryptomatte_api", reason="cryptomatte-api is not installed")
    names = ["bunny", "dragon", "armadillo"]
    buffers = drawn(9, names)
    side = round(buffers["A"].size ** 0.5)
    width = next(w for w in range(side, 0, -1) if buffers["A"].size % w == 0)
    pixels = {name: flat.reshape(-1, width) for name, flat in buffers.items()}
    told = attributes("CryptoObject", names) | attributes("CryptoMaterial", ["skin", "bone"])
    write_exr(tmp_path / "mattes.exr", pixels, told)
    for matte in other.Cryptomatte.load(str(tmp_path / "mattes.exr")):
        masks = matte.masks()
        assert set(masks) in ({*names}, {"skin", "bone"})
        total = sum(np.asarray(mask, dtype=np.float32) for mask in masks.values())
        np.testing.assert_allclose(total, pixels["A"], atol=2**-11)
