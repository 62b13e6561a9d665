"""Ctrl-C and SIGTERM, whenever they come: the right code, whole files, no traceback."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from quiltcli.ending import Ended, ended
from tests.helpers.tiny_job import IMAGES, SETTINGS, files_in, write_tiny_job

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there are no process groups")
CODES = [(signal.SIGINT, 130), (signal.SIGTERM, 143)]

# A program that says when it imports something, and takes its time over it.
IMPORTING = """
import sys, time
module = sys.argv[-1]
class Slow:
    def find_spec(self, name, *rest):
        if name == module:
            print("importing", flush=True)
            time.sleep(60)
sys.meta_path.insert(0, Slow())
import quiltcli.__main__
sys.argv[1:] = ["render", "job.yaml"]
quiltcli.__main__.run()
"""

# A render with worker processes that says when it draws a frame, and takes its time over it, in short pieces:
# Python answers a signal that comes just before a long sleep only after it, and two of them as one.
DRAWING = """
import time
from quiltcli.render import sequence
draw = sequence.draw_moment
def slow(moment, *rest, **how):
    print("drawing", moment.view.frame, flush=True)
    end = time.monotonic() + 0.5
    while time.monotonic() < end:
        time.sleep(0.01)
    return draw(moment, *rest, **how)
sequence.draw_moment = slow
sequence.worth_forking = lambda stage: True
import sys
sys.argv[1:] = ["render", "job.yaml", "-j", "2"]
import quiltcli.__main__
quiltcli.__main__.run()
"""


@pytest.fixture(autouse=True)
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_tiny_job(tmp_path, "144, 72")


def started(program: str, *arguments: str) -> subprocess.Popen[str]:
    """A program in a process group of its own that has said its first line."""
    command = [sys.executable, "-c", program, *arguments]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    running = subprocess.Popen(command, **pipes, text=True, start_new_session=True)  # type: ignore[call-overload]
    assert running.stdout is not None
    running.stdout.readline()
    assert isinstance(running, subprocess.Popen)
    return running


@pytest.mark.parametrize(("number", "code"), CODES)
@pytest.mark.parametrize("module", ["click", "quiltcli.cli.render", "numpy", "OpenEXR"])
def test_an_interrupt_in_the_first_moments_is_quiet(number: signal.Signals, code: int, module: str) -> None:
    running = started(IMPORTING, module)
    running.send_signal(number)
    assert running.communicate(timeout=60) == ("", "")
    assert running.returncode == code


@pytest.mark.parametrize(("number", "code", "times"), [(*CODES[0], 1), (*CODES[1], 1), (*CODES[1], 2)])
def test_a_signal_to_the_whole_group_ends_after_the_frame(
    number: signal.Signals, code: int, times: int
) -> None:
    running = started(DRAWING)
    for _ in range(times):  # as `timeout` does: once to the process, once to its group
        os.killpg(running.pid, number)
        signal.sigtimedwait([], 0.1)
    _, said = running.communicate(timeout=60)
    assert said.splitlines()[-1] == f"stopped by {number.name} after a whole frame"
    assert running.returncode == code
    assert files_in(Path("out")) == sorted([name for name in IMAGES if ".0001." in name] + SETTINGS)
    with pytest.raises(ProcessLookupError):
        os.killpg(running.pid, 0)  # nobody of the group is left


def test_a_second_interrupt_does_not_wait_for_the_frame() -> None:
    running = started(DRAWING.replace("0.5", "60"))
    for _ in range(2):
        os.killpg(running.pid, signal.SIGINT)
        signal.sigtimedwait([], 0.2)
    _, said = running.communicate(timeout=30)
    assert "Traceback" not in said
    assert running.returncode == 130


def test_what_a_library_makes_of_an_interrupt_is_one_still() -> None:
    made = SystemError("initialization failed")
    made.__cause__ = Ended(signal.SIGTERM)
    assert ended(made) == 143
    assert ended(KeyboardInterrupt()) == 130
    assert ended(ValueError()) == 0
