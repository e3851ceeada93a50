"""What a reproduction runs on: scenes, motion, picture sizes, frames."""

from __future__ import annotations

import argparse
from dataclasses import asdict, dataclass
from pathlib import Path

from golden import cameras
from golden.errors import InputError

ROOT = Path(__file__).parents[3]
SHARED = ROOT.parent / "shared"  # captures and recorded motion, where they lie beside the project
MOTION = SHARED / "trajectories/record3d_dance_metadata.json"
START = 80  # frame of it from which it moves as it does on the whole; before, it hardly does. Divisible by each speed

# kind -> (capture in SHARED/scenes or None, built-in scene)
KINDS = {
    "indoor": (None, "builtin:room?n=400000"),
    "outdoor": ("ukstreet@lod=1", "builtin:street?n=400000"),
    "object": ("fox", "builtin:object?n=200000"),
    "aerial": (None, "builtin:aerial?n=400000"),
    "translucent": ("flowers_lod0", "builtin:translucent?n=200000"),
    "sparse": (None, "builtin:sparse?n=100000"),
}
LARGE = "ukstreet@lod=0", "builtin:aerial?n=1500000"
DETAIL = ("indoor", "outdoor", "translucent")  # figures with many configurations run on these
QUICK = {"sizes": "640x360", "frames": 2, "n": 20000}
FILES = {"fox": "fox/fox.ply"}  # where a capture is not a folder of its own name


@dataclass(frozen=True)
class Scene:
    name: str  # as the tables show it
    spec: str  # what `splatcore` takes


@dataclass(frozen=True)
class Case:
    """One accelerator on one sequence of frames; what a run is kept under."""

    scene: str  # name
    size: str
    frames: int
    hardware: str  # of golden.timing.hardware, or LISTS
    sorting: str | None = None
    keys: tuple[tuple[str, str], ...] = ()  # of the hardware
    settings: tuple[str, ...] = ()  # of the golden model, KEY=VALUE
    speed: float = 1.0
    quality: bool = False  # compare with the oracle

    @property
    def pictures(self) -> tuple:
        """Cases that are equal in this share their frames."""
        return self.scene, self.size, self.frames, self.settings, self.speed


LISTS = "lists"  # a "hardware" that measures how alike the lists of two frames are


@dataclass(frozen=True)
class Plan:
    scenes: tuple[Scene, ...]
    large: Scene
    sizes: tuple[str, ...]
    frames: int

    @property
    def top(self) -> str:
        """The size of figures that have only one: the largest."""
        return max(self.sizes, key=lambda size: cameras.parse_size(size)[0] * cameras.parse_size(size)[1])

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(scene.name for scene in self.scenes)

    @property
    def detail(self) -> tuple[str, ...]:
        """Scenes for figures with many configurations."""
        return tuple(n for n in self.names if n.split(" ")[0] in DETAIL) or self.names[:3]

    def case(self, scene: str, size: str, hardware: str, sorting: str | None = None, frames: int = 0, **more) -> Case:
        """more: fields of Case, or keys of the hardware."""
        own = {key: more.pop(key) for key in ("settings", "speed", "quality") if key in more}
        keys = tuple((key, str(value)) for key, value in more.items())
        return Case(scene, size, frames or self.frames, hardware, sorting, keys, **own)

    def spec(self, name: str) -> str:
        return next(scene.spec for scene in (*self.scenes, self.large) if scene.name == name)

    def describe(self) -> dict:
        """For the page: JSON without any path of this machine."""
        return {
            "scenes": [scene.name for scene in self.scenes],
            "large": self.large.name,
            "sizes": list(self.sizes),
            "frames": self.frames,
            "motion": motion_words(),
        }


def motion(frames: int, speed: float) -> dict[str, str]:
    """Options of the command line: the recorded hand-held path where there is one, else the made one."""
    if not MOTION.is_file():
        return {"path": "shake", "frames": str(frames)}
    first = round(START / speed)
    return {"cameras": str(MOTION), "frames": f"{first}:{first + frames}"}


def motion_words() -> str:
    return f"{MOTION.name} from frame {START}" if MOTION.is_file() else "--path shake"


def scene_of(kind: str, capture: str | None, builtin: str) -> Scene:
    """The capture when it lies beside the project, else the built-in scene; its name is "kind (which)"."""
    folder, _, level = (capture or "").partition("@")
    path = SHARED / "scenes" / FILES.get(folder, folder)
    if capture and path.exists():
        return Scene(f"{kind} ({capture})", f"{path}@{level}" if level else str(path))
    return Scene(f"{kind} ({builtin.removeprefix('builtin:')})", builtin)


def scene_list(text: str | None) -> tuple[Scene, ...]:
    """--scenes: kinds, or SCENEs as everywhere, with commas between; None: one of each kind."""
    scenes = []
    for word in (text or ",".join(KINDS)).split(","):
        if word in KINDS:
            scenes.append(scene_of(word, *KINDS[word]))
        elif word:
            scenes.append(Scene(Path(word).name if "/" in word else word, word))
    if not scenes or len({scene.name for scene in scenes}) < len(scenes):
        raise InputError(f"--scenes {text}: wants different ones of {', '.join(KINDS)} or SCENEs")
    return tuple(scenes)


def make(args: argparse.Namespace) -> Plan:
    """The plan that the command line asks for; InputError names what is wrong with it."""
    quick = QUICK if args.quick else {}
    frames = args.frames or quick.get("frames", 3)
    if frames < 2:
        raise InputError(f"--frames {frames}: wants 2 or more; the first one is sorted from scratch")
    sizes = tuple((args.sizes or quick.get("sizes", "hd,fhd,qhd")).split(","))
    for size in sizes:
        cameras.parse_size(size)
    if quick:
        made = {kind: f"{builtin.partition('=')[0]}={QUICK['n']}" for kind, (_, builtin) in KINDS.items()}
        scenes = scene_list(args.scenes) if args.scenes else tuple(scene_of(k, None, made[k]) for k in made)
        return Plan(scenes, scene_of("large", None, f"builtin:aerial?n={4 * QUICK['n']}"), sizes, frames)
    return Plan(scene_list(args.scenes), scene_of("large", *LARGE), sizes, frames)


def case_words(case: Case) -> dict:
    """A case as JSON, under which its run is kept."""
    return {**asdict(case), "motion": motion_words()}
