from __future__ import annotations

import builtins
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.errors import MissingExtraError, OutputError
from quiltcli.formats.video import CODINGS, coding_of, film
from tests.helpers.tiny_job import write_tiny_job

av = pytest.importorskip("av")


def card(height=61, width=97, depth=8):
    """Orange on the left, blue on the right."""
    light = np.empty((height, width, 3))
    light[:, : width // 2], light[:, width // 2 :] = (0.8, 0.3, 0.1), (0.1, 0.6, 0.9)
    return np.rint(light * (2**depth - 1)).astype(np.uint8 if depth == 8 else np.uint16)


def written(path, pictures, fps=Fraction(30000, 1001)):
    with film(path, fps) as show:
        for picture in pictures:
            show(picture)


@pytest.mark.parametrize(("name", "codec"), [("a.mp4", "h264"), ("a.mov", "prores")])
def test_a_film_holds_the_pictures_and_says_what_its_colours_are(tmp_path, name, codec):
    path = tmp_path / "new" / name
    written(path, [card(depth=coding_of(path).depth)] * 5)
    assert [name] == [file.name for file in path.parent.iterdir()]
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.average_rate) == (codec, Fraction(30000, 1001))
        assert (stream.width, stream.height) == (98, 62)
        how = stream.codec_context
        assert (how.color_range, how.colorspace, how.color_primaries, how.color_trc) == (1, 1, 1, 1)
        frames = [frame.to_ndarray(format="rgb24").astype(int) for frame in container.decode(video=0)]
    assert len(frames) == 5
    np.testing.assert_allclose(frames[-1][30, 20], [204, 77, 26], atol=3)
    np.testing.assert_allclose(frames[-1][30, 80], [26, 153, 230], atol=3)


def test_a_film_is_whole_or_not_there(tmp_path):
    def pictures():
        yield card()
        raise ValueError("mine")

    with pytest.raises(ValueError, match="mine"):
        written(tmp_path / "a.mp4", pictures())
    assert list(tmp_path.iterdir()) == []


def test_other_endings_are_refused(tmp_path):
    with pytest.raises(OutputError, match=r"a\.avi: a film's name must end in \.mp4 \(H\.264\) or \.mov"):
        coding_of(tmp_path / "a.avi")


def test_without_pyav_it_says_what_to_install(monkeypatch):
    real = builtins.__import__

    def missing(name, *given, **more):
        if name == "av":
            raise ImportError(name)
        return real(name, *given, **more)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(MissingExtraError, match=r"a film needs PyAV, .*: pip install -e '\.\[video\]'\)"):
        coding_of(Path("a.mp4"))


def test_every_coding_is_known_to_the_library():
    for coding in CODINGS.values():
        assert av.Codec(coding.codec, "w").name == coding.codec


def simulated(job, *more):
    given = ["simulate", str(job), "-f", "1-3", "--size", "45x30", "--supersample", "1", "-j", "1", *more]
    return CliRunner().invoke(main, given)


def test_simulate_makes_a_film(tmp_path):
    job = write_tiny_job(tmp_path)
    result = simulated(job, "--video", str(tmp_path / "a.mp4"))
    assert result.exit_code == 0, result.output
    assert result.output == (
        "".join(f"{'frame':<24}{frame}, drawn for this picture\n" for frame in (1, 2, 3))
        + f"{'film':<24}{tmp_path / 'a.mp4'} (3 frames, 30 a second)\n"
    )
    with av.open(str(tmp_path / "a.mp4")) as container:
        assert len(list(container.decode(video=0))) == 3


def test_simulate_makes_pictures_and_figures_beside_the_film(tmp_path):
    job = write_tiny_job(tmp_path)
    result = simulated(job, "--video", str(tmp_path / "a.mp4"), "-o", str(tmp_path / "a.##.png"))
    assert result.exit_code == 0, result.output
    assert result.output.count("error, mean") == 3
    assert sorted(path.name for path in tmp_path.glob("a.*")) == [
        "a.0001.png",
        "a.0002.png",
        "a.0003.png",
        "a.mp4",
    ]


def test_simulate_needs_something_to_write(tmp_path):
    result = simulated(write_tiny_job(tmp_path))
    assert result.exit_code == 2
    assert "nothing to write: give -o PICTURE.png, --video FILM.mp4, or both" in result.output
