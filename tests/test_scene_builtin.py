"""Built-in scenes: the same bits for the same words, exact counts, and the habits of trained scenes."""

import time

import numpy as np
import pytest

from golden import scene
from golden.cameras.camera import matrices
from golden.errors import InputError
from golden.scene import builtin, shapes

FIELDS = ("means", "scales", "quats", "opacities", "sh")


@pytest.mark.parametrize("name", builtin.SCENES)
def test_same_words_give_same_bits_and_another_seed_does_not(name):
    first, again, other = (scene.load(f"builtin:{name}?n=2000&seed={s}") for s in (3, 3, 4))
    assert all(np.array_equal(getattr(first, f), getattr(again, f)) for f in FIELDS)
    assert not any(np.array_equal(getattr(first, f), getattr(other, f)) for f in FIELDS)


@pytest.mark.parametrize("name", builtin.SCENES)
@pytest.mark.parametrize("n", [1, 2, 7, 2000, 4321])
def test_exactly_n_gaussians_and_none_rejected(name, n):
    g = scene.load(f"builtin:{name}?n={n}")
    assert len(g) == n and not any(g.counters.values()) and g.name == name


@pytest.mark.parametrize("degree", range(4))
def test_sh_degree_is_a_choice_that_keeps_the_rest(degree):
    g, full = scene.load(f"builtin:room?n=500&sh={degree}"), scene.load("builtin:room?n=500")
    assert g.sh.shape == (500, (degree + 1) ** 2, 3) and full.sh.shape[1] == 16
    assert np.array_equal(g.means, full.means) and np.array_equal(g.sh[:, 0], full.sh[:, 0])


@pytest.mark.parametrize("name", builtin.SCENES)
def test_looks_trained(name):
    g = scene.load(f"builtin:{name}?n=60000")
    aspect = g.scales.max(axis=1) / g.scales.min(axis=1)
    assert 3.5 < np.median(aspect) < 9 and np.percentile(aspect, 99.9) > 80
    size = np.log(g.scales.max(axis=1))
    assert 0.4 < size.std() < 3
    assert (g.opacities > 0.8).mean() > 0.05 and 0.1 < (g.opacities < 0.2).mean() < 0.8
    assert abs(np.linalg.norm(g.quats, axis=1) - 1).mean() > 0.05
    colour = 0.28209479 * g.sh[:, 0] + 0.5
    assert colour.min() > -0.1 and colour.max() < 2 and colour.std() > 0.05


@pytest.mark.parametrize("name", builtin.SCENES)
def test_default_view_sees_the_scene(name):
    """At least a third of the Gaussians project into the picture of the default camera."""
    from golden.cameras import look_at

    camera = look_at(*builtin.default_view(name), 640, 400)
    x, y, z = ((scene.load(f"builtin:{name}?n=20000").means - camera.position) @ camera.rotation.T).T
    seen = (z > camera.near) & (abs(x) < camera.tan_x * z) & (abs(y) < camera.tan_y * z)
    assert seen.mean() > 1 / 3
    assert builtin.scale(name) == 1


def test_surfaces_lie_where_the_room_is():
    g = scene.load("builtin:room?n=20000")
    floor = (abs(g.means[:, 1]) < 0.02) & (abs(g.means[:, 0]) < 2.9) & (abs(g.means[:, 2]) < 2.4)
    assert floor.sum() > 500
    # a disk on the floor has its shortest axis along the vertical: third column of its rotation
    w, x, y, z = (g.quats[floor] / np.linalg.norm(g.quats[floor], axis=1, keepdims=True)).T
    assert np.median(abs(2 * (y * z - w * x))) > 0.999
    assert (np.argmin(g.scales[floor], axis=1) == 2).mean() > 0.98


def test_disks_are_tangent():
    """The local z axis of every quaternion is the normal it was made for, also straight back."""
    rng = np.random.default_rng(0)
    normals = np.concatenate([shapes.directions(rng, 500), np.eye(3), -np.eye(3)])
    quats = shapes.aligned(rng, normals)
    rotation = matrices(quats / np.linalg.norm(quats, axis=1, keepdims=True))
    assert np.allclose(rotation[:, :, 2], normals)
    assert np.ptp(np.arctan2(rotation[:500, 0, 0], rotation[:500, 0, 1])) > 6  # rolled every way


@pytest.mark.slow
def test_two_million_take_seconds():
    start = time.process_time()
    assert len(scene.load("builtin:street?n=2000000&sh=0")) == builtin.N_MAX
    assert time.process_time() - start < 15


def test_short_and_default_words():
    assert scene.load("builtin:").name == "room" and len(scene.load("builtin:object")) == 20_000
    assert scene.load("builtin:object?antialias=1&n=5").antialias


@pytest.mark.parametrize(
    "spec, words",
    [
        ("builtin:rom", ("rom", "room", "translucent")),
        ("builtin:room?n=0", ("n=0", "1 to 2000000")),
        ("builtin:room?n=2000001", ("n=2000001",)),
        ("builtin:room?n=1e4", ("n=1e4",)),
        ("builtin:room?n=-5", ("n=-5",)),
        ("builtin:room?n", ("n=",)),
        ("builtin:room?n=²", ("n=²",)),
        ("builtin:room?sh=4", ("sh=4", "0 to 3")),
        ("builtin:room?seed=x", ("seed=x",)),
        ("builtin:room?size=3", ("size", "seed")),
        ("builtin:room?n=9" + "9" * 99, ("n=9",)),
        ("builtin:ro\nom", ("ro om",)),
    ],
)
def test_wrong_words_are_named(spec, words):
    with pytest.raises(InputError) as caught:
        scene.load(spec)
    assert "\n" not in str(caught.value) and all(w in str(caught.value) for w in words), caught.value
