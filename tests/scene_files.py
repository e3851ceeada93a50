"""Encoders of every scene format, written for the tests alone, and the checks both reader tests share."""

import io
import json
import struct
import zipfile

import numpy as np
import pytest
from PIL import Image

from golden import scene
from golden.errors import InputError

N = 300  # more than one chunk of a compressed PLY
C0 = 0.28209479177387814


def truth(degree: int = 0, n: int = N, seed: int = 1) -> dict[str, np.ndarray]:
    """Random Gaussians in the units of golden.scene: what every encoder below starts from."""
    rng = np.random.default_rng(seed)
    quats = rng.normal(size=(n, 4))
    return dict(
        means=rng.uniform(-2, 2, (n, 3)),
        scales=np.exp(rng.uniform(-5, -1, (n, 3))),
        quats=quats / np.linalg.norm(quats, axis=1, keepdims=True),
        opacities=rng.uniform(0.02, 0.98, n),
        sh=rng.uniform(-0.9, 0.9, (n, (degree + 1) ** 2, 3)),
    )


def inria_columns(t: dict) -> dict[str, np.ndarray]:
    out = {axis: t["means"][:, k] for k, axis in enumerate("xyz")}
    out |= {f"f_dc_{c}": t["sh"][:, 0, c] for c in range(3)}
    rest = t["sh"].shape[1] - 1
    out |= {f"f_rest_{c * rest + k}": t["sh"][:, 1 + k, c] for c in range(3) for k in range(rest)}
    out["opacity"] = np.log(t["opacities"] / (1 - t["opacities"]))
    out |= {f"scale_{k}": np.log(t["scales"][:, k]) for k in range(3)}
    return out | {f"rot_{k}": t["quats"][:, k] for k in range(4)}


def ply_bytes(columns: dict, kind: str = "float", order: str = "<", comments=(), claim: int | None = None) -> bytes:
    rows = len(columns["x"])
    form = {"<": "binary_little_endian", ">": "binary_big_endian", "a": "ascii"}[order]
    head = ["ply", f"format {form} 1.0", *(f"comment {c}" for c in comments)]
    head += [f"element vertex {rows if claim is None else claim}", *(f"property {kind} {c}" for c in columns)]
    table = np.stack(list(columns.values()), axis=1)
    if order == "a":
        body = "".join(" ".join(f"{v:.9g}" for v in row) + "\n" for row in table).encode()
    else:
        body = table.astype(order + {"float": "f4", "double": "f8"}[kind]).tobytes()
    return ("\n".join([*head, "end_header"]) + "\n").encode() + body


def compressed_bytes(t: dict, boxed_colour: bool, rest: bool) -> bytes:
    n = len(t["means"])
    chunks = -(-n // 256)

    def box(values):
        parts = [values[256 * k : 256 * k + 256] for k in range(chunks)]
        return np.array([p.min(0) for p in parts]), np.array([p.max(0) for p in parts])

    def pack(values, low, high, widths):
        code, of = np.zeros(n, np.int64), np.arange(n) // 256
        for k, width in enumerate(widths):
            span = np.maximum(high[of, k] - low[of, k], 1e-12)
            code = (code << width) | np.rint((values[:, k] - low[of, k]) / span * ((1 << width) - 1)).astype(np.int64)
        return code

    low, high = box(t["means"])
    low_s, high_s = box(np.log(t["scales"]))
    rgb = t["sh"][:, 0] * C0 + 0.5
    low_c, high_c = box(rgb) if boxed_colour else (np.zeros((chunks, 3)), np.ones((chunks, 3)))
    rgba = np.concatenate([rgb, t["opacities"][:, None]], axis=1)
    low_a, high_a = (np.concatenate([v, np.full((chunks, 1), e)], axis=1) for v, e in ((low_c, 0), (high_c, 1)))
    rotation = np.zeros(n, np.int64)
    for i, q in enumerate(t["quats"]):
        k = int(np.argmax(np.abs(q)))
        rotation[i] = k
        for v in np.delete(q * np.sign(q[k]), k):
            rotation[i] = (rotation[i] << 10) | int(np.rint((v / np.sqrt(2) + 0.5) * 1023))
    words = [pack(t["means"], low, high, (11, 10, 11)), rotation]
    words += [pack(np.log(t["scales"]), low_s, high_s, (11, 10, 11)), pack(rgba, low_a, high_a, (8, 8, 8, 8))]
    names = [f"{e}_{a}" for e in ("min", "max") for a in "xyz"] + [
        f"{e}_scale_{a}" for e in ("min", "max") for a in "xyz"
    ]
    table = [low, high, low_s, high_s]
    if boxed_colour:
        names += [f"{e}_{a}" for e in ("min", "max") for a in "rgb"]
        table += [low_c, high_c]
    head = [
        "ply",
        "format binary_little_endian 1.0",
        f"element chunk {chunks}",
        *(f"property float {x}" for x in names),
    ]
    head += [f"element vertex {n}"]
    head += [f"property uint packed_{f}" for f in ("position", "rotation", "scale", "color")]
    body = np.concatenate(table, axis=1).astype("<f4").tobytes() + np.stack(words, axis=1).astype("<u4").tobytes()
    if rest:
        coefficients = t["sh"][:, 1:].transpose(0, 2, 1).reshape(n, -1)
        head += [f"element sh {n}", *(f"property uchar f_rest_{k}" for k in range(coefficients.shape[1]))]
        body += np.clip(np.floor((coefficients / 8 + 0.5) * 256), 0, 255).astype("u1").tobytes()
    return ("\n".join([*head, "end_header"]) + "\n").encode() + body


def splat_bytes(t: dict) -> bytes:
    rgba = np.concatenate([t["sh"][:, 0] * C0 + 0.5, t["opacities"][:, None]], axis=1)
    rows = b""
    for k in range(len(t["means"])):
        rows += struct.pack("<6f", *t["means"][k], *t["scales"][k])
        rows += bytes(round(255 * v) for v in rgba[k]) + bytes(
            int(np.clip(round(128 * v + 128), 0, 255)) for v in t["quats"][k]
        )
    return rows


def spz_bytes(t: dict, version: int, flags: int = 0, fraction: int = 12, **header) -> bytes:
    n, degree = len(t["means"]), int(np.sqrt(t["sh"].shape[1])) - 1
    field = dict(magic=b"NGSP", stated=version, n=n, degree=degree, bits=fraction) | header
    head = struct.pack(
        "<4sIIBBBB", field["magic"], field["stated"], field["n"], field["degree"], field["bits"], flags, 0
    )
    if version == 1:
        body = t["means"].astype("<f2").tobytes()
    else:
        fixed = np.rint(t["means"] * 2**fraction).astype("<i4")
        body = fixed.view("u1").reshape(n, 3, 4)[:, :, :3].tobytes()
    body += np.rint(255 * t["opacities"]).astype("u1").tobytes()
    body += np.clip(np.rint(255 * (0.15 * t["sh"][:, 0] + 0.5)), 0, 255).astype("u1").tobytes()
    body += np.rint(16 * (np.log(t["scales"]) + 10)).astype("u1").tobytes()
    for q in t["quats"]:
        xyzw = np.roll(q, -1)
        if version < 3:
            body += bytes(
                np.clip(np.rint((xyzw[:3] * (1 if xyzw[3] >= 0 else -1) + 1) * 127.5), 0, 255).astype(int).tolist()
            )
            continue
        k = int(np.argmax(np.abs(xyzw)))
        word = k
        for v in np.delete(xyzw * np.sign(xyzw[k]), k):
            word = word << 10 | (int(v < 0) << 9) | int(511 * abs(v) * np.sqrt(2) + 0.5)
        body += struct.pack("<I", word)
    return head + body + np.clip(np.rint(128 * t["sh"][:, 1:]) + 128, 0, 255).astype("u1").tobytes()


def webp(pixels: np.ndarray) -> bytes:
    out = io.BytesIO()
    Image.fromarray(pixels).save(out, "WEBP", lossless=True, exact=True)
    return out.getvalue()


def sog_files(t: dict, version: int = 2, degree: int = 0) -> dict[str, bytes]:
    """File name -> bytes of one SOG set; books are uniform, palettes hold one entry a Gaussian."""
    n = len(t["means"])
    width = 20
    height = -(-n // width)

    def picture(values: np.ndarray) -> bytes:
        pixels = np.zeros((height * width, 4), "u1")
        pixels[:, 3] = 255
        pixels[:n, : values.shape[1]] = values
        return webp(pixels.reshape(height, width, 4))

    def quantised(values: np.ndarray) -> tuple[list, np.ndarray]:
        book = np.linspace(values.min(), values.max(), 256)
        return book.tolist(), np.rint((values - book[0]) / (book[-1] - book[0]) * 255).astype(int)

    def spread(values: np.ndarray) -> tuple[dict, np.ndarray]:
        low, high = values.min(0), values.max(0)
        return dict(mins=low.tolist(), maxs=high.tolist()), np.rint((values - low) / (high - low) * 255).astype(int)

    logs = np.sign(t["means"]) * np.log1p(np.abs(t["means"]))
    low, high = logs.min(0), logs.max(0)
    code = np.rint((logs - low) / (high - low) * 65535).astype(int)
    quats = np.zeros((n, 4), int)
    for i, q in enumerate(t["quats"]):
        k = int(np.argmax(np.abs(q)))
        quats[i] = *np.rint((np.delete(q * np.sign(q[k]), k) / np.sqrt(2) + 0.5) * 255), 252 + k
    meta = dict(means=dict(mins=low.tolist(), maxs=high.tolist(), files=["means_l.webp", "means_u.webp"]))
    logit = np.log(t["opacities"] / (1 - t["opacities"]))[:, None]
    if version == 2:
        meta |= dict(version=2, count=n)
        book, scales = quantised(np.log(t["scales"]))
        meta["scales"] = dict(codebook=book, files=["scales.webp"])
        book, dc = quantised(t["sh"][:, 0])
        meta["sh0"] = dict(codebook=book, files=["sh0.webp"])
        colour = np.concatenate([dc, np.rint(255 * t["opacities"])[:, None]], axis=1)
    else:
        meta["means"]["shape"] = [n, 3]
        ends, scales = spread(np.log(t["scales"]))
        meta["scales"] = ends | dict(files=["scales.webp"])
        ends, colour = spread(np.concatenate([t["sh"][:, 0], logit], axis=1))
        meta["sh0"] = ends | dict(files=["sh0.webp"])
    meta["quats"] = dict(files=["quats.webp"])
    files = {"means_l.webp": picture(code & 255), "means_u.webp": picture(code >> 8)}
    files |= {"scales.webp": picture(scales), "quats.webp": picture(quats), "sh0.webp": picture(colour)}
    if degree:
        coefficients = (degree + 1) ** 2 - 1
        book, codes = quantised(t["sh"][:, 1:])
        labels = np.arange(n)[::-1]
        sheet = np.zeros((-(-n // 64) * 64, coefficients, 3), "u1")
        sheet[labels] = codes
        files["shN_centroids.webp"] = webp(sheet.reshape(-1, 64 * coefficients, 3))
        files["shN_labels.webp"] = picture(np.stack([labels & 255, labels >> 8], axis=1))
        names = ["shN_centroids.webp", "shN_labels.webp"]
        meta["shN"] = dict(files=names, codebook=book, bands=degree, count=n)
        if version == 1:
            meta["shN"] = dict(files=names, mins=book[0], maxs=book[-1])
    return files | {"meta.json": json.dumps(meta).encode()}


def zipped(files: dict[str, bytes], folder: str = "") -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, data in files.items():
            archive.writestr(folder + name, data)
    return out.getvalue()


def write_folder(folder, files: dict[str, bytes]):
    folder.mkdir(parents=True)
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return folder


def streamed(folder, levels: dict[int, list[dict]], environment=None) -> None:
    """Writes chunks `L_i` and a lod-meta.json whose tree has one leaf a chunk."""
    folder.mkdir()
    names, leaves = [], []
    for level, chunks in levels.items():
        for k, t in enumerate(chunks):
            write_folder(folder / f"{level}_{k}", sog_files(t, degree=int(np.sqrt(t["sh"].shape[1])) - 1))
            leaves.append({"bound": {}, "lods": {str(level): dict(file=len(names), offset=0, count=len(t["means"]))}})
            names.append(f"{level}_{k}/meta.json")
    top = dict(lodLevels=len(levels), environment=None, filenames=names, tree={"children": leaves})
    if environment:
        write_folder(folder / "env", sog_files(environment))
        top["environment"] = "env/meta.json"
    (folder / "lod-meta.json").write_text(json.dumps(top))


def load_bytes(tmp_path, name: str, data: bytes) -> scene.Gaussians:
    (tmp_path / name).write_bytes(data)
    return scene.load(str(tmp_path / name))


def refused(spec, *words: str) -> str:
    """The one-line message of the InputError, which names the file and holds the words."""
    with pytest.raises(InputError) as caught:
        scene.load(str(spec))
    text = str(caught.value)
    assert "\n" not in text and all(w in text for w in words), text
    return text
