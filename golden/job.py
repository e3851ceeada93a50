"""From the common options of the command line to a scene, settings and one camera a frame."""

from __future__ import annotations

import argparse
from dataclasses import asdict, dataclass

import numpy as np

from golden import cameras, oracle, params, scene
from golden.cameras.camera import Camera, look_at
from golden.cameras.paths import KINDS
from golden.cameras.readers import RELATIVE, kind_of
from golden.errors import InputError
from golden.frame import SORTINGS, parse_sorting
from golden.preprocess import project
from golden.scene.gaussians import Gaussians
from golden.settings import Settings, parse


def add_common(parser: argparse.ArgumentParser, jobs: str = "threads (default: all cores)") -> None:
    """The options that every command with a scene and a path takes (design, section 7)."""
    parser.add_argument("scene", metavar="SCENE", help="file, folder, or builtin:NAME?n=..&seed=..")
    motion = parser.add_mutually_exclusive_group()
    motion.add_argument("--cameras", metavar="FILE", help="recorded: transforms.json, cameras.json, TUM, Record3D")
    motion.add_argument("--path", choices=KINDS, default="orbit", help="made camera path (default: %(default)s)")
    parser.add_argument("--camera", metavar="EX,EY,EZ/AX,AY,AZ/UX,UY,UZ/FOVY", help="where the path starts")
    parser.add_argument("--fps", type=float, default=30.0, help="frames a second (default: 30)")
    parser.add_argument("--speed", type=float, default=1.0, help="motion multiplied (default: 1)")
    parser.add_argument("--size", default="640x384", help="WxH, hd, fhd or qhd (default: %(default)s)")
    parser.add_argument("--frames", default="1", metavar="N|A:B", help="how many, or which (default: 1)")
    parser.add_argument("--effects", default="auto", help="auto; the effects planner is not there yet")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="see `splatcore info --keys`")
    parser.add_argument("--seed", type=int, default=0, help="of every random choice (default: 0)")
    parser.add_argument("--jobs", type=int, default=0, metavar="N", help=jobs)
    parser.add_argument(
        "--sorting", metavar="STRATEGY", help=f"of the tables: {SORTINGS} (default: reuse; gscore, gpu: full)"
    )
    parser.add_argument("-o", dest="out", metavar="DIR", help="folder for pictures and stats.json")


@dataclass(frozen=True)
class Job:
    """What a command works on."""

    gaussians: Gaussians
    settings: Settings
    frames: range
    cameras: list[Camera]  # one a frame
    head: dict  # the first fields of stats.json

    def truth(self, index: int) -> np.ndarray:
        """The oracle's picture of one frame, float64 [H, W, 3]."""
        camera = self.cameras[index]
        projection = project(self.gaussians, camera, self.settings.antialias_mode())
        return oracle.render(projection, camera, self.settings.background_colour())


def _start(args: argparse.Namespace, gaussians: Gaussians, width: int, height: int) -> tuple[Camera, tuple, tuple]:
    """(first camera, look-at point, up)."""
    view = cameras.parse_camera(args.camera) if args.camera else cameras.default_view(gaussians)
    eye, at, up, fovy = view
    return look_at(eye, at, up, fovy, width, height), at, up


def prepare(args: argparse.Namespace) -> Job:
    """Check every option and load the scene; InputError before any work is done."""
    settings = parse(args.set)
    width, height = cameras.parse_size(args.size)
    frames = cameras.parse_frames(args.frames)
    if args.effects != "auto":
        raise InputError(f"--effects {args.effects}: only auto is known")
    args.sorting = args.sorting or "reuse"
    parse_sorting(args.sorting)
    if args.jobs < 0:
        raise InputError(f"--jobs {args.jobs}: wants 0 (all cores) or more")
    gaussians = scene.load(args.scene)
    if len(gaussians) > 1 << params.INDEX_W:
        raise InputError(f"{args.scene}: {len(gaussians)} Gaussians; a table entry counts to {1 << params.INDEX_W}")
    start, at, up = _start(args, gaussians, width, height)
    if args.cameras:
        track = cameras.read(args.cameras, width, height, frames, args.fps, args.speed)
        if kind_of(args.cameras) in RELATIVE:
            track = cameras.place(track, start, settings.motion_scale or cameras.scene_scale(gaussians) or 1.0)
    else:
        track = cameras.path(
            args.path, start, frames, args.fps, args.speed, at, cameras.scene_scale(gaussians), args.seed, up
        )
    head = {
        "scene": args.scene,
        "size": [width, height],
        "hardware": "neo",
        "sorting": args.sorting,
        "effects": None,
        "set": asdict(settings),
    }
    return Job(gaussians, settings, frames, track, head)
