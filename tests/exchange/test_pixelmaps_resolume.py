"""Advanced Outputs of Resolume: what a preset says, and what is read of one that was made by hand."""

from __future__ import annotations

import math
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.errors import LayoutError, OutputError
from quiltcli.exchange.pixelmaps import read_map, write_map
from quiltcli.layout import read_layout
from tests.helpers.flat_displays import flat_display, placed, rectangle
from tests.helpers.tiny_job import write_tiny_job

PRESET = """<?xml version="1.0" encoding="utf-8"?>
<XmlState name="Venue">
 <versionInfo name="Resolume Arena" majorVersion="7" minorVersion="22" microVersion="1" revision="1"/>
 <ScreenSetup name="ScreenSetup"><Params name="ScreenSetupParams"/>
  <CurrentCompositionTextureSize width="100" height="60"/>
  <screens>
   <Screen name="A" uniqueId="1"><layers>
    <Slice uniqueId="2">
     <Params name="Common"><Param name="Name" T="STRING" default="Layer" value="wide"/></Params>
     <Params name="Input"><ParamChoice name="Input Source" default="0:1" value="0:1"/></Params>
     <InputRect orientation="0"><v x="10" y="5"/><v x="18" y="5"/><v x="18" y="11"/><v x="10" y="11"/></InputRect>
     <OutputRect orientation="0"><v x="0" y="0"/><v x="9" y="0"/><v x="9" y="7"/><v x="0" y="7"/></OutputRect>
    </Slice>
    <Slice uniqueId="4">
     <Params name="Common"><Param name="Name" value="preview"/></Params>
     <InputRect orientation="0"><v x="0" y="0"/><v x="9" y="0"/><v x="9" y="7"/><v x="0" y="7"/></InputRect>
    </Slice>
   </layers></Screen>
   <Screen name="B" uniqueId="5"><layers>
    <Slice uniqueId="3">
     <Params name="Common"><Param name="Name" T="STRING" default="Layer" value="facet_0002"/></Params>
     <InputRect orientation="1.5708"><v x="40" y="20.02"/><v x="40" y="28"/><v x="35" y="28"/><v x="35" y="20"/></InputRect>
    </Slice>
    <Slice uniqueId="6">
     <Params name="Common"><Param name="Name" value="wide"/></Params>
     <Params name="Input"><ParamChoice name="Input Source" default="0:1" value="1:3"/></Params>
     <InputRect orientation="0"><v x="0" y="0"/><v x="9" y="0"/><v x="9" y="7"/><v x="0" y="7"/></InputRect>
    </Slice>
   </layers></Screen>
  </screens>
 </ScreenSetup>
</XmlState>
"""  # noqa: E501


def facets():
    return flat_display([rectangle(8, 6), rectangle(8, 5)], names=["wide", ""])


def test_a_venues_preset_says_where_facets_lie_on_the_composition(tmp_path):
    (tmp_path / "venue.xml").write_text(PRESET)
    layout = read_map(tmp_path / "venue.xml", facets())
    assert layout.pages.tolist() == [[100, 60]]
    assert layout.facet.tolist() == [1, 2]
    # The second is turned clockwise: its top left is at the right, and down the composition goes across it.
    assert layout.quilt_from_facet.tolist() == [[[1, 0, 10], [0, 1, 5]], [[0, -1, 40], [1, 0, 20]]]


def test_a_preset_has_a_slice_for_each_facet(tmp_path):
    turned = [[[1, 0, 10], [0, 1, 5]], [[0, -1, 40], [1, 0, 20]]]
    layout = placed(facets(), turned, (100, 60))
    (path,) = write_map(layout, facets(), tmp_path / "wall.xml")
    root = ElementTree.parse(path).getroot()
    setup = root.find("ScreenSetup")
    assert setup.find("CurrentCompositionTextureSize").attrib == {"width": "100", "height": "60"}
    assert setup.find("screens/Screen/OutputDevice/OutputDeviceVirtual").get("width") == "100"
    first, second = setup.iter("Slice")
    names = [one.find("Params[@name='Common']/Param[@name='Name']").get("value") for one in (first, second)]
    assert names == ["facet_0001_wide", "facet_0002"]
    for tag in ("InputRect", "OutputRect", "Warper/Homography/src", "Warper/Homography/dst"):
        corners = [(float(v.get("x")), float(v.get("y"))) for v in second.find(tag)]
        assert corners == [(40, 20), (40, 28), (35, 28), (35, 20)]
    assert float(second.find("InputRect").get("orientation")) == pytest.approx(math.pi / 2)
    bezier = [(float(v.get("x")), float(v.get("y"))) for v in first.find("Warper/BezierWarper/vertices")]
    across, down = np.array([10, 38 / 3, 46 / 3, 18]), np.array([5, 7, 9, 11])
    np.testing.assert_allclose(bezier, [(x, y) for y in down for x in across])
    assert re.fullmatch(r'<\?xml version="1.0" encoding="utf-8"\?>', path.read_text().splitlines()[0])


def test_slices_turned_by_any_angle_come_back(tmp_path):
    layout = placed(facets(), [[[0.8, -0.6, 30], [0.6, 0.8, 3]], [[1, 0, 50], [0, 1, 2]]], (100, 60))
    write_map(layout, None, tmp_path / "wall.xml")
    back = read_map(tmp_path / "wall.xml", facets())
    np.testing.assert_allclose(back.quilt_from_facet, layout.quilt_from_facet, atol=1e-9)
    sheared = placed(facets(), [[[1, 0.5, 2], [0, 1, 1]], [[1, 0, 50], [0, 1, 2]]], (100, 60))
    with pytest.raises(OutputError, match="facet 1 is sheared or stretched in the quilt, and no slice"):
        write_map(sheared, None, tmp_path / "sheared.xml")
    assert not (tmp_path / "sheared.xml").exists()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"facet_0002"', '"facet_0003"', "no slice for facet 2 .*slices of the composition: 'facet_0003'"),
        ('x="18" y="11"', 'x="18" y="12"', "the slice 'wide' is no rectangle on the composition"),
        ('value="preview"', 'value="wide"', r"has 2 slices for facet 1 \(wide\) at several places"),
        ('x="18"', 'x="19"', "the slice 'wide' is 9×6 pixels from its top left corner on, its facet's image"),
        ('<v x="10" y="11"/>', "", 'the slice "wide" has no InputRect of four vertices'),
        ('<v x="10" y="5"/>', '<v x="nan" y="5"/>', 'the slice "wide" has no InputRect of four vertices'),
        ('width="100"', 'width="0"', "does not say how large its composition is"),
        ("ScreenSetup", "ScreenPlay", "holds <XmlState>, expected a preset of Resolume's Advanced Output"),
        ("</XmlState>", "", "is not XML: no element found"),
        ('value="wide"', 'value="wide', "is not XML"),
    ],
)
def test_what_is_wrong_with_a_preset_is_told(tmp_path, old, new, said):
    assert old in PRESET
    (tmp_path / "venue.xml").write_text(PRESET.replace(old, new))
    with pytest.raises(LayoutError, match=said):
        read_map(tmp_path / "venue.xml", facets())


def test_older_presets_say_their_size_elsewhere(tmp_path):
    new = '<CurrentCompositionTextureSize width="100" height="60"/>'
    old = '<sizing><inputs><InputSize name="0:1" width="90" height="50"/></inputs></sizing>'
    (tmp_path / "venue.xml").write_text(PRESET.replace(new, old))
    assert read_map(tmp_path / "venue.xml", facets()).pages.tolist() == [[90, 50]]
    (tmp_path / "venue.xml").write_text(PRESET.replace(new, ""))
    assert read_map(tmp_path / "venue.xml", facets(), size=(80, 40)).pages.tolist() == [[80, 40]]


def test_from_the_command_line(tmp_path):
    job = write_tiny_job(tmp_path, "144, 72")

    def quilt(*words):
        done = CliRunner().invoke(main, [str(word) for word in words])
        return done.exit_code, done.output

    assert quilt("pack", tmp_path / "display.yaml", "-o", tmp_path / "layout.yaml")[0] == 0, job
    assert quilt("export", tmp_path / "layout.yaml", "-o", tmp_path / "wall.xml")[0] == 0
    code, said = quilt("import", tmp_path / "wall.xml", "-o", tmp_path / "back.yaml")
    assert code == 2
    assert "name the display" in said
    code, said = quilt(
        "import", tmp_path / "wall.xml", "-o", tmp_path / "back.yaml", "--display", tmp_path / "display.yaml"
    )
    assert code == 0, said
    one, other = read_layout(tmp_path / "layout.yaml"), read_layout(tmp_path / "back.yaml")
    assert one.quilt_from_facet.tolist() == other.quilt_from_facet.tolist()
