from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import quiltcli.images.contact as module
from quiltcli.cli import main
from quiltcli.errors import OutputError
from quiltcli.formats.drawing.font import text_mask
from quiltcli.formats.exr.image import write_exr
from quiltcli.images.contact import Sheet, chosen_images, contact_sheet
from quiltcli.images.names import facet_path, quilt_path
from quiltcli.images.preview import Look

PLAIN = Look("raw")


def put(path, value, height=20, width=40):
    path.parent.mkdir(parents=True, exist_ok=True)
    write_exr(path, dict.fromkeys("RGB", np.full((height, width), value, np.float16)), {})


@pytest.fixture
def out(tmp_path):
    for frame in (10, 9):
        put(quilt_path(tmp_path, 1, frame), frame / 16)
        for facet in (1, 2, 12):
            put(facet_path(tmp_path, facet, frame), facet / 16, height=10 * facet)
    return tmp_path


def names(out, **how):
    return [label for label, _ in chosen_images(out, Sheet(**how))]


def test_pages_of_all_frames_come_first(out):
    assert names(out) == ["page 1, frame 9", "page 1, frame 10"]
    assert names(out, frames=(10,)) == ["page 1, frame 10"]


def test_facets_come_from_the_first_frame_if_none_is_named(out):
    assert names(out, kind="facet") == ["facet 1, frame 9", "facet 2, frame 9", "facet 12, frame 9"]
    assert len(names(out, kind="facet", frames=(9, 10))) == 6


def test_facets_are_shown_where_there_are_no_pages(out):
    for page in out.glob("quilt/*"):
        page.unlink()
    assert names(out)[0] == "facet 1, frame 9"


def test_what_is_not_there(out, monkeypatch):
    with pytest.raises(OutputError, match=r"has no pages of frame 3 \(it has 9,10\)|\(it has 9-10\)"):
        names(out, frames=(3, 9))
    with pytest.raises(OutputError, match=r"quilt: has no images of facets \(expected the folder"):
        names(out / "quilt")
    monkeypatch.setattr(module, "MOST", 2)
    with pytest.raises(OutputError, match=r"has 3 such images, more than 2 \(choose frames\)"):
        names(out, kind="facet")


def test_a_sheet_holds_every_image_and_its_name(out):
    count, size = contact_sheet(out, out / "sheet.png", Sheet(kind="facet", columns=2, width=120, look=PLAIN))
    pixels = np.asarray(Image.open(out / "sheet.png"))
    assert (count, size) == (3, pixels.shape[1::-1])
    # Images keep their pixels where they are small enough.
    for value, area in ((1 / 16, 10 * 40), (2 / 16, 20 * 40), (12 / 16, 120 * 40)):
        assert np.count_nonzero((pixels == round(255 * value)).all(axis=-1)) == area
    ink = sum(np.count_nonzero(text_mask(name)) for name in names(out, kind="facet"))
    assert np.count_nonzero((pixels == module._INK).all(axis=-1)) == ink


def test_columns_follow_the_shape_of_what_is_shown(tmp_path):
    for frame in range(1, 25):
        put(quilt_path(tmp_path, 1, frame), 0.5, height=90, width=120)
    _, (width, height) = contact_sheet(tmp_path, tmp_path / "a.png")
    assert 1 < width / height < 2.2


def test_the_command_writes_a_sheet(out):
    arguments = ["contact", str(out), "--facets", "-o", str(out / "new" / "sheet.tif"), "--columns", "1"]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    assert result.output == f"{out / 'new' / 'sheet.tif'}  117×461, 3 images\n"
