"""Recorded cameras: nerfstudio transforms.json, INRIA cameras.json, TUM trajectories, Record3D metadata.

The kind is told by the content. Files with times (TUM, Record3D) are resampled to the asked rate; in the others one
camera follows the other at that rate. The vertical field of view is kept when the picture has another shape.
"""

from __future__ import annotations

import dataclasses
import logging
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from golden.cameras.camera import Camera, focal, matrices, quaternion, slerp
from golden.cameras.paths import check_rate
from golden.errors import InputError
from golden.scene.files import member, numbers, one_line, parse_json, read_bytes

FLIP = np.diag([1.0, -1.0, -1.0])  # OpenGL and ARKit camera axes (y up, z backward) to ours (y down, z forward)
TUM_FOVY = 50.0  # degrees; the file holds no lens, the recordings' own is about this
DISTORTION = ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")
PINHOLES = ("PINHOLE", "SIMPLE_PINHOLE", "OPENCV", "SIMPLE_RADIAL", "RADIAL")
RELATIVE = ("tum", "record3d")  # poses in the recording's own world: use place()
log = logging.getLogger("golden")


@dataclass(frozen=True)
class Track:
    """Poses as recorded."""

    kind: str
    times: np.ndarray | None  # [n] seconds, ascending; None: one pose a frame
    positions: np.ndarray  # [n, 3]
    rotations: np.ndarray  # [n, 3, 3] world to camera
    lenses: np.ndarray  # [n, 4] fx fy cx cy in units of the picture's height, cx from the picture's middle


def read(path: str | Path, width: int, height: int, frames: range, fps: float, speed: float) -> list[Camera]:
    """One camera a frame. TUM and Record3D poses stay in the recording's own world until `place` moves them."""
    check_rate(fps, speed)
    track = load(Path(path))
    n = len(track.positions)
    step = speed / fps if track.times is not None else speed  # seconds, or poses, a frame
    times = np.arange(n, dtype=np.float64) if track.times is None else track.times - track.times[0]
    quats = np.stack([quaternion(r) for r in track.rotations])
    cameras = []
    for frame in frames:
        t = frame * step
        if t > times[-1] * (1 + 1e-12) + 1e-9:
            last = math.floor(times[-1] / step + 1e-9)
            raise InputError(f"{path}: frame {frame} lies behind the end, {n} poses last for frames 0 to {last}")
        k = int(np.clip(np.searchsorted(times, t, side="right") - 1, 0, max(n - 2, 0)))
        j = min(k + 1, n - 1)
        part = 0.0 if j == k else float(np.clip((t - times[k]) / (times[j] - times[k]), 0, 1))
        if part == 1:
            k, part = j, 0.0
        position = track.positions[k] + part * (track.positions[j] - track.positions[k])
        rotation = matrices(slerp(quats[k], quats[j], part)) if part else track.rotations[k]
        lens = track.lenses[k] + part * (track.lenses[j] - track.lenses[k])
        cameras.append(camera_of(lens, rotation, position, width, height))
    return cameras


def kind_of(path: str | Path) -> str:
    """nerfstudio, inria, tum or record3d."""
    return load(Path(path)).kind


def place(cameras: list[Camera], start: Camera, scale: float) -> list[Camera]:
    """The recorded motion relative to its first frame, `scale` world units for one of its own, attached to `start`.

    Size and lens are those of `start`; recorded frame 0 becomes `start` itself.
    """
    placed = []
    for camera in cameras:
        first = cameras[0]
        turn = camera.rotation @ first.rotation.T  # first camera's axes to this camera's
        shift = first.rotation @ (camera.position - first.position) * scale  # in the first camera's axes
        position = start.position + start.rotation.T @ shift
        placed.append(dataclasses.replace(start, rotation=turn @ start.rotation, position=position))
    return placed


def camera_of(lens: np.ndarray, rotation: np.ndarray, position: np.ndarray, width: int, height: int) -> Camera:
    fx, fy, cx, cy = (float(v) for v in lens * height)
    return Camera(width, height, fx, fy, width / 2 + cx, cy, rotation, position)


def load(path: Path) -> Track:
    data = read_bytes(path)
    first = data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1]
    if first not in (b"{", b"["):
        return tum(data, str(path))
    top = parse_json(data, str(path))
    if isinstance(top, list):
        return inria(top, str(path))
    if "frames" in top:
        return nerfstudio(top, str(path))
    if "poses" in top:
        return record3d(top, str(path))
    raise InputError(
        f"{path}: fields {one_line(', '.join(top) or 'none')} found; 'frames' (nerfstudio), 'poses' (Record3D), a list"
        " of cameras (INRIA) or TUM lines are needed"
    )


def lens_of(fx: float, fy: float, cx: float, cy: float, width: float, height: float, where: str) -> np.ndarray:
    """[4] fx, fy, cx - width / 2, cy in units of the height."""
    if not (fx > 0 and fy > 0 and width > 0 and height > 0):
        raise InputError(f"{where}: focal length {fx:g}, {fy:g} and size {width:g} x {height:g} must be above 0")
    return np.array([fx, fy, cx - width / 2, cy]) / height


def rotation_of(m: np.ndarray, where: str) -> np.ndarray:
    """The nearest rotation to a matrix that is one up to rounding."""
    with np.errstate(all="ignore"):
        off = np.abs(m @ m.T - np.eye(3)).max()
    if not off < 1e-2 or np.linalg.det(m) < 0:
        raise InputError(
            f"{where}: is no rotation matrix (off by {off:.3g}), an orthonormal right-handed one is needed"
        )
    u, _, v = np.linalg.svd(m)
    return u @ v


def unit_quaternion(xyzw: np.ndarray, where: str) -> np.ndarray:
    """w x y z of a quaternion that is a unit one up to rounding."""
    norm = float(np.sqrt((xyzw**2).sum())) if np.abs(xyzw).max() < 2 else math.inf
    if not 0.9 < norm < 1.1:
        raise InputError(f"{where}: quaternion {one_line(xyzw.tolist())} has norm {norm:.3g}, 1 is needed")
    return np.roll(xyzw, 1) / norm


def number(value: dict, key: str, where: str) -> float:
    return float(numbers(member(value, key, where, (int, float), "a number"), (), f"{where}: field '{key}'"))


def nerfstudio(top: dict, where: str) -> Track:
    """Camera-to-world matrices with OpenGL axes; intrinsics for all or per frame.

    Lens distortion is not modelled: non-zero coefficients are reported once and left out. `applied_transform` is
    already part of the matrices.
    """
    frames = member(top, "frames", where, list, "a list of frames")
    if not frames:
        raise InputError(f"{where}: field 'frames' is empty, one camera or more is needed")
    positions, rotations, lenses, bent = [], [], [], 0
    for k, frame in enumerate(frames):
        at = f"{where}: frames[{k}]"
        matrix = member(frame, "transform_matrix", at, list, "a 4 x 4 matrix")
        m = numbers(matrix[:3], (3, 4), f"{at}.transform_matrix")
        rotations.append(FLIP @ rotation_of(m[:, :3], f"{at}.transform_matrix").T)
        positions.append(m[:, 3])
        both = {**top, **frame}
        model = both.get("camera_model", "OPENCV")
        if model not in PINHOLES:
            raise InputError(f"{at}: camera_model is {one_line(model)}, {', '.join(PINHOLES)} are read")
        lenses.append(nerfstudio_lens(both, at))
        bent += any(key in both and number(both, key, at) != 0 for key in DISTORTION)
    if bent:
        log.warning("%s: lens distortion of %d frames is left out, cameras are pinholes", where, bent)
    return Track("nerfstudio", None, np.array(positions), np.array(rotations), np.array(lenses))


def nerfstudio_lens(fields: dict, where: str) -> np.ndarray:
    if "fl_x" in fields:
        fx = number(fields, "fl_x", where)
        fy = number(fields, "fl_y", where) if "fl_y" in fields else fx
        width, height = (number(fields, key, where) for key in ("w", "h"))
        cx = number(fields, "cx", where) if "cx" in fields else width / 2
        cy = number(fields, "cy", where) if "cy" in fields else height / 2
        return lens_of(fx, fy, cx, cy, width, height, where)
    if "camera_angle_x" not in fields:
        raise InputError(f"{where}: field 'fl_x' (with w and h) or 'camera_angle_x' is needed")
    angle = number(fields, "camera_angle_x", where)
    if not 0 < angle < math.pi:
        raise InputError(f"{where}: camera_angle_x is {angle:g}, radians above 0 and below pi are needed")
    width, height = (
        number(fields, key, where) if key in fields else 800.0 for key in ("w", "h")
    )  # Blender set: square
    f = 0.5 * width / math.tan(angle / 2)
    return lens_of(f, f, width / 2, height / 2, width, height, where)


def inria(top: list, where: str) -> Track:
    """Camera-to-world rotations with our axes, positions, and a lens each."""
    if not top:
        raise InputError(f"{where}: the list is empty, one camera or more is needed")
    positions, rotations, lenses = [], [], []
    for k, entry in enumerate(top):
        at = f"{where}: [{k}]"
        positions.append(numbers(member(entry, "position", at, list, "3 numbers"), (3,), f"{at}.position"))
        m = numbers(member(entry, "rotation", at, list, "a 3 x 3 matrix"), (3, 3), f"{at}.rotation")
        rotations.append(rotation_of(m, f"{at}.rotation").T)
        width, height, fx, fy = (number(entry, key, at) for key in ("width", "height", "fx", "fy"))
        lenses.append(lens_of(fx, fy, width / 2, height / 2, width, height, at))
    return Track("inria", None, np.array(positions), np.array(rotations), np.array(lenses))


def record3d(top: dict, where: str) -> Track:
    """Camera-to-world quaternions with ARKit axes at a fixed rate, one lens (K column by column)."""
    poses = member(top, "poses", where, list, "a list of poses")
    if not poses:
        raise InputError(f"{where}: field 'poses' is empty, one pose or more is needed")
    rate = number(top, "fps", where) if "fps" in top else 30.0
    if not 0 < rate <= 1e6:
        raise InputError(f"{where}: field 'fps' is {rate:g}, a rate above 0 is needed")
    k = numbers(member(top, "K", where, list, "9 numbers"), (9,), f"{where}: K")
    width, height = (number(top, key, where) for key in ("w", "h"))
    lens = lens_of(k[0], k[4], k[6], k[7], width, height, where)
    rows = np.stack([numbers(p, (7,), f"{where}: poses[{i}]") for i, p in enumerate(poses)])
    quats = np.stack([unit_quaternion(r[:4], f"{where}: poses[{i}]") for i, r in enumerate(rows)])
    rotations = FLIP @ matrices(quats).transpose(0, 2, 1)
    return Track("record3d", np.arange(len(rows)) / rate, rows[:, 4:], rotations, np.tile(lens, (len(rows), 1)))


def tum(data: bytes, where: str) -> Track:
    """Lines `timestamp tx ty tz qx qy qz qw`, camera to world with our axes; # starts a comment."""
    try:
        lines = data.decode("utf-8").splitlines()
    except UnicodeDecodeError as error:
        raise InputError(f"{where}: byte {error.start} is not text; TUM lines or JSON are needed") from error
    times, positions, quats = [], [], []
    for at, line in enumerate(lines, start=1):
        words = line.split("#")[0].split()
        if not words:
            continue
        here = f"{where}: line {at}"
        if len(words) != 8:
            raise InputError(f"{here} has {len(words)} fields, 'timestamp tx ty tz qx qy qz qw' are needed")
        try:
            row = np.array([float(w) for w in words])
        except ValueError as error:
            raise InputError(f"{here}: {one_line(error)}, 8 numbers are needed") from error
        if not np.isfinite(row).all():
            raise InputError(f"{here}: {one_line(line)} holds no finite number, 8 are needed")
        if times and row[0] <= times[-1]:
            raise InputError(f"{here}: timestamp {words[0]} is not later than the one before")
        times.append(row[0])
        positions.append(row[1:4])
        quats.append(unit_quaternion(row[4:], here))
    if not times:
        raise InputError(f"{where}: holds no pose, lines 'timestamp tx ty tz qx qy qz qw' are needed")
    rotations = matrices(np.array(quats)).transpose(0, 2, 1)
    lens = lens_of(focal(TUM_FOVY, 1), focal(TUM_FOVY, 1), 0.5, 0.5, 1, 1, where)
    return Track("tum", np.array(times), np.array(positions), rotations, np.tile(lens, (len(times), 1)))
