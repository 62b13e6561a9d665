"""The command line from outside: what it prints, leaves behind and exits with."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete
from click.testing import CliRunner, Result

from quiltcli import __version__, cli
from quiltcli.cli import main
from quiltcli.cli.group import COMMANDS
from tests.helpers.tiny_job import IMAGES, SETTINGS, files_in, replaced, write_tiny_job

ROOT = Path(__file__).parents[2]
EXISTS = "exists already and 11 more (use --resume to keep finished frames, --overwrite to replace them)"


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return write_tiny_job(tmp_path).parent


def quilt(*words: str) -> Result:
    return CliRunner().invoke(main, list(words))


def rendered(*words: str) -> None:
    result = quilt("render", "job.yaml", *words)
    assert (result.exit_code, result.exception) == (0, None), result.output


def process(*words: str, **more: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "quiltcli", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, **more)  # type: ignore[call-overload,no-any-return]


def images(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in files_in(folder) if name.endswith(".exr")}


def report(folder: Path) -> list[dict[str, object]]:
    frames = json.loads((folder / "report.json").read_text())["frames"]
    return [{key: value for key, value in frame.items() if "seconds" not in key} for frame in frames]


# --- being there


def test_help_answers_at_once() -> None:
    took = []
    for _ in range(3):
        start = time.perf_counter()
        assert process("--help").returncode == 0
        took.append(time.perf_counter() - start)
    assert min(took) < 0.3


@pytest.mark.parametrize("words", [["--help"], ["render", "--help"], ["--version"], ["info", "-h"]])
def test_help_imports_nothing_heavy(words: list[str]) -> None:
    command = [sys.executable, "-X", "importtime", "-m", "quiltcli", *words]
    log = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stderr
    imported = {line.rpartition("|")[2].strip().split(".")[0] for line in log.splitlines()}
    assert "click" in imported
    heavy = {"numpy", "pydantic", "trimesh", "OpenEXR", "OpenImageIO", "rich", "yaml", "PIL", "embreex"}
    assert imported & heavy == set()


def test_version() -> None:
    assert process("--version").stdout == f"quilt, version {__version__}\n"


def test_the_commands_of_the_manual_are_there() -> None:
    assert {"render", "pack", "check", "info", "unmap", "diff"} <= set(COMMANDS)


def test_every_file_of_a_command_is_listed_and_answers_for_itself() -> None:
    rest = {"__init__", "group", "options", "printing", "progress"}
    files = {path.stem for path in Path(cli.__file__).parent.glob("*.py")} - rest
    assert sorted(name.rstrip("_") for name in files) == sorted(COMMANDS)
    for name in COMMANDS:
        assert quilt(name, "--help").stdout.startswith(f"Usage: main {name} "), name


def test_a_command_loads_no_other_command() -> None:
    script = (
        "import sys; from quiltcli.cli import main; main.main(['diff', '--help'], standalone_mode=False);"
        "print(*(name for name in sys.modules if name.startswith('quiltcli.cli.')))"
    )
    found = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = {name.rpartition(".")[2] for name in found.stdout.splitlines()[-1].split()}
    assert loaded == {"group", "options", "printing", "diff"}


@pytest.mark.parametrize("kind", ["job", "display", "layout", "scene"])
def test_schema_prints_the_schema_of_a_kind(kind: str, tmp_path: Path) -> None:
    text = (ROOT / "docs" / "schema" / f"{kind}.schema.json").read_text(encoding="utf-8")
    assert quilt("schema", kind).stdout == text
    assert quilt("schema", kind, "-o", str(tmp_path / "s.json")).stdout == ""
    assert (tmp_path / "s.json").read_text(encoding="utf-8") == text


@pytest.mark.parametrize(
    ("words", "begun", "found"),
    [
        (["pack", "--method"], "ne", ["nest", "net"]),
        (["compare", "--method"], "ras", ["raskar"]),
        (["export", "--format"], "mpcdi", ["mpcdi", "mpcdi1"]),
        (["import", "--format"], "o", ["obj"]),
        (["pattern", "--kind"], "a", ["all"]),
        (["render", "--set"], "render.sam", ["render.samples=", "render.sample_shading="]),
        ([], "ver", ["verify"]),
        (["schema"], "", ["job", "display", "layout", "scene", "lightfield", "calibration"]),
    ],
)
def test_a_shell_completes_commands_and_the_words_that_options_know(
    words: list[str], begun: str, found: list[str]
) -> None:
    shell = ShellComplete(main, {}, "quilt", "_QUILT_COMPLETE")
    assert [item.value for item in shell.get_completions(words, begun)] == found


def test_no_command_shows_the_help() -> None:
    result = quilt()
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith("Usage: ")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["rendr", "job.yaml"], "No such command 'rendr'. Did you mean 'render'?"),
        (["render"], "Missing argument 'JOB'."),
        (["render", "a.yaml", "b.yaml"], "Got unexpected extra argument (b.yaml)"),
        (["render", "a.yaml", "--ovewrite"], "No such option '--ovewrite'. Did you mean '--overwrite'?"),
        (
            ["render", "a.yaml", "-j", "0"],
            "Invalid value for '-j' / '--threads': 0 is not in the range x>=1.",
        ),
        (
            ["render", "a.yaml", "-j", "two"],
            "Invalid value for '-j' / '--threads': 'two' is not a valid integer range.",
        ),
        (
            ["render", "a.yaml", "-f", "1:4"],
            "Invalid value for '-f' / '--frames' / '--frame': ':' means different things to different farms,"
            " in '1:4' (write the step with x: 1-9x2)",
        ),
        (
            ["render", "a.yaml", "--facets", "0"],
            "Invalid value for '--facets': there is no facet 0 (facet ids start at 1)",
        ),
        (
            ["render", "a.yaml", "--resume", "--overwrite"],
            "--resume keeps finished frames and --overwrite replaces them: give one",
        ),
        (["pack", "a.yaml"], "Missing option '-o' / '--output'."),
        (
            ["pack", "a.yaml", "-o", "b.yaml", "--size", "8192"],
            "Invalid value for '--size': expected WIDTHxHEIGHT in pixels, such as 8192x8192, or auto,"
            " got '8192'",
        ),
        (
            ["pack", "a.yaml", "-o", "b.yaml", "--padding", "-1"],
            "Invalid value for '--padding': -1 is not in the range x>=0.",
        ),
        (["check"], "Missing argument 'FILES...'."),
        (["unmap", "a.exr", "-o", "b"], "Missing option '--layout'."),
    ],
)
def test_usage_errors(words: list[str], message: str) -> None:
    result = quilt(*words)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.splitlines()[-1] == f"Error: {message}"


# --- errors


def test_an_error_is_one_line_and_debug_shows_where_it_comes_from(tiny: Path) -> None:
    plain, debug = process("render", "nothere.yaml"), process("--debug", "render", "nothere.yaml")
    assert (plain.returncode, plain.stdout, plain.stderr) == (2, "", "error: nothere.yaml: no such file\n")
    assert debug.stderr.startswith("Traceback (most recent call last):\n")
    assert debug.returncode == 1


def test_several_errors_are_a_line_each(tiny: Path) -> None:
    replaced(tiny, "job.yaml", "near: 0.05\n  far: 50", "near: x\n  far: y")
    result = quilt("render", "job.yaml")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.splitlines() == [
        "job.yaml:6:9: viewer.near: expected a number, got the text 'x'",
        "job.yaml:7:8: viewer.far: expected a number, got the text 'y'",
    ]


def test_a_fault_of_the_program_is_no_traceback_either(tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*given: object) -> None:
        raise ZeroDivisionError("division\nby zero")

    monkeypatch.setattr("quiltcli.analysis.check.check_files", fail)
    result = quilt("check", "job.yaml")
    assert (result.exit_code, result.stdout) == (1, "")
    assert result.stderr == (
        "error: quilt has met a fault of its own: ZeroDivisionError: division by zero"
        " (quilt --debug COMMAND … shows where)\n"
    )
    with pytest.raises(ZeroDivisionError):
        CliRunner().invoke(main, ["--debug", "check", "job.yaml"], catch_exceptions=False)


def test_running_out_of_memory_is_said(tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*given: object) -> None:
        raise MemoryError

    monkeypatch.setattr("quiltcli.render.sequence.render_frames", fail)
    result = quilt("render", "job.yaml")
    assert result.exit_code == 1
    assert result.stderr == "error: not enough memory (smaller pages or fewer threads need less)\n"


# --- render


def test_a_render_leaves_exactly_its_files(tiny: Path) -> None:
    rendered()
    assert files_in(Path("out")) == sorted(IMAGES + SETTINGS)


def test_results_go_to_stdout_and_one_plain_line_a_frame_to_stderr(tiny: Path) -> None:
    result = process("render", "job.yaml")
    lines = result.stderr.splitlines()
    assert result.returncode == 0
    assert [line.split(": ")[0] for line in lines] == [f"frame {n} ({n} of 4)" for n in range(1, 5)]
    assert "\x1b" not in result.stdout + result.stderr
    assert "\r" not in result.stderr
    assert result.stdout.startswith("frames                  4 (1 to 4)\n")
    assert result.stdout.endswith("\nwritten to out\n")


def test_output_and_frames_may_be_given(tiny: Path) -> None:
    rendered("-o", "there", "-f", "2-4x2")
    assert not Path("out").exists()
    assert [name for name in files_in(Path("there")) if "quilt" in name] == [
        "quilt/page_01.0002.exr",
        "quilt/page_01.0004.exr",
    ]


def test_set_changes_a_value(tiny: Path) -> None:
    rendered("--set", "output.facets=false", "--set", "output.channels=[Z]", "-f", "1")
    assert files_in(Path("out")) == ["job.yaml", "layout.yaml", "quilt/page_01.0001.exr", "report.json"]
    assert "channels: [Z]" in Path("out/job.yaml").read_text()


def test_a_dry_run_leaves_nothing(tiny: Path) -> None:
    before = files_in(tiny)
    result = quilt("render", "job.yaml", "--dry-run")
    assert (result.exit_code, result.stdout) == (0, "nothing is wrong with this job\n")
    assert files_in(tiny) == before
    assert not Path("out").exists()


def test_a_dry_run_finds_what_a_render_would(tiny: Path) -> None:
    rendered()
    result = quilt("render", "job.yaml", "--dry-run")
    assert result.exit_code == 2
    assert result.stderr == f"error: out/quilt/page_01.0001.exr: {EXISTS}\n"


def test_existing_files_are_refused(tiny: Path) -> None:
    rendered()
    before = images(Path("out"))
    result = quilt("render", "job.yaml", "--set", "render.samples=2")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr == f"error: out/quilt/page_01.0001.exr: {EXISTS}\n"
    assert images(Path("out")) == before


def test_overwrite_replaces_them(tiny: Path) -> None:
    rendered()
    Path("out/quilt/page_01.0003.exr").write_bytes(b"old")
    rendered("--overwrite", "-f", "3")
    assert len(Path("out/quilt/page_01.0003.exr").read_bytes()) > 100


def test_resume_skips_what_is_complete_and_draws_again_what_is_not(tiny: Path) -> None:
    rendered()
    whole = images(Path("out"))
    page, facet = Path("out/quilt/page_01.0002.exr"), Path("out/facets/facet_0002.0004.exr")
    page.write_bytes(whole["quilt/page_01.0002.exr"][:-7])
    facet.unlink()
    kept = Path("out/quilt/page_01.0001.exr").stat().st_mtime_ns
    result = quilt("render", "job.yaml", "--resume")
    assert [line.split(":")[0] for line in result.stderr.splitlines()] == [
        "frame 2 (1 of 2)",
        "frame 4 (2 of 2)",
    ]
    assert images(Path("out")) == whole
    assert Path("out/quilt/page_01.0001.exr").stat().st_mtime_ns == kept
    assert quilt("render", "job.yaml", "--resume").stdout == "every frame is complete already\n"


def test_resume_draws_again_what_another_job_made(tiny: Path) -> None:
    rendered("--set", "viewer.far=40")
    rendered("--resume", "-f", "1-2")
    whole = images(Path("out"))
    rendered("--overwrite", "-f", "1-2")
    assert images(Path("out")) == whole


# --- the same bytes however they are made


def test_threads_make_no_difference(tiny: Path) -> None:
    rendered("-o", "one", "-j", "1")
    rendered("-o", "two", "-j", "2")
    assert images(Path("one")) == images(Path("two"))
    assert report(Path("one")) == report(Path("two"))
    assert Path("one/job.yaml").read_bytes() == Path("two/job.yaml").read_bytes()


def test_pieces_make_no_difference(tiny: Path) -> None:
    rendered("-o", "whole", "-f", "1-4")
    for frame in (3, 1, 4, 2):
        rendered("-o", "pieces", "-f", str(frame))
    assert images(Path("pieces")) == images(Path("whole"))
    assert report(Path("pieces")) == report(Path("whole"))
    for name in ("job.yaml", "layout.yaml"):
        assert Path("pieces", name).read_bytes() == Path("whole", name).read_bytes()


def test_two_runs_make_no_difference(tiny: Path) -> None:
    assert process("render", "job.yaml", "-o", "a", env=os.environ | {"PYTHONHASHSEED": "1"}).returncode == 0
    assert process("render", "job.yaml", "-o", "b", env=os.environ | {"PYTHONHASHSEED": "2"}).returncode == 0
    assert images(Path("a")) == images(Path("b"))


def test_facets_drawn_alone_and_merged_make_no_difference(tiny: Path) -> None:
    rendered("-f", "1")
    whole = images(Path("out"))
    Path("out/facets/facet_0002.0001.exr").unlink()
    rendered("-f", "1", "--facets", "2")
    assert images(Path("out")) == whole


def test_facets_are_only_merged_into_their_own_job(tiny: Path) -> None:
    rendered("-f", "1")
    before = images(Path("out"))
    result = quilt("render", "job.yaml", "-f", "1", "--facets", "2", "--set", "viewer.far=40")
    assert result.exit_code == 2
    assert result.stderr == (
        "error: out/quilt/page_01.0001.exr: was made by another job;"
        " facets can only be merged into the same job's\n"
    )
    assert images(Path("out")) == before


# --- what may go wrong outside


SLOW = """
import sys, time
import quiltcli.render.sequence as render
draw = render.draw_moment
def slow(moment, *rest, **how):
    print("drawing", moment.view.frame, flush=True)
    time.sleep(0.3)
    return draw(moment, *rest, **how)
render.draw_moment = slow
from quiltcli.cli import main
main.main(["render", "job.yaml"], prog_name="quilt")
"""


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_stops_after_a_whole_frame(tiny: Path, number: signal.Signals, code: int) -> None:
    command = [sys.executable, "-c", SLOW]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert running.stdout is not None
    assert running.stdout.readline() == "drawing 1\n"
    running.send_signal(number)
    _, said = running.communicate(timeout=60)
    assert running.returncode == code
    assert said.splitlines()[1:] == [f"stopped by {number.name} after a whole frame"]
    assert files_in(Path("out")) == sorted([name for name in IMAGES if ".0001." in name] + SETTINGS)
    rendered("--resume")
    resumed = images(Path("out"))
    rendered("-o", "whole")
    assert resumed == images(Path("whole"))


def test_an_interrupt_before_the_first_frame_leaves_nothing(
    tiny: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*given: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("quiltcli.render.sequence.set_stage", interrupted)
    result = quilt("render", "job.yaml")
    assert (result.exit_code, result.output) == (130, "")
    assert not Path("out").exists()


def test_a_file_stands_where_the_folder_should_be(tiny: Path) -> None:
    Path("out").write_text("mine")
    result = quilt("render", "job.yaml")
    assert result.exit_code == 2
    assert result.stderr == "error: out: is a file, expected a folder\n"
    assert Path("out").read_text() == "mine"


def test_a_folder_stands_where_an_image_should_be(tiny: Path) -> None:
    Path("out/quilt/page_01.0001.exr").mkdir(parents=True)
    result = quilt("render", "job.yaml", "--overwrite", "-f", "1", "--set", "output.facets=false")
    assert result.exit_code == 1
    assert result.stderr == "error: out/quilt/page_01.0001.exr: is a folder, expected a file to write\n"
    assert files_in(Path("out")) == ["job.yaml", "layout.yaml"]


FULL_DISK = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))
from quiltcli.cli import main
main.main(["render", "job.yaml", "--set", "output.compression=none"], prog_name="quilt")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such limits")
def test_a_full_disk_is_said_and_leaves_no_half_file(tiny: Path) -> None:
    command = [sys.executable, "-c", FULL_DISK]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert result.returncode == 1
    assert result.stderr == "error: out/quilt/page_01.0001.exr: cannot be written: File too large\n"
    assert files_in(Path("out")) == ["job.yaml", "layout.yaml"]


def test_a_folder_that_is_read_only(tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: Path, *given: object, **more: object) -> None:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "mkdir", refuse)
    result = quilt("render", "job.yaml")
    assert (result.exit_code, result.stderr) == (
        2,
        "error: out/quilt: cannot be written: Permission denied\n",
    )
    assert not Path("out").exists()


def test_a_reader_that_goes_away_is_no_fault(tiny: Path) -> None:
    command = [sys.executable, "-m", "quiltcli", "info", "--json", "job.yaml"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        assert running.stderr is not None
        running.stdout.close()
        said = running.stderr.read()
    assert said == ""
