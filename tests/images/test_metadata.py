"""Attributes of the images, and which images are complete."""

import json
import os
from fractions import Fraction

import numpy as np

from quiltcli.formats.exr.image import read_header, write_exr
from quiltcli.images.metadata import facet_attributes, is_complete
from tests.helpers.noise_images import VIEWER, noise, provenance


def test_attributes_come_back(tmp_path):
    path = tmp_path / "a.exr"
    facet_from_world = np.arange(12).reshape(3, 4) / 7
    write_exr(path, noise(), provenance() | facet_attributes(17, facet_from_world))
    found = read_header(path).attributes
    assert found["quilt:frame"] == -7
    for name in ("eye", "look", "up"):
        assert found[f"quilt:{name}"].dtype == np.float32
        np.testing.assert_array_equal(getattr(VIEWER, name).astype(np.float32), found[f"quilt:{name}"])
    assert np.float32(0.05) == np.float32(found["quilt:near"])
    assert found["quilt:far"] == 50.0
    assert found["quilt:depth"] == "planar"
    assert found["quilt:job"] == "ab" * 32
    assert found["quilt:version"] == "0.1.0"
    assert found["framesPerSecond"] == Fraction(30000, 1001)
    assert found["quilt:facet"] == 17
    numbers = [float(word) for word in found["quilt:facet_from_world"].split()]
    np.testing.assert_array_equal(facet_from_world.ravel(), numbers)


def test_the_eye_is_a_v3f(tmp_path):
    path = tmp_path / "a.exr"
    write_exr(path, noise(), provenance())
    assert b"quilt:eye\0v3f\0" in path.read_bytes()


def test_the_pose_is_there_to_the_last_bit(tmp_path):
    path = tmp_path / "a.exr"
    write_exr(path, noise(), provenance())
    pose = json.loads(read_header(path).attributes["quilt:pose"])
    for name in ("eye", "look", "up"):
        assert pose[name] == getattr(VIEWER, name).tolist()
    assert (pose["near"], pose["far"]) == (VIEWER.near, VIEWER.far)


def test_complete_means_whole_and_of_this_job(tmp_path):
    path, sha = tmp_path / "a.exr", "ab" * 32
    assert not is_complete(path, sha, -7)
    write_exr(path, noise(), provenance())
    assert is_complete(path, sha, -7)
    assert not is_complete(path, "cd" * 32, -7)
    assert not is_complete(path, sha, 7)
    os.truncate(path, path.stat().st_size - 1)
    assert not is_complete(path, sha, -7)


def test_an_image_of_another_program_is_never_complete(tmp_path):
    write_exr(tmp_path / "a.exr", noise(), {})
    assert not is_complete(tmp_path / "a.exr", "", 0)
