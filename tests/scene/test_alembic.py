"""Alembic archives: where their meshes are, what they carry, and how they move."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.errors import MeshError, MissingExtraError, SceneError
from quiltcli.job import load_scene_file
from quiltcli.scene import load_scene
from quiltcli.scene.importers.alembic import read_alembic_model
from quiltcli.scene.importers.model import Playing
from quiltcli.scene.motion import load_moving_scene

abc = pytest.importorskip("alembic3d", reason="the extra alembic is not installed")
imath = pytest.importorskip("imath")
GEOM, ABC = abc.AbcGeom, abc.Abc
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
CLOCKWISE = [0, 3, 2, 1]


def array(kind, rows, item=None):
    found = kind(len(rows))
    for number, row in enumerate(rows):
        found[number] = row if item is None else item(*row)
    return found


def vectors(rows):
    return array(imath.V3fArray, rows, imath.V3f)


class Writer:
    """An archive under construction; the library wants all its objects to live until it is closed."""

    def __init__(self, path, first=0.0):
        self.path = path
        self.archive = ABC.OArchive(str(path))
        sampling = abc.AbcCoreAbstract.TimeSampling(1 / 24, first)
        self.kept = [sampling, ABC.Argument(self.archive.addTimeSampling(sampling))]
        self.sampled = self.kept[1]
        self.top = self.archive.getTop()

    def xform(self, parent, name, *shifts):
        found = GEOM.OXform(parent, name, self.sampled)
        for shift in shifts:
            sample = GEOM.XformSample()
            sample.setTranslation(imath.V3d(*shift))
            found.getSchema().set(sample)
        self.kept.append(found)
        return found

    def mesh(self, parent, name, *samples, counts=(4,), uv=None, normals=None):
        """A mesh; each sample is points, or points, indices and counts."""
        found = GEOM.OPolyMesh(parent, name, self.sampled)
        for sample in samples or (SQUARE,):
            points, indices, own = sample if len(sample) == 3 else (sample, CLOCKWISE, counts)
            whole = GEOM.OPolyMeshSchemaSample(
                vectors(points), array(imath.IntArray, indices), array(imath.IntArray, own)
            )
            if uv is not None:
                pairs = array(imath.V2fArray, uv, imath.V2f)
                scope = GEOM.GeometryScope.kFacevaryingScope
                whole.setUVs(GEOM.OV2fGeomParamSample(pairs, scope))
            if normals is not None:
                scope = GEOM.GeometryScope.kVertexScope
                whole.setNormals(GEOM.ON3fGeomParamSample(vectors(normals), scope))
            found.getSchema().set(whole)
        self.kept.append(found)
        return found

    def close(self):
        self.kept.clear()
        self.top = self.archive = self.sampled = None
        return self.path


def corners(model, seconds=None, after="hold"):
    parts = model.parts(seconds, Playing(after=after))
    return np.concatenate([part.vertices[part.triangles] for part in parts])


@pytest.fixture
def square(tmp_path):
    writer = Writer(tmp_path / "a.abc")
    writer.mesh(writer.xform(writer.top, "x", (1, 2, 3)), "m", uv=[(0, 0), (0, 1), (1, 1), (1, 0)])
    return writer.close()


def test_faces_are_turned_to_their_front(square):
    model = read_alembic_model(square)
    found = corners(model)
    np.testing.assert_array_equal(found.reshape(-1, 3).min(axis=0), (1, 2, 3))
    a, b, c = np.moveaxis(found, 1, 0)
    np.testing.assert_allclose(np.cross(b - a, c - a).sum(axis=0) / 2, (0, 0, 1))
    assert model.clips == ()


def test_texture_coordinates_stay_with_their_corners(square):
    (part,) = read_alembic_model(square).parts()
    np.testing.assert_array_equal(part.uv, part.vertices[:, :2] - (1, 2))


def test_points_and_places_are_linear_between_samples(tmp_path):
    writer = Writer(tmp_path / "a.abc", first=1 / 24)
    high = [(x, y, 8) for x, y, _ in SQUARE]
    writer.mesh(writer.xform(writer.top, "x", (0, 0, 0), (4, 0, 0)), "m", SQUARE, high)
    model = read_alembic_model(writer.close())
    assert model.clips == ("animation 1",)
    np.testing.assert_allclose(model.pose(1.5 / 24, Playing())[0][0], (2, 0, 4), atol=1e-4)
    np.testing.assert_array_equal(model.pose(2 / 24, Playing())[0][0], (4, 0, 8))
    np.testing.assert_array_equal(model.pose(9, Playing())[0][0], (4, 0, 8))
    np.testing.assert_array_equal(model.parts()[0].vertices[0], (0, 0, 0))


def test_faces_may_change_and_are_held(tmp_path):
    writer = Writer(tmp_path / "a.abc")
    three = SQUARE[:3], [0, 2, 1], [3]
    writer.mesh(writer.top, "m", three, (SQUARE, CLOCKWISE, [4]))
    model = read_alembic_model(writer.close())
    assert [len(corners(model, code / 24)) for code in (0, 0.9, 1)] == [1, 1, 2]
    assert model.form(0, Playing()) == model.form(0.9 / 24, Playing()) != model.form(1 / 24, Playing())


def test_what_is_hidden_comes_and_goes(tmp_path):
    writer = Writer(tmp_path / "a.abc")
    place = writer.xform(writer.top, "x", (0, 0, 0), (1, 0, 0), (2, 0, 0))
    seen = GEOM.CreateVisibilityProperty(place, 1)
    for value in (-1, 0, 1):
        seen.setValue(value)
    writer.kept.append(seen)
    writer.mesh(place, "m")
    writer.close()
    del seen, place
    (tmp_path / "scene.yaml").write_text("quilt_scene: 1\nobjects: [{mesh: a.abc, animation: {}}]\n")
    _, source = load_moving_scene(load_scene_file(tmp_path / "scene.yaml"), 24)
    assert np.ptp(source.scene_at(0).vertices, axis=0).any()
    assert not np.ptp(source.scene_at(1).vertices, axis=0).any()
    assert source.scene_at(2).vertices[:, 0].min() == 2


def test_sets_of_faces_name_materials_and_colors_are_white_beneath(tmp_path):
    writer = Writer(tmp_path / "a.abc")
    points = [*SQUARE, (2, 0, 0), (2, 1, 0)]
    found = writer.mesh(writer.top, "m", (points, [0, 3, 2, 1, 1, 2, 5, 4], [4, 4]))
    schema = found.getSchema()
    red = schema.createFaceSet("red")
    red.getSchema().set(GEOM.OFaceSetSchemaSample(array(imath.IntArray, [1])))
    scope = GEOM.GeometryScope.kVertexScope
    color = GEOM.OC3fGeomParam(schema.getArbGeomParams(), "Cd", False, scope, 1)
    color.set(
        GEOM.OC3fGeomParamSample(array(imath.C3fArray, [(0.5, k, 0) for k in range(6)], imath.Color3f), scope)
    )
    writer.kept += [red, color]
    writer.close()
    del found, schema, red, color
    parts = {part.material: part for part in read_alembic_model(tmp_path / "a.abc").parts()}
    assert set(parts) == {"", "red"}
    assert parts["red"].vertices[:, 0].min() == 1
    assert parts["red"].surface.color == (1, 1, 1)
    np.testing.assert_array_equal(parts["red"].colors[:, 0], [0.5] * 4)


def test_normals_are_taken(tmp_path):
    writer = Writer(tmp_path / "a.abc")
    writer.mesh(writer.top, "m", normals=[(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 0, 1)])
    (part,) = read_alembic_model(writer.close()).parts()
    np.testing.assert_array_equal(part.normals[1], (0, 1, 0))


def test_indices_of_positions_that_are_not_there_are_an_error(tmp_path):
    writer = Writer(tmp_path / "a.abc")
    writer.mesh(writer.top, "m", (SQUARE, [0, 3, 2, 9], [4]))
    path = writer.close()
    with pytest.raises(MeshError) as error:
        read_alembic_model(path).parts()
    assert str(error.value) == f"{path}: /m: names position 9 of 4 (expected 0 to 3)"


def test_other_files_of_the_name_are_an_error(tmp_path):
    (tmp_path / "a.abc").write_bytes(b"Ogawa no more")
    with pytest.raises(SceneError, match=r"a.abc: is no Alembic file that can be read: .*Ogawa"):
        load_scene(tmp_path / "a.abc")


def test_without_the_extra_it_is_named(square, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "alembic3d", None)
    with pytest.raises(MissingExtraError, match=r"An Alembic file needs alembic3d, .*\[alembic\]"):
        read_alembic_model(square)
