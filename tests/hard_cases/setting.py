"""What the recipes share: of golden.hard_cases, and a frame by the default settings."""

from __future__ import annotations

from golden.cameras.camera import Camera
from golden.frame import Frame, Renderer
from golden.hard_cases.setting import camera_a, gaussians, merge, yaw
from golden.scene.gaussians import Gaussians
from golden.settings import Settings

__all__ = ["camera_a", "gaussians", "merge", "render", "yaw"]


def render(scene: Gaussians, camera: Camera, background: str = "0,0,0", **keys) -> Frame:
    """The first frame of a scene."""
    return Renderer(scene, Settings(background=background, **keys)).frame(camera)
