"""Files that change while a job is loaded: the hash is that of what was read, or there is an error."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from quiltcli.errors import JobError
from quiltcli.formats.noted import note_input, noted_digest, noting_inputs
from quiltcli.job import job_sha256, load_job
from quiltcli.render import sequence
from quiltcli.render.sequence import RenderOptions, prepare
from tests.helpers.tiny_job import replaced, write_tiny_job


def test_what_was_read_counts(tmp_path: Path) -> None:
    with noting_inputs() as notes:
        note_input(tmp_path / "a", b"one")
        note_input(tmp_path / "." / "a", b"one")
        assert noted_digest(tmp_path / "a") == hashlib.sha256(b"one").hexdigest()
        assert noted_digest(tmp_path / "b") is None
        with pytest.raises(JobError) as caught:
            note_input(tmp_path / "a", b"two")
    assert str(caught.value) == f"{tmp_path / 'a'}: has changed while it was being read (run again)"
    assert list(notes) == [str(tmp_path / "a")]
    assert noted_digest(tmp_path / "a") is None


def test_blocks_know_nothing_of_one_another(tmp_path: Path) -> None:
    with noting_inputs():
        note_input(tmp_path / "a", b"one")
        with noting_inputs() as inner:
            note_input(tmp_path / "a", b"two")
        assert len(inner) == 1
        note_input(tmp_path / "a", b"one")
    note_input(tmp_path / "a", b"three")


WALL = "OFF\n4 1 0\n-1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\n4 0 1 2 3\n"


def test_an_input_that_changes_after_it_was_read_does_not_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_tiny_job(tmp_path, "144, 72")
    replaced(tmp_path, "display.yaml", "walls.obj", "wall.off")
    (tmp_path / "wall.off").write_text(WALL)
    job = load_job(path)
    before, load = job_sha256(job), sequence.set_stage

    def changing(*given):  # type: ignore[no-untyped-def]
        stage = load(*given)
        (tmp_path / "wall.off").write_text(WALL.replace("1 1 0", "1 2 0"))
        return stage

    with monkeypatch.context() as patched:
        patched.setattr(sequence, "set_stage", changing)
        assert prepare(job, RenderOptions()).out.job_sha == before
    assert prepare(job, RenderOptions()).out.job_sha != before


@pytest.mark.parametrize("name", ["scene.yaml", "display.yaml", "ball.obj"])
def test_an_input_that_is_read_twice_and_changes_between_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    job = load_job(write_tiny_job(tmp_path, "144, 72"))
    load = sequence.set_stage

    def changing(*given):  # type: ignore[no-untyped-def]
        stage = load(*given)
        (tmp_path / name).write_text((tmp_path / name).read_text() + "# later\n")
        return stage

    monkeypatch.setattr(sequence, "set_stage", changing)
    with pytest.raises(JobError, match=rf"{name}: has changed while it was being read"):
        prepare(job, RenderOptions())


def test_a_recorded_path_that_was_read_before_is_noted_again(tmp_path: Path) -> None:
    path = write_tiny_job(tmp_path, "144, 72")
    (tmp_path / "walk.csv").write_text("frame,x,y,z\n1,0,0,2\n2,0,0,3\n")
    keyframes = path.read_text().split("    keyframes:")[0]
    path.write_text(keyframes.replace("1-4", "1-2") + "    csv: {file: walk.csv, look_at: [0, 0, 0]}\n")
    job = load_job(path)
    for _ in range(2):
        assert str(tmp_path / "walk.csv") in prepare(job, RenderOptions()).inputs
