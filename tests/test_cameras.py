"""Cameras: geometry, paths, recorded files and the words of the command line."""

import itertools
import json

import numpy as np
import pytest

from golden import cameras, scene
from golden.cameras import camera as geometry
from golden.cameras import paths, readers
from golden.errors import InputError

START = cameras.look_at((1.0, -2.0, -4.0), (0.5, -1.0, 3.0), (0, -1, 0), 60, 640, 384)
TARGET = np.array([0.5, -1.0, 3.0])
FLIP = np.diag([1.0, -1, -1])


def refused(words: tuple, call, *arguments) -> None:
    with pytest.raises(InputError) as caught:
        call(*arguments)
    assert "\n" not in str(caught.value) and all(w in str(caught.value) for w in words), caught.value


def turn_between(a, b) -> float:
    """Degrees between two cameras."""
    return float(np.degrees(np.arccos(np.clip((np.trace(b.rotation @ a.rotation.T) - 1) / 2, -1, 1))))


def random_cameras(n: int, seed: int = 0) -> list[cameras.Camera]:
    rng = np.random.default_rng(seed)
    return [cameras.look_at(rng.normal(size=3), rng.normal(size=3), rng.normal(size=3), 50, 64, 48) for _ in range(n)]


# ---- geometry


def test_look_at_by_hand():
    camera = cameras.look_at((0, 0, 0), (0, 0, 5), (0, -1, 0), 90, 200, 100)
    assert np.allclose(camera.rotation, np.eye(3))  # y down, z forward: the axes of the world
    assert camera.fx == pytest.approx(50) and (camera.cx, camera.cy) == (100, 50) and camera.near == 0.2
    assert camera.tan_x == pytest.approx(2) and camera.tan_y == pytest.approx(1)
    up_z = cameras.look_at((2, 0, 0), (0, 0, 0), (0, 0, 1), 90, 10, 10)
    assert np.allclose(up_z.rotation, [[0, 1, 0], [0, 0, -1], [-1, 0, 0]])


def test_look_at_is_a_rotation_and_centres_its_target():
    for camera in random_cameras(50):
        assert np.allclose(camera.rotation @ camera.rotation.T, np.eye(3))
        assert np.linalg.det(camera.rotation) == pytest.approx(1)
    x, y, z = START.rotation @ (TARGET - START.position)
    assert abs(x) < 1e-12 and abs(y) < 1e-12 and z > 0


def test_views_that_are_none():
    refused(("differ",), cameras.look_at, (1, 1, 1), (1, 1, 1), (0, 1, 0), 60, 8, 8)
    refused(("parallel",), cameras.look_at, (0, 0, 0), (0, 3, 0), (0, -1, 0), 60, 8, 8)
    refused(("180",), cameras.look_at, (0, 0, 0), (0, 0, 1), (0, -1, 0), 180, 8, 8)


def test_quaternions_and_matrices_agree():
    rng = np.random.default_rng(0)
    quats = rng.normal(size=(200, 4)) * rng.choice([1, 1e-9], (200, 4))  # also near the axes
    quats = np.concatenate([quats, np.eye(4)])
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    for q, m in zip(quats, geometry.matrices(quats)):
        back = geometry.quaternion(m)
        assert min(np.abs(back - q).max(), np.abs(back + q).max()) < 1e-12


def test_slerp_turns_evenly():
    a = np.array([1.0, 0, 0, 0])
    b = np.array([np.cos(0.6), 0, np.sin(0.6), 0])
    for sign in (1, -1):
        for t in (0, 0.25, 0.5, 1):
            q = geometry.slerp(a, sign * b, t)
            assert np.abs(q) == pytest.approx([np.cos(0.6 * t), 0, np.sin(0.6 * t), 0])


# ---- paths


@pytest.mark.parametrize("kind", paths.KINDS)
def test_frame_0_is_the_start_and_pieces_of_a_path_agree(kind):
    whole = cameras.path(kind, START, range(20), 30, 1, TARGET)
    assert len(whole) == 20
    assert np.allclose(whole[0].position, START.position) and np.allclose(whole[0].rotation, START.rotation)
    for camera in whole:
        assert np.allclose(camera.rotation @ camera.rotation.T, np.eye(3)) and camera.fx == START.fx
    if kind != "cut":
        piece = cameras.path(kind, START, range(7, 9), 30, 1, TARGET)
        assert np.array_equal(piece[0].position, whole[7].position)
    again = cameras.path(kind, START, range(20), 30, 1, TARGET)
    assert all(np.array_equal(a.rotation, b.rotation) for a, b in zip(whole, again))


@pytest.mark.parametrize("kind, degrees", [("orbit", 15), ("pan", 15), ("static", 0), ("dolly", 0)])
def test_turn_a_second(kind, degrees):
    one = cameras.path(kind, START, range(31), 30, 1, TARGET)
    assert turn_between(one[0], one[30]) == pytest.approx(degrees, abs=1e-5)
    fast = cameras.path(kind, START, range(31), 60, 2, TARGET)  # twice the rate, twice the speed: the same path
    assert all(np.allclose(a.position, b.position) for a, b in zip(one, fast))


def test_orbit_keeps_its_target_and_distance():
    for camera in cameras.path("orbit", START, range(0, 300, 30), 30, 1, TARGET):
        x, y, z = camera.rotation @ (TARGET - camera.position)
        assert abs(x) < 1e-9 and abs(y) < 1e-9 and z == pytest.approx(np.linalg.norm(TARGET - START.position))


def test_dolly_goes_ahead_half_a_metre_a_second():
    for scale in (1.0, 0.1):
        end = cameras.path("dolly", START, range(60, 61), 30, 1, TARGET, scale)[0]
        assert np.allclose(end.position, START.position + scale * START.rotation[2])


def test_shake_steps_like_a_hand_and_follows_its_seed():
    shake = cameras.path("shake", START, range(600), 30, 1, TARGET, 1.0)
    shifts = [np.linalg.norm(b.position - a.position) for a, b in itertools.pairwise(shake)]
    turns = [turn_between(a, b) for a, b in itertools.pairwise(shake)]
    assert 0.002 < np.sqrt(np.mean(np.square(shifts))) < 0.006
    assert 0.35 < np.sqrt(np.mean(np.square(turns))) < 0.65
    assert max(np.linalg.norm(c.position - START.position) for c in shake) < 0.3  # trembles, does not walk away
    jerk = [np.linalg.norm(a.position - 2 * b.position + c.position) for a, b, c in zip(shake, shake[1:], shake[2:])]
    assert np.mean(jerk) < 0.7 * np.mean(shifts)  # smooth: band-limited
    small = cameras.path("shake", START, range(600), 30, 1, TARGET, 0.1)
    assert np.allclose(small[9].position - START.position, 0.1 * (shake[9].position - START.position))
    assert not np.allclose(
        cameras.path("shake", START, range(9, 10), 30, 1, TARGET, 1.0, seed=1)[0].rotation, shake[9].rotation
    )


@pytest.mark.parametrize("frames, first", [(range(10), 5), (range(4, 9), 7), (range(2), 1), (range(1), None)])
def test_cut_jumps_half_way_and_holds(frames, first):
    cut = cameras.path("cut", START, frames, 30, 1, TARGET)
    jumped = [turn_between(START, c) > 1 for c in cut]
    assert jumped == [first is not None and f >= first for f in frames]
    assert all(turn_between(START, c) == pytest.approx(60) for c, j in zip(cut, jumped) if j)


def test_paths_refuse():
    refused(("spiral", "orbit"), cameras.path, "spiral", START, range(2), 30, 1, TARGET)
    refused(("--fps 0",), cameras.path, "orbit", START, range(2), 0, 1, TARGET)
    refused(("--speed nan",), cameras.path, "orbit", START, range(2), 30, float("nan"), TARGET)


# ---- recorded files: each written here from known cameras


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


# ---- the command line's words


def test_sizes():
    assert cameras.parse_size("640x384") == (640, 384) and cameras.parse_size("1X8192") == (1, 8192)
    assert [cameras.parse_size(s) for s in ("hd", "fhd", "QHD")] == [(1280, 720), (1920, 1080), (2560, 1440)]
    for text in ("", "640", "640x", "0x4", "8193x4", "-4x4", "4x4x4", "4 x4", "1e2x4", "uhd", "٤x٤", "9" * 99 + "x1"):
        refused(("--size",), cameras.parse_size, text)


def test_frames():
    assert cameras.parse_frames("3") == range(3) and cameras.parse_frames("2:5") == range(2, 5)
    for text in ("", "0", "-1", "3:3", "5:2", "1:", ":3", "a", "1:2:3", "1.5", "9999999999"):
        refused(("--frames",), cameras.parse_frames, text)


def test_camera_words():
    eye, at, up, fovy = cameras.parse_camera("-1,2,3e0/4,5,6/0,-1,0/60")
    assert (eye, at, up, fovy) == ((-1, 2, 3), (4, 5, 6), (0, -1, 0), 60)
    for text, word in (
        ("", "EX"),
        ("1,2,3/4,5,6/0,1,0", "FOVY"),
        ("1,2/4,5,6/0,1,0/60", "EX"),
        ("1,2,x/4,5,6/0,1,0/60", "'x'"),
        ("1,2,nan/4,5,6/0,1,0/60", "nan"),
        ("1,2,3/1,2,3/0,1,0/60", "differ"),
        ("0,0,0/0,1,0/0,1,0/60", "parallel"),
        ("0,0,0/0,0,1/0,1,0/0", "degrees"),
    ):
        refused((word,), cameras.parse_camera, text)


def ball(n: int, radius: float, source: str = "x.ply") -> scene.Gaussians:
    """A filled ball of small Gaussians around (5, 6, 7)."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(n, 3))
    points *= radius * rng.random((n, 1)) ** (1 / 3) / np.linalg.norm(points, axis=1, keepdims=True)
    ones = np.ones((n, 4))
    return scene.checked(
        "x", points + (5, 6, 7), 0.01 * ones[:, :3], ones, ones[:, 0], np.zeros((n, 1, 3)), source=source
    )


@pytest.mark.parametrize("radius", [0.1, 1, 50])
def test_default_view_of_an_object_stands_outside_it(radius):
    g = ball(2000, radius)
    camera = cameras.look_at(*cameras.default_view(g), 640, 400)
    x, y, z = ((g.means - camera.position) @ camera.rotation.T).T
    assert ((z > camera.near) & (abs(x) < camera.tan_x * z) & (abs(y) < camera.tan_y * z)).mean() > 0.95
    assert camera.rotation[1] @ (0, 1, 0) > 0.5  # down is down


def test_default_view_of_a_surrounded_scene_stands_inside_it():
    g, far = ball(2000, 3), ball(200, 300)
    both = np.concatenate([g.means, far.means])
    ones = np.ones((2200, 4))
    g = scene.checked("x", both, ones[:, :3], ones, ones[:, 0], np.zeros((2200, 1, 3)))
    assert np.linalg.norm(np.array(cameras.default_view(g)[0]) - (5, 6, 7)) < 1


def test_default_view_of_special_scenes():
    assert cameras.default_view(scene.load("builtin:aerial?n=9"))[3] == 50
    assert cameras.default_view(ball(9, 1, "a.spz"))[2] == (0, 1, 0)
    for n in (0, 1):
        cameras.look_at(*cameras.default_view(ball(n, 1)), 64, 64)
    assert cameras.scene_scale(ball(9, 1)) is None and cameras.scene_scale(scene.load("builtin:room?n=9")) == 1
