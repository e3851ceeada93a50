"""Recorded cameras: files of every kind, written here from known cameras, and broken ones."""

import json

import numpy as np
import pytest

from golden import cameras
from golden.cameras import camera as geometry
from golden.cameras import readers
from golden.errors import InputError
from tests.camera_tools import START, TARGET, random_cameras, refused, turn_between

FLIP = np.diag([1.0, -1, -1])  # OpenGL camera axes to ours


def write(tmp_path, name: str, content) -> str:
    (tmp_path / name).write_text(content if isinstance(content, str) else json.dumps(content))
    return str(tmp_path / name)


def nerfstudio(path: list[cameras.Camera], **lens) -> dict:
    frames = []
    for camera in path:
        m = np.eye(4)
        m[:3, :3], m[:3, 3] = camera.rotation.T @ FLIP, camera.position
        frames.append(dict(file_path="x.png", transform_matrix=m.tolist()))
    return dict(fl_x=50.0, fl_y=51.0, cx=33.0, cy=25.0, w=64, h=48) | lens | dict(frames=frames)


def inria(path: list[cameras.Camera]) -> list:
    size = dict(width=64, height=48, fx=50.0, fy=51.0)
    poses = [dict(position=c.position.tolist(), rotation=c.rotation.T.tolist()) for c in path]
    return [dict(id=k, img_name="x") | size | pose for k, pose in enumerate(poses)]


def tum(path: list[cameras.Camera], rate: float = 10) -> str:
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    for k, camera in enumerate(path):
        w, x, y, z = geometry.quaternion(camera.rotation.T)
        lines.append(" ".join(f"{v:.12f}" for v in (1e3 + k / rate, *camera.position, x, y, z, w)))
    return "\n".join(lines) + "\n"


def record3d(path: list[cameras.Camera], rate: float = 10) -> dict:
    poses = []
    for camera in path:
        w, x, y, z = geometry.quaternion(camera.rotation.T @ FLIP)
        poses.append([x, y, z, w, *camera.position])
    return dict(fps=rate, w=64, h=48, K=[50, 0, 0, 0, 51, 0, 33, 25, 1], poses=poses)


@pytest.mark.parametrize("encode", [nerfstudio, inria, tum, record3d])
def test_files_read_back(tmp_path, encode):
    path = random_cameras(6)
    name = write(tmp_path, "cameras.any", encode(path))
    assert readers.kind_of(name) == encode.__name__
    back = cameras.read(name, 64, 48, range(6), 10, 1)
    for a, b in zip(path, back):
        assert np.allclose(a.rotation, b.rotation, atol=1e-9) and np.allclose(a.position, b.position, atol=1e-9)
        assert (b.width, b.height) == (64, 48)
        if encode is not tum:
            centre = (33, 25) if encode in (nerfstudio, record3d) else (32, 24)
            assert (b.fx, b.fy, b.cx, b.cy) == pytest.approx((50, 51, *centre))
    refused(("frame 6", "0 to 5"), cameras.read, name, 64, 48, range(5, 7), 10, 1)
    assert np.allclose(cameras.read(name, 64, 48, range(5, 6), 10, 1)[0].position, path[5].position)


@pytest.mark.parametrize("encode", [nerfstudio, inria, tum, record3d])
def test_speed_goes_between_poses(tmp_path, encode):
    path = cameras.path("orbit", START, range(8), 10, 1, TARGET)
    name = write(tmp_path, "cameras.any", encode(path))
    half = cameras.read(name, 64, 48, range(15), 10, 0.5)
    for k, camera in enumerate(half):
        wanted = cameras.path("orbit", START, range(k, k + 1), 20, 1, TARGET)[0]
        assert np.allclose(camera.rotation, wanted.rotation, atol=1e-9)  # slerp of an even turn is exact
        assert np.allclose(camera.position, wanted.position, atol=2e-3)  # the chord of the arc is not
    twice = cameras.read(name, 64, 48, range(4), 10, 2)
    assert np.allclose(twice[3].position, path[6].position)


@pytest.mark.parametrize("encode, same", [(tum, False), (record3d, False), (inria, True), (nerfstudio, True)])
def test_only_files_with_times_are_resampled_to_the_rate(tmp_path, encode, same):
    path = cameras.path("orbit", START, range(8), 10, 1, TARGET)
    name = write(tmp_path, "cameras.any", encode(path))
    fine = cameras.read(name, 64, 48, range(5), 20, 1)
    assert np.allclose(fine[4].position, path[4 if same else 2].position)


def test_vertical_field_of_view_is_kept(tmp_path):
    name = write(tmp_path, "t.json", nerfstudio(random_cameras(1)))
    camera = cameras.read(name, 1280, 480, range(1), 30, 1)[0]
    assert (camera.fx, camera.fy, camera.cy) == pytest.approx((500, 510, 250)) and camera.cx == pytest.approx(650)


def test_nerfstudio_lenses(tmp_path, caplog):
    path = random_cameras(2)
    each = nerfstudio(path)
    each["frames"][1] |= dict(fl_x=80.0, fl_y=80.0)
    assert cameras.read(write(tmp_path, "a.json", each), 64, 48, range(2), 30, 1)[1].fx == pytest.approx(80)
    blender = dict(camera_angle_x=0.8, frames=nerfstudio(path)["frames"])
    camera = cameras.read(write(tmp_path, "b.json", blender), 100, 100, range(1), 30, 1)[0]
    assert camera.tan_x == pytest.approx(np.tan(0.4))
    assert not caplog.records
    cameras.read(write(tmp_path, "c.json", nerfstudio(path, k1=0.1, k2=0.0)), 64, 48, range(1), 30, 1)
    assert "distortion of 2 frames" in caplog.text


def test_place_moves_the_first_frame_onto_the_start():
    path = random_cameras(5)
    placed = cameras.place(path, START, 0.2)
    assert np.allclose(placed[0].rotation, START.rotation) and np.allclose(placed[0].position, START.position)
    for a, b in zip(path, placed):
        assert b.width == START.width and b.fx == START.fx
        assert turn_between(path[0], a) == pytest.approx(turn_between(START, b), abs=1e-5)
        assert np.allclose(b.rotation @ START.rotation.T, a.rotation @ path[0].rotation.T)
        seen = path[0].rotation @ (a.position - path[0].position)  # the step as the first camera sees it
        assert np.allclose(START.rotation @ (b.position - START.position), 0.2 * seen)
    assert cameras.place([], START, 1) == []


def test_broken_files_are_named(tmp_path):
    path = random_cameras(3)
    good = tum(path)
    far = nerfstudio(path)
    far["frames"][2]["transform_matrix"][0][0] = 9
    odd = inria(path)
    odd[1]["rotation"] = [[1, 0], [0, 1]]
    cases = [
        ("", ("empty",)),
        ("{", ("line 1", "JSON")),
        ("[" * 90000, ("x.json",)),
        ("{}", ("frames",)),
        ("[]", ("empty",)),
        ("# nothing\n", ("no pose",)),
        (good.replace("\n", " 7\n", 3), ("line 2", "9 fields")),
        (good.replace("1000.1", "1000.0"), ("line 3", "later")),
        ("1 0 0 0 0 0 0 0\n", ("line 1", "norm")),
        ("1 0 0 nan 0 0 0 1\n", ("line 1", "finite")),
        ("1 0 0 x 0 0 0 1\n", ("line 1", "x")),
        (far, ("frames[2]", "rotation")),
        (odd, ("[1].rotation", "3 x 3")),
        (nerfstudio(path, fl_x="wide"), ("fl_x", "wide")),
        (nerfstudio(path, fl_x=0), ("above 0",)),
        (nerfstudio(path, camera_model="OPENCV_FISHEYE"), ("OPENCV_FISHEYE",)),
        (dict(frames=[]), ("frames", "empty")),
        (dict(frames=[7]), ("frames[0]",)),
        (dict(frames=nerfstudio(path)["frames"]), ("fl_x",)),
        (record3d(path) | dict(K=[1] * 8), ("K", "9")),
        (record3d(path, rate=0), ("fps",)),
        (record3d(path) | dict(poses=[]), ("poses",)),
        ([3], ("[0]",)),
    ]
    for content, words in cases:
        refused(("x.json", *words), cameras.read, write(tmp_path, "x.json", content), 64, 48, range(1), 30, 1)
    (tmp_path / "b").write_bytes(b"\xff\xfe\x00")
    refused(("text",), cameras.read, tmp_path / "b", 64, 48, range(1), 30, 1)
    refused(("no such file",), cameras.read, tmp_path / "none", 64, 48, range(1), 30, 1)
    refused(("folder",), cameras.read, tmp_path, 64, 48, range(1), 30, 1)


def test_any_bytes_end_in_cameras_or_one_line(tmp_path):
    rng = np.random.default_rng(0)
    seeds = [json.dumps(e(random_cameras(3))).encode() for e in (nerfstudio, inria, record3d)]
    for good in [*seeds, tum(random_cameras(3)).encode()]:
        for trial in range(150):
            data = bytearray(good[: rng.integers(1, len(good))] if trial % 3 == 0 else good)
            for _ in range(trial % 3 * 2):
                data[rng.integers(len(data))] = rng.integers(32, 127)
            (tmp_path / "x").write_bytes(bytes(data))
            try:
                back = cameras.read(tmp_path / "x", 64, 48, range(2), 30, 1)
            except InputError as error:
                assert "\n" not in str(error)
            else:
                assert all(np.isfinite([c.fx, c.fy, c.cx, c.cy, *c.position, *c.rotation.ravel()]).all() for c in back)
