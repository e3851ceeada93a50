"""Cameras: geometry, paths and the words of the command line."""

import itertools

import numpy as np
import pytest

from golden import cameras, scene
from golden.cameras import camera as geometry
from golden.cameras import paths
from tests.camera_tools import START, TARGET, random_cameras, refused, turn_between

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


@pytest.mark.parametrize("kind", ["orbit", "pan", "cut"])
@pytest.mark.parametrize("up", [None, (0.3, -1, 0.1)])
def test_turns_keep_the_horizon_level(kind, up):
    """The vertical keeps its place in the picture: the nearest world axis, here -y, or the one that is given."""
    vertical = np.array((0, -1, 0) if up is None else up)
    for camera in cameras.path(kind, START, range(0, 120, 40), 30, 1, TARGET, up=up):
        assert np.allclose(camera.rotation @ vertical, START.rotation @ vertical)


def test_pan_turns_to_the_right():
    after = cameras.path("pan", START, range(1, 2), 30, 1, TARGET)[0]
    assert after.rotation[2] @ START.rotation[0] > 0 and np.array_equal(after.position, START.position)


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


# ---- the command line's words


def test_sizes():
    assert cameras.parse_size("640x384") == (640, 384) and cameras.parse_size("1X8191") == (1, 8191)
    assert [cameras.parse_size(s) for s in ("hd", "fhd", "QHD")] == [(1280, 720), (1920, 1080), (2560, 1440)]
    for text in ("", "640", "640x", "0x4", "8192x4", "-4x4", "4x4x4", "4 x4", "1e2x4", "uhd", "٤x٤", "9" * 99 + "x1"):
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
