"""FreeD: dumps of D1 packets of 29 bytes, bare or as UDP packets in a pcap capture.

Byte 0 is 0xD1, 1 the camera; pan, tilt and roll are signed 24-bit numbers of 1/32768°, x, y and height
of 1/64 mm; zoom and focus follow; the last byte makes the sum 0x40. Pan 0 looks along +y, and pan turns
clockwise as seen from above, tilt up, roll clockwise as the camera sees it. Packets have no stamps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quiltcli.formats.noted import note_input
from quiltcli.geometry import FloatArray, quaternions
from quiltcli.job import RecordedSpec
from quiltcli.viewer.recorded.tables import check_size
from quiltcli.viewer.recorded.take import Z_UP, Recording, choose, wrong

_SIZE, _MARK = 29, 0xD1
_PCAP = {b"\xd4\xc3\xb2\xa1": ("<", 1e-6), b"\xa1\xb2\xc3\xd4": (">", 1e-6)}
_PCAP |= {b"\x4d\x3c\xb2\xa1": ("<", 1e-9), b"\xa1\xb2\x3c\x4d": (">", 1e-9)}


def read_freed(spec: RecordedSpec) -> Recording:
    """Samples of a FreeD dump; `subject` is the camera's number where there are several.

    Raises:
        ViewerError: there is no packet with a right sum in the file.
    """
    check_size(spec.file)
    data = spec.file.read_bytes()
    note_input(spec.file, data)
    packets, times = _captured(data) if data[:4] in _PCAP else (_bare(data), None)
    right = (packets.sum(axis=1) & 0xFF) == 0x40
    if not right.any():
        raise wrong(spec.file, "holds no FreeD D1 packet of 29 bytes with a right sum")
    cameras = np.unique(packets[right, 1])
    chosen = cameras[choose(spec, [str(camera) for camera in cameras], "cameras")]
    right &= packets[:, 1] == chosen
    bad = int(len(packets) - np.count_nonzero((packets.sum(axis=1) & 0xFF) == 0x40))
    packets = packets[right]
    return Recording(
        subject=f"camera {chosen}",
        positions=np.stack([_signed(packets, k) for k in (11, 14, 17)], axis=1) / 64,
        rotations=_rotations(np.radians(np.stack([_signed(packets, k) for k in (2, 5, 8)], axis=1) / 32768)),
        times=None if times is None else times[right],
        metres=0.001,
        axes=Z_UP,
        notices=(f"{bad} packets with a wrong sum left out",) if bad else (),
    )


def _rotations(angles: FloatArray) -> FloatArray:
    """Rotations (N, 4) in the file's axes of pan, tilt and roll (N, 3): about y, then x, then z."""
    roll_tilt_pan = angles[:, ::-1] * np.array([1.0, 1.0, -1.0])
    return quaternions.from_euler(roll_tilt_pan, "yxz")


def _signed(packets: NDArray[np.int64], at: int) -> FloatArray:
    """A signed 24-bit number, most significant byte first."""
    value = packets[:, at] << 16 | packets[:, at + 1] << 8 | packets[:, at + 2]
    return np.where(value >= 1 << 23, value - (1 << 24), value).astype(np.float64)


def _bare(data: bytes) -> NDArray[np.int64]:
    """Packets (N, 29) one behind the other; what does not fit between them is stepped over."""
    if len(data) % _SIZE == 0 and data[::_SIZE] == bytes([_MARK]) * (len(data) // _SIZE):
        return np.frombuffer(data, dtype=np.uint8).reshape(-1, _SIZE).astype(np.int64)
    found, at = [], data.find(_MARK)
    while 0 <= at <= len(data) - _SIZE:
        packet = data[at : at + _SIZE]
        good = sum(packet) & 0xFF == 0x40
        if good:
            found.append(packet)
        at = data.find(_MARK, at + (_SIZE if good else 1))
    return np.frombuffer(b"".join(found), dtype=np.uint8).reshape(-1, _SIZE).astype(np.int64)


def _captured(data: bytes) -> tuple[NDArray[np.int64], FloatArray]:
    """Packets (N, 29) and stamps (N,) of a pcap capture: the last 29 bytes of UDP packets of that length."""
    order, unit = _PCAP[data[:4]]
    dtype = np.dtype(f"{order}u4")
    packets, times, at = [], [], 24
    while at + 16 <= len(data):
        second, part, length, _ = np.frombuffer(data, dtype, 4, at).tolist()
        body = data[at + 16 : at + 16 + length]
        at += 16 + length
        # The UDP header before the payload ends with length (8 + 29) and checksum.
        if len(body) >= _SIZE + 8 and body[-_SIZE] == _MARK and body[-_SIZE - 4 : -_SIZE - 2] == b"\x00\x25":
            packets.append(body[-_SIZE:])
            times.append(second + part * unit)
    stamps = np.array(times, dtype=np.float64)
    return np.frombuffer(b"".join(packets), dtype=np.uint8).reshape(-1, _SIZE).astype(np.int64), stamps
