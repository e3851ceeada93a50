"""Camera paths that need no file: orbit, dolly, pan, shake, static, cut. Frame f is at time f / fps times the speed."""

from __future__ import annotations

import dataclasses

import numpy as np

from golden.cameras.camera import Camera, about, unit
from golden.errors import InputError

KINDS = ("orbit", "dolly", "pan", "shake", "static", "cut")
TURN = np.radians(15)  # orbit and pan, radians a second
WALK = 0.5  # dolly, metres a second
CUT_ANGLE = np.radians(60)  # how far about the target a cut jumps
NOMINAL_DISTANCE = 3.0  # metres to the look-at point where the scene's own scale is not known
SHAKE_TONES = 8  # sines an axis, 0.4 to 3 Hz: a hand's tremor without the jitter of single frames
SHAKE_BAND = (0.4, 3.0)  # Hz
SHAKE_STEP = 1 / 30  # seconds, for which the root mean square steps below hold
SHAKE_SHIFT = 0.004  # metres
SHAKE_ANGLE = np.radians(0.5)


def path(
    kind: str,
    start: Camera,
    frames: range,
    fps: float,
    speed: float,
    target: np.ndarray,
    scale: float | None = None,
    seed: int = 0,
    up: np.ndarray | None = None,
) -> list[Camera]:
    """One camera a frame; frame 0 of every path is `start`, and `speed` multiplies the motion.

    `target` [3] is the look-at point, `scale` world units a metre (None: the target counts as 3 m away), `up` [3] what
    orbit, pan and cut turn about (None: the world axis nearest to the camera's upper edge; horizons stay level). A cut
    holds `start` for the first half of `frames` and a view 60 degrees about the target for the rest.
    """
    if kind not in KINDS:
        raise InputError(f"--path {kind}: unknown, there are {', '.join(KINDS)}")
    check_rate(fps, speed)
    target = np.asarray(target, np.float64)
    if scale is None:
        scale = float(np.linalg.norm(target - start.position)) / NOMINAL_DISTANCE or 1.0
    axis = nearest_axis(-start.rotation[1]) if up is None else unit(np.asarray(up, np.float64), "path: up is 0,0,0")
    middle = (frames.start + frames.stop + 1) // 2
    noise = shake_tones(seed)
    cameras = []
    for frame in frames:
        t = frame / fps * speed
        if kind == "orbit":
            camera = orbited(start, target, axis, TURN * t)
        elif kind == "dolly":
            camera = moved(start, start.position + WALK * scale * t * start.rotation[2], np.eye(3))
        elif kind == "pan":
            camera = moved(start, start.position, about(-axis, TURN * t))
        elif kind == "shake":
            camera = shaken(start, noise, t, scale)
        elif kind == "cut" and frame >= middle:
            camera = orbited(start, target, axis, CUT_ANGLE * speed)
        else:
            camera = start
        cameras.append(camera)
    return cameras


def check_rate(fps: float, speed: float) -> None:
    if not 0 < fps <= 1e6:
        raise InputError(f"--fps {fps:g}: a rate above 0 and up to 1e6 is needed")
    if not 0 <= speed <= 1e6:
        raise InputError(f"--speed {speed:g}: a factor from 0 to 1e6 is needed")


def moved(camera: Camera, position: np.ndarray, turn: np.ndarray) -> Camera:
    """The camera at another place, turned in the world by the rotation `turn` [3, 3]."""
    return dataclasses.replace(camera, position=position, rotation=camera.rotation @ turn.T)


def orbited(camera: Camera, target: np.ndarray, axis: np.ndarray, angle: float) -> Camera:
    """The camera carried by `angle` about an axis through the target."""
    turn = about(axis, angle)
    return moved(camera, target + turn @ (camera.position - target), turn)


def nearest_axis(v: np.ndarray) -> np.ndarray:
    """[3] the signed world axis nearest to a direction."""
    k = int(np.argmax(np.abs(v)))
    return np.sign(v[k]) * np.eye(3)[k]


def shake_tones(seed: int) -> np.ndarray:
    """[6, tones, 3] frequency (radians a second), phase and amplitude for three shifts and three angles.

    Amplitudes fall as 1 / frequency and are normed, so that the root mean square of an axis' change within
    SHAKE_STEP is 1 / sqrt(3): the step of the three axes together is then 1.
    """
    rng = np.random.Generator(np.random.PCG64(seed))
    low, high = np.log(SHAKE_BAND)
    omega = 2 * np.pi * np.exp(rng.uniform(low, high, (6, SHAKE_TONES)))
    phase = rng.uniform(0, 2 * np.pi, (6, SHAKE_TONES))
    amplitude = 1 / omega
    # a sine of amplitude A changes within h by 2 A sin(omega h / 2) times a sine: mean square 2 A^2 sin^2
    square = (2 * amplitude**2 * np.sin(omega * SHAKE_STEP / 2) ** 2).sum(axis=1, keepdims=True)
    return np.stack([omega, phase, amplitude / np.sqrt(3 * square)], axis=-1)


def shaken(camera: Camera, tones: np.ndarray, t: float, scale: float) -> Camera:
    omega, phase, amplitude = np.moveaxis(tones, -1, 0)
    wave = (amplitude * (np.sin(omega * t + phase) - np.sin(phase))).sum(axis=1)  # [6], zero at t = 0
    position = camera.position + camera.rotation.T @ (wave[:3] * SHAKE_SHIFT * scale)
    angles = wave[3:] * SHAKE_ANGLE
    size = float(np.linalg.norm(angles))
    if size == 0:
        return moved(camera, position, np.eye(3))
    return moved(camera, position, about(unit(camera.rotation.T @ angles, ""), size))
