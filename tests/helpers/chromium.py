"""A headless Chromium, where there is one: what a page looks like and says when it is opened from disk."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
    "--force-device-scale-factor=1",
    "--force-color-profile=srgb",
    "--disable-background-networking",
    "--disable-component-update",
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--no-first-run",
    "--enable-logging=stderr",
    "--virtual-time-budget=20000",
)


@dataclass(frozen=True)
class Seen:
    """A page after it was drawn: its title, its picture, what went to the console, and its text."""

    title: str
    pixels: np.ndarray
    console: list[str]
    text: str = ""


def chromium() -> str:
    """The browser's program; the test is skipped where there is none."""
    asked = os.environ.get("QUILT_CHROMIUM")
    found = asked or next(filter(None, map(shutil.which, NAMES)), None)
    if not found:
        pytest.skip(f"no browser: none of {', '.join(NAMES)} is installed, and QUILT_CHROMIUM is not set")
    return found


def look(page: Path, settings: str, width: int, height: int, folder: Path) -> Seen:
    """Open a page with settings after #, and look at a canvas of this size."""
    picture = folder / "screenshot.png"
    address = f"{page.as_uri()}#test&panel=0&size={width}x{height}&{settings}"
    # The window's own frame takes some of its height.
    room = [f"--window-size={width + 40},{height + 200}", f"--user-data-dir={folder / 'profile'}"]
    command = [chromium(), *FLAGS, *room, "--dump-dom", f"--screenshot={picture}", address]
    done = subprocess.run(command, capture_output=True, text=True, timeout=150, check=False)
    title = re.search("<title>(.*?)</title>", done.stdout, re.DOTALL)
    assert title, f"the browser has shown no page: {done.stderr[-2000:]}"
    pixels = np.asarray(Image.open(picture).convert("RGB"))[:height, :width]
    return Seen(
        title[1], pixels, [line for line in done.stderr.splitlines() if "CONSOLE" in line], done.stdout
    )
