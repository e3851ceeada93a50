"""Real trained scenes and recorded motion, where they lie beside the repository (../shared)."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest

from golden import cameras, scene
from golden.cameras import readers

SHARED = Path(__file__).parents[2] / "shared"
SCENES, MOTION = SHARED / "scenes", SHARED / "trajectories"
needs_scenes = pytest.mark.skipif(not SCENES.is_dir(), reason="../shared/scenes is not there")
needs_motion = pytest.mark.skipif(not MOTION.is_dir(), reason="../shared/trajectories is not there")


@needs_scenes
@pytest.mark.parametrize(
    "spec, count, bands", [("ukstreet@lod=1", 751_275, 1), ("flowers_lod0", 542_104, 9), ("fox/fox.ply", 50_000, 1)]
)
def test_scene_has_its_count_and_percentiles(spec, count, bands):
    g = scene.load(str(SCENES / spec))
    assert len(g) == count and g.sh.shape == (count, bands, 3) and not any(g.counters.values())
    assert all(np.isfinite(a).all() for a in (g.means, g.scales, g.quats, g.opacities, g.sh))
    if "lod=1" in spec:  # the statistics beside it are of level 0
        return
    known = json.loads((SCENES / spec.split("/")[0] / "stats.json").read_text())
    at = [1, 5, 50, 95, 99]
    columns = dict(x=g.means[:, 0], y=g.means[:, 1], z=g.means[:, 2], opacity=g.opacities)
    columns |= dict(scale_max=g.scales.max(axis=1), scale_min=g.scales.min(axis=1))
    for name, values in columns.items():
        assert np.percentile(values, at) == pytest.approx(known[name][1:-1], rel=1e-3, abs=1e-4), name


@needs_scenes
@pytest.mark.parametrize("spec", ["ukstreet@lod=1", "flowers_lod0", "fox/fox.ply"])
def test_default_view_sees_the_scene(spec):
    g = scene.load(str(SCENES / spec))
    for name in (g.name, "unknown"):  # by its own view, and by the rule for scenes never seen before
        other = scene.Gaussians(name, g.means, g.scales, g.quats, g.opacities, g.sh, source=spec)
        camera = cameras.look_at(*cameras.default_view(other), 640, 400)
        x, y, z = ((g.means - camera.position) @ camera.rotation.T).T
        assert ((z > camera.near) & (abs(x) < camera.tan_x * z) & (abs(y) < camera.tan_y * z)).mean() > 0.1


@needs_scenes
def test_mobilenerf_is_refused():
    with pytest.raises(scene.InputError, match="polygons"):
        scene.load(str(SHARED / "mobilenerf" / "lego_phone_shape3"))


def steps(path: list[cameras.Camera]) -> tuple[np.ndarray, np.ndarray]:
    """Length (world units) and angle (degrees) from each camera to the next."""
    pairs = list(itertools.pairwise(path))
    shift = [np.linalg.norm(b.position - a.position) for a, b in pairs]
    turn = [np.degrees(np.arccos(np.clip((np.trace(b.rotation @ a.rotation.T) - 1) / 2, -1, 1))) for a, b in pairs]
    return np.array(shift), np.array(turn)


@needs_motion
@pytest.mark.parametrize(
    "name, kind, frames, shift, turn",  # medians at 30 fps as the data's own notes state them: metres, degrees
    [
        ("tum_freiburg1_xyz-groundtruth.txt", "tum", 900, 0.0107, 0.50),
        ("record3d_dance_metadata.json", "record3d", 626, 0.025, 0.56),
    ],
)
def test_recorded_motion_has_its_known_steps(name, kind, frames, shift, turn):
    assert readers.kind_of(MOTION / name) == kind
    path = cameras.read(MOTION / name, 640, 480, range(frames), 30, 1)
    shifts, turns = steps(path)
    assert np.median(shifts) == pytest.approx(shift, rel=0.05) and np.median(turns) == pytest.approx(turn, rel=0.05)
    start = cameras.look_at((1, 2, 3), (4, 2, 5), (0, -1, 0), 50, 640, 480)
    placed = cameras.place(path, start, 0.25)
    assert np.allclose(placed[0].rotation, start.rotation) and np.allclose(placed[0].position, start.position)
    assert np.allclose(steps(placed)[0], 0.25 * shifts) and np.allclose(steps(placed)[1], turns, atol=1e-4)
    with pytest.raises(readers.InputError, match="lies behind the end"):
        cameras.read(MOTION / name, 640, 480, range(frames + 10, frames + 11), 30, 1)


@needs_motion
def test_record3d_lens_is_kept_in_its_own_shape():
    camera = cameras.read(MOTION / "record3d_dance_metadata.json", 720, 960, range(1), 30, 1)[0]
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == pytest.approx((717.0637, 717.0637, 359.2449, 485.1830))
