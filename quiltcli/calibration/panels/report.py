"""What a calibration found, for people: tables, residuals, pictures over the photos."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from quiltcli.calibration.panels.attached import write_rig
from quiltcli.calibration.panels.camera import write_camera
from quiltcli.calibration.panels.solve import Solution
from quiltcli.display import Facets
from quiltcli.formats.png import save_png
from quiltcli.formats.whole import make_folder, write_text
from quiltcli.geometry import FloatArray, dot

_WIDEST = 1600
"""Width of a picture over a photo, pixels."""


def table(solution: Solution, facets: Facets) -> Iterator[str]:
    """A line a facet: how it has moved, and how sure that is (two standard deviations)."""
    names = [facets.names[facet - 1] for facet in solution.facets]
    wide = max(4, *map(len, names))
    yield (
        f"facet  {'name':<{wide}}  moved mm (x, y, z)            ±      turned °   ±       corners   rms px"
    )
    residual = solution.adjusted.residual
    for row, (facet, name) in enumerate(zip(solution.facets, names, strict=True)):
        own = (solution.corners.facet == row) & solution.adjusted.used
        rms = math.sqrt(float((residual[own] ** 2).sum() / max(int(own.sum()), 1)))
        moved = " ".join(f"{1000 * value:8.2f}" for value in solution.adjusted.bundle.facets[row, 3:])
        sure = 2000 * float(np.linalg.norm(solution.shift_deviation[row]))
        turned = 2 * math.degrees(float(np.linalg.norm(solution.turn_deviation[row])))
        note = "  stays" if facet == solution.anchor else ""
        yield (
            f"{facet:>5}  {name:<{wide}}  {moved}  {sure:8.3f}  {math.degrees(solution.turn[row]):8.3f}  "
            f"{turned:7.4f}  {int(own.sum()):>7}   {rms:6.3f}{note}"
        )


def summary(solution: Solution) -> Iterator[str]:
    """What holds for all of it."""
    adjusted, camera = solution.adjusted, solution.camera
    left = int((~adjusted.used).sum())
    yield (
        f"{len(solution.photos)} photos, {len(adjusted.used) // 4} markers; corners agree to "
        f"{adjusted.deviation:.3f} px{f', {left} left out' if left else ''}"
    )
    focal, middle = camera.focal, camera.centre
    how = f" ± {2 * adjusted.camera_deviation[0]:.1f}" if adjusted.bundle.free else " (given)"
    yield (
        f"camera: focal length {focal[0]:.1f}{how} px, middle {middle[0]:.1f}, {middle[1]:.1f} px, "
        f"distortion {', '.join(f'{value:.4f}' for value in camera.distortion)}"
    )
    for number, found in enumerate(solution.boards, 1):
        x, y, z = found.places.mean(axis=(0, 1))
        sure = 2000 * float(np.linalg.norm(found.deviation))
        yield (
            f"board {number}, in {found.photos} photos: its middle is at {x:.4f}, {y:.4f}, {z:.4f} m "
            f"± {sure:.2f} mm"
        )
    if solution.strangers:
        shown = ", ".join(map(str, solution.strangers[:8]))
        yield f"markers that are not on this display were seen and left alone: {shown}"


def at_the_eye(solution: Solution, facets: Facets, eye: FloatArray) -> Iterator[str]:
    """What is not known of the facets' places means at an eye (3,): degrees there, and pixels."""
    for row, facet in enumerate(solution.facets):
        if facet == solution.anchor:
            continue
        k = facet - 1
        local = facets.polygon(k) - solution.adjusted.bundle.middles[row]
        # A corner moves by its shift, and by the turn about the middle: t + w × x.
        x, y, z = local.T
        zero = np.zeros_like(x)
        cross = np.stack((zero, z, -y, -z, zero, x, y, -x, zero), axis=1).reshape(-1, 3, 3)
        moves = np.concatenate((cross, np.broadcast_to(np.eye(3), cross.shape)), axis=2)
        spread = moves @ solution.adjusted.covariance[row] @ moves.transpose(0, 2, 1)
        away = facets.polygon(k) - eye
        distance = np.sqrt(dot(away, away))
        sight = away / distance[:, None]
        # Only what is across the line of sight is seen; on the facet it is a step along its plane.
        across = np.eye(3) - sight[:, :, None] * sight[:, None, :]
        angle = np.sqrt(np.linalg.eigvalsh(across @ spread @ across)[:, -1]) / distance
        normal = facets.normal[k]
        lean = sight @ normal
        lean = np.where(np.abs(lean) < 1e-6, 1e-6, lean)[:, None, None]
        slide = np.eye(3) - sight[:, :, None] * normal / lean
        along = np.sqrt(np.linalg.eigvalsh(slide @ spread @ slide.transpose(0, 2, 1))[:, -1])
        pitch = math.sqrt(min(dot(facets.du[k], facets.du[k]), dot(facets.dv[k], facets.dv[k])))
        yield (
            f"facet {facet}: its corners are known to ± {2 * math.degrees(float(angle.max())):.4f}° from "
            f"there, ± {2 * float(along.max()) / pitch:.2f} px on it"
        )


def write_report(folder: Path, solution: Solution, facets: Facets, photos: Sequence[Path]) -> list[Path]:
    """Write residuals as a table and as pictures, and the camera; the files (OutputError)."""
    make_folder(folder)
    written = [folder / "residuals.csv", folder / "camera.yaml", folder / "facets.txt"]
    write_text(written[0], _residuals(solution))
    write_camera(written[1], solution.camera)
    write_text(written[2], "\n".join((*table(solution, facets), *summary(solution))) + "\n")
    if solution.boards:
        written.append(folder / "rig.json")
        boards = solution.boards
        write_rig(written[-1], [one.board for one in boards], [one.places for one in boards])
    for number, path in enumerate(photos):
        picture = folder / f"{path.stem}.residuals.png"
        _over_photo(picture, path, solution, number)
        written.append(picture)
    return written


def _residuals(solution: Solution) -> str:
    """Every corner as a row."""
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(("photo", "marker", "facet", "corner", "x", "y", "dx", "dy", "used"))
    corners, adjusted = solution.corners, solution.adjusted
    for k in range(len(corners.photo)):
        (x, y), (dx, dy) = corners.pixel[k], adjusted.residual[k]
        name, facet = solution.photos[corners.photo[k]], solution.body(int(corners.facet[k]))
        figures = [f"{value:.4f}" for value in (x, y, dx, dy)]
        rows.writerow((name, int(solution.marker[k]), facet, k % 4 + 1, *figures, int(adjusted.used[k])))
    return out.getvalue()


def _over_photo(picture: Path, photo: Path, solution: Solution, number: int) -> None:
    """Residuals as lines over the photo, so much longer that the usual one is an eighth of an inch."""
    from PIL import Image, ImageDraw, ImageOps

    with Image.open(photo) as opened:
        image = ImageOps.exif_transpose(opened).convert("L").convert("RGB")
    scale = _WIDEST / image.width
    image = image.resize((_WIDEST, max(round(image.height * scale), 1)))
    pen = ImageDraw.Draw(image)
    here = solution.corners.photo == number
    longer = 12 / max(solution.adjusted.deviation * scale, 1e-6)
    for pixel, away, used in zip(
        solution.corners.pixel[here] * scale,
        solution.adjusted.residual[here] * scale * longer,
        solution.adjusted.used[here],
        strict=True,
    ):
        color = (0, 200, 90) if used else (230, 30, 30)
        x, y = pixel.tolist()
        limit = 120 / max(120.0, float(np.abs(away).max()))
        end = (x + float(away[0]) * limit, y + float(away[1]) * limit)
        pen.line([(x, y), end], color, 2)
        pen.ellipse((x - 4, y - 4, x + 4, y + 4), outline=color, width=2)
    words = f"lines: residuals, {longer:.0f} times as long; red: left out"
    pen.rectangle((0, 0, 11 * len(words) // 2 + 24, 30), fill=(20, 20, 20))
    pen.text((10, 8), words, (240, 240, 240))
    save_png(picture, image)
