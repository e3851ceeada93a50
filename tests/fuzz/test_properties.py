"""The properties on a few examples each, the same in every run; `python -m tests.fuzz` goes on from there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from golden import frame as frames
from golden.formats import BUILD
from golden.frame import Renderer
from golden.hard_cases.setting import camera_a, gaussians
from golden.settings import Settings
from tests.fuzz import properties, rtl, runs, stimulus, table_properties

PROPERTIES = properties.TARGETS | table_properties.TARGETS
FAST = settings(
    max_examples=12, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck)
)


@pytest.mark.parametrize("name", list(PROPERTIES))
def test_holds_of_a_few_examples(name):
    prove, strategies = PROPERTIES[name]
    FAST(given(**strategies)(prove))()


def test_every_key_has_values_to_choose_from():
    """A key that nothing but its default was found for would never be changed."""
    assert {name: found for name, found in stimulus.CHOICES.items() if len(found) < 2} == {}


def test_a_colour_beyond_the_codes_is_clamped_and_counted():
    """Found: 3e38 became 0, because the floor of a float wraps at 64 bits."""
    scene = gaussians((0, 0, 2), scales=0.5, opacities=0.9)
    scene = replace(scene, sh=np.full((1, 1, 3), 3e38, np.float32))
    frame = Renderer(scene, Settings()).frame(camera_a())
    assert frame.counters["clamped_colour"] == 1 and frame.image.max() > 6


@pytest.mark.parametrize("wrong", ["pixel", "code"])
def test_an_error_in_a_picture_or_a_code_is_found(monkeypatch, wrong):
    """A pixel off by 3 LSB, a mean off by one code."""
    scene = gaussians([(0, 0, 2), (0.1, 0, 3)], scales=0.3, opacities=0.9, colours=1.0)
    properties.accuracy(scene, camera_a())

    def broken(original):
        def changed(*arguments, **options):
            result = original(*arguments, **options)
            if wrong == "code":
                return replace(result, mean=result.mean + np.int32(1))
            return replace(result, value=result.value + (3 << BUILD.acc_f - 8))

        return changed

    name = "encode" if wrong == "code" else "rasterise"
    monkeypatch.setattr(frames, name, broken(getattr(frames, name)))
    with pytest.raises(AssertionError, match="off by" if wrong == "pixel" else None):
        properties.accuracy(scene, camera_a())


def test_a_failure_ends_a_run_and_is_counted(capsys):
    def small(x: int) -> None:
        assert x < 100

    counts = runs.run(small, dict(x=st.integers(0, 1000)), 1, 1)
    assert counts["findings"] == 1 and counts["executions"] > 5 and "x=100" in capsys.readouterr().out


@pytest.mark.slow  # builds the RTL model: a minute where it is not there yet
def test_rtl_equals_golden_on_random_scenes():
    for seed in range(3):
        assert rtl.trial(seed)["frames"] >= 2
