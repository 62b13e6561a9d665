"""Verification sees what rays cannot: triangles that are not their polygon."""

from __future__ import annotations

from dataclasses import replace

from quiltcli.analysis.verify import verdict_rows, verify
from tests.helpers.verified_jobs import write_job

WALL = ([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], [[0, 1, 2, 3]])
U = [(0, 0, -1), (3, 0, -1), (3, 3, -1), (2, 3, -1), (2, 1, -1), (1, 1, -1), (1, 3, -1), (0, 3, -1)]


def job(tmp_path, faces=((0, 1, 2, 3, 4, 5, 6, 7),)):
    return write_job(tmp_path, WALL, (U, faces), (0, 0, 5), density=8)


def test_areas_of_polygons_and_triangles_agree(tmp_path):
    [found] = verify(job(tmp_path))
    verdict = found.verdict
    assert verdict.passed
    assert verdict.as_json()["areas"] == {
        "display": {
            "polygons": 1, "area": 16, "triangle_area": 16, "wrong": 0, "crossing": 0, "worst": 0,
        },
        "scene": {"polygons": 1, "area": 7, "triangle_area": 7, "wrong": 0, "crossing": 0, "worst": 0},
    }  # fmt: skip
    rows = {name: (count, mark) for name, count, _, mark in verdict_rows(verdict)}
    assert rows["scene faces of over 3 corners"] == ("1", "")
    assert rows["  not covered by their triangles"] == ("0", "")


def test_a_fan_across_a_notch_fails(tmp_path, monkeypatch):
    from quiltcli.formats.mesh import polygons
    from quiltcli.scene.importers import polygons as importer

    def fans(points, start):
        return polygons._fans(start, polygons.np.arange(len(start) - 1))

    monkeypatch.setattr(importer, "triangulate", fans)
    [found] = verify(job(tmp_path))
    verdict = found.verdict
    assert verdict.inside.failures == 0
    assert not verdict.passed
    assert ("  not covered by their triangles", "1", "", "FAIL") in verdict_rows(verdict)
    assert replace(verdict, areas=type(verdict.areas)()).passed


def test_outlines_that_cross_give_no_verdict(tmp_path):
    [found] = verify(job(tmp_path, ((0, 1, 2, 3, 4, 5, 6, 7), (7, 1, 2, 5))))
    verdict = found.verdict
    assert verdict.passed
    assert ("  crossing themselves: no verdict", "1", "", "") in verdict_rows(verdict)
