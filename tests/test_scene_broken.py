"""Scene files that are broken, lie or unpack to too much: one line each, and no memory beyond the file's worth."""

import gzip
import io
import json
import tracemalloc
import zipfile

import numpy as np
import pytest
from PIL import Image

from golden import scene
from golden.errors import InputError
from tests.scene_files import (
    compressed_bytes,
    inria_columns,
    ply_bytes,
    refused,
    sog_files,
    splat_bytes,
    spz_bytes,
    streamed,
    truth,
    webp,
    write_folder,
    zipped,
)


def test_paths_that_are_no_scene(tmp_path):
    refused(tmp_path / "none.ply", "none.ply", "no such file")
    refused(tmp_path, str(tmp_path), "folder")
    (tmp_path / "a.ply").mkdir()
    refused(tmp_path / "a.ply", "folder")
    (tmp_path / "a.xyz").write_bytes(b"1")
    refused(tmp_path / "a.xyz", ".xyz", ".spz")
    refused("a\0b.ply")
    refused("x" * 5000)
    refused("")
    write_folder(tmp_path / "near", {"b.ply": b"ply"})
    refused(tmp_path / "near", "b.ply")


@pytest.mark.parametrize("name", ["a.ply", "a.compressed.ply", "a.splat", "a.spz", "a.sog"])
def test_empty_files(tmp_path, name):
    (tmp_path / name).write_bytes(b"")
    refused(tmp_path / name, name, "empty")


def test_mobilenerf_is_recognised_and_refused(tmp_path):
    folder = write_folder(tmp_path / "lego", {"shape0.obj": b"v 0 0 0", "mlp.json": b"{}"})
    for spec in (folder, folder / "shape0.obj", folder / "mlp.json"):
        refused(spec, "MobileNeRF", "polygons")


def test_headers_that_lie_do_not_allocate(tmp_path):
    """A billion rows in a file of a few bytes: refused without taking their memory."""
    columns = {k: v[:1] for k, v in inria_columns(truth()).items()}
    cases = {
        f"{order}.ply": ply_bytes(columns, order=o, claim=10**9) for order, o in (("l", "<"), ("b", ">"), ("t", "a"))
    }
    cases["huge.ply"] = ply_bytes(columns, claim=10**17)
    cases["a.spz"] = gzip.compress(spz_bytes(truth(n=1), 3, n=10**9))
    files = sog_files(truth(n=4))
    for count in (10**9, 10**7):
        meta = json.loads(files["meta.json"]) | dict(count=count)
        cases[f"{count}.sog"] = zipped(files | {"meta.json": json.dumps(meta).encode()})
    tracemalloc.start()
    for name, data in cases.items():
        (tmp_path / name).write_bytes(data)
        refused(tmp_path / name, name)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20e6, f"{peak} bytes"


def test_bombs_do_not_allocate(tmp_path):
    """Small files that unpack to a lot: a zip of zeros, a gzip of zeros, an image of 256 million pixels."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("meta.json", bytes(100_000_000))
    (tmp_path / "zip.sog").write_bytes(out.getvalue())
    zeros = truth(n=1)
    (tmp_path / "gzip.spz").write_bytes(gzip.compress(spz_bytes(zeros, 3) + bytes(40_000_000)))
    (tmp_path / "claim.spz").write_bytes(gzip.compress(spz_bytes(zeros, 3, n=5_000_000) + bytes(40_000_000)))
    size = (16383 - 1) | (16383 - 1) << 14
    flat = bytearray(sog_files(truth(n=4))["quats.webp"])
    flat[21:25] = (size | flat[24] >> 4 << 28).to_bytes(4, "little")
    (tmp_path / "image.sog").write_bytes(zipped(sog_files(truth(n=4)) | {"quats.webp": bytes(flat)}))
    tracemalloc.start()
    refused(tmp_path / "zip.sog", "unpack to 100000000")
    refused(tmp_path / "gzip.spz", "more than")
    refused(tmp_path / "claim.spz", "5000000")
    refused(tmp_path / "image.sog", "16383 x 16383")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20e6, f"{peak} bytes"


def test_images_of_one_colour_do_not_hold_a_million_gaussians(tmp_path):
    """Sizes that fit the count, but so few bytes that nothing can be in them: refused before they are decoded."""
    files = sog_files(truth(n=4))
    meta = json.loads(files["meta.json"]) | dict(count=1_000_000)
    flat = webp(np.full((1000, 1000, 4), 255, "u1"))
    (tmp_path / "a.sog").write_bytes(zipped({k: flat for k in files} | {"meta.json": json.dumps(meta).encode()}))
    tracemalloc.start()
    refused(tmp_path / "a.sog", "claims 1000000 Gaussians", "plausible")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2e6, f"{peak} bytes"


def test_ply_messages_name_line_property_and_count(tmp_path):
    columns = inria_columns(truth())
    good = ply_bytes(columns)
    packed = compressed_bytes(truth(), True, False).replace(b"element chunk 2", b"element chunk 1")
    one_chunk_less = packed[: -300 * 16 - 18 * 4] + packed[-300 * 16 :]
    path = tmp_path / "a.ply"
    for data, words in (
        (good[:-1], ("300 rows", "truncated")),
        (b"PLY" + good[3:], ("ply",)),
        (good[:60], ("end_header",)),
        (good.replace(b"element vertex 300", b"element vertex 299"), ("1 rows follow the 299",)),
        (ply_bytes(columns, order="a").replace(b"vertex 300", b"vertex 298"), ("2 rows follow the 298",)),
        (good.replace(b"element vertex 300", b"element vertex -3"), ("line 3", "-3")),
        (good.replace(b"element vertex 300", b"element vertex 3e2"), ("line 3", "3e2")),
        (good.replace(b"property float rot_2", b"property half rot_2"), ("half",)),
        (good.replace(b"property float rot_2", b"property list uchar float rot_2"), ("list",)),
        (good.replace(b"element vertex", b"element points"), ("vertex", "points")),
        (good.replace(b"binary_little_endian 1.0", b"binary_little_endian 9.0"), ("1.0",)),
        (ply_bytes({k: v for k, v in columns.items() if k != "rot_3"}), ("rot_3",)),
        (ply_bytes({k: v for k, v in inria_columns(truth(1)).items() if k != "f_rest_8"}), ("f_rest", "8 ")),
        (ply_bytes(columns, order="a").replace(b"\n-", b"\nx", 1), ("a.ply",)),
        (one_chunk_less, ("1 chunks for 300 rows", "2 are needed")),
    ):
        path.write_bytes(data)
        refused(path, "a.ply", *words)


@pytest.mark.filterwarnings("error")
def test_positions_at_the_end_of_float32(tmp_path):
    (tmp_path / "a.splat").write_bytes(splat_bytes(truth(n=2) | {"means": np.full((2, 3), 3.39e38)}))
    refused(tmp_path / "a.splat", "3.39e+38", "float32")


def test_splat_and_spz_messages(tmp_path):
    (tmp_path / "a.splat").write_bytes(splat_bytes(truth(n=3))[:-1])
    refused(tmp_path / "a.splat", "95 bytes", "32")
    path, t = tmp_path / "a.spz", truth(n=50)
    good = spz_bytes(t, 3)
    for data, words in (
        (gzip.compress(spz_bytes(t, 3, stated=4)), ("version", "4", "1 to 3")),
        (gzip.compress(spz_bytes(t, 3, degree=9)), ("shDegree", "9")),
        (gzip.compress(spz_bytes(t, 3, bits=77)), ("fractionalBits", "77")),
        (gzip.compress(spz_bytes(t, 3, flags=2)), ("flags", "extensions")),
        (gzip.compress(spz_bytes(t, 3, magic=b"XGSP")), ("NGSP",)),
        (gzip.compress(spz_bytes(t, 3, n=51)), ("51", "need")),
        (gzip.compress(spz_bytes(t, 3, n=49)), ("49", "more than")),
        (gzip.compress(good)[:-30], ("truncated",)),
        (gzip.compress(good[:10]), ("header",)),
        (good[:-1], ("stream",)),
        (b"\x1f\x8b" + bytes(40), ("gzip",)),
    ):
        path.write_bytes(data)
        refused(path, "a.spz", *words)


def test_sog_messages(tmp_path):
    t = truth(1, 50)
    files = sog_files(t, 2, 1)
    meta = json.loads(files["meta.json"])
    tiny = webp(np.zeros((2, 2, 4), "u1"))

    def changed(*keys, to=None) -> dict[str, bytes]:
        copy = json.loads(files["meta.json"])
        inner = copy
        for key in keys[:-1]:
            inner = inner[key]
        if to is None:
            del inner[keys[-1]]
        else:
            inner[keys[-1]] = to
        return files | {"meta.json": json.dumps(copy).encode()}

    assert meta["count"] == 50
    lossy = io.BytesIO()
    Image.fromarray(np.zeros((20, 20, 3), "u1")).save(lossy, "WEBP", quality=50)
    for case, words in (
        (changed("version", to=3), ("version", "3")),
        (changed("count"), ("count",)),
        (changed("count", to=-1), ("-1",)),
        (changed("count", to="many"), ("many",)),
        (changed("means"), ("means",)),
        (changed("means", "mins", to=[0, 1]), ("mins", "3 finite numbers")),
        (changed("means", "files", to=["means_l.webp"]), ("files",)),
        (changed("quats", "files", to=["../secret.webp"]), ("../secret.webp",)),
        (changed("sh0", "codebook", to=[0.0] * 255), ("codebook", "256")),
        (changed("scales", "codebook", to=[[]] * 256), ("codebook",)),
        (changed("shN", "bands", to=4), ("bands", "4")),
        (changed("shN", "files", to=[]), ("shN",)),
        ({k: v for k, v in files.items() if k != "quats.webp"}, ("quats.webp",)),
        ({k: v for k, v in files.items() if k != "meta.json"}, ("meta.json",)),
        (files | {"meta.json": b"{"}, ("line 1", "JSON")),
        (files | {"meta.json": b"[" * 100_000}, ("meta.json",)),
        (files | {"meta.json": b"\xff\xfe"}, ("UTF-8",)),
        (files | {"quats.webp": tiny}, ("quats.webp", "2 x 2", "50")),
        (files | {"quats.webp": b"GIF89a" * 9}, ("quats.webp", "WebP")),
        (files | {"quats.webp": files["quats.webp"][:40]}, ("quats.webp", "decoded")),
        (files | {"quats.webp": lossy.getvalue()}, ("quats.webp", "lossless")),
    ):
        (tmp_path / "a.sog").write_bytes(zipped(case))
        refused(tmp_path / "a.sog", "a.sog", *words)
    (tmp_path / "a.sog").write_bytes(zipped(files)[:-40])
    refused(tmp_path / "a.sog", "zip")


def test_any_bytes_end_in_a_scene_or_one_line(tmp_path):
    """Truncations, byte flips, noise of every format: an InputError or Gaussians that are all finite."""
    rng = np.random.default_rng(0)
    t = truth(1, 40)
    sog = sog_files(t, 2, 1)
    seeds = {
        "a.ply": ply_bytes(inria_columns(t)),
        "b.ply": ply_bytes(inria_columns(t), order="a"),
        "c.compressed.ply": compressed_bytes(t, True, True),
        "d.splat": splat_bytes(t),
        "e.spz": gzip.compress(spz_bytes(t, 3)),
        "f.spz": spz_bytes(t, 2),
        "g.sog": zipped(sog),
    }
    streamed(tmp_path / "s", {0: [t]})
    places = {name: tmp_path / name for name in seeds}
    for name in ("meta.json", "quats.webp"):
        seeds[name], places[name] = sog[name], write_folder(tmp_path / name[:2], sog) / name
    seeds["lod"], places["lod"] = (tmp_path / "s" / "lod-meta.json").read_bytes(), tmp_path / "s" / "lod-meta.json"
    for name, good in seeds.items():
        spec = places[name].parent / "meta.json" if name == "quats.webp" else places[name]
        for trial in range(200):
            data = bytearray(good)
            if trial % 3 == 0:
                data = data[: rng.integers(1, len(data))]
            else:
                reach = len(data) if trial % 3 == 1 else min(len(data), 400)  # the whole file, or its head
                for _ in range(rng.integers(1, 6)):
                    data[rng.integers(reach)] = rng.integers(256)
            places[name].write_bytes(bytes(data))
            try:
                g = scene.load(str(spec))
            except InputError as error:
                assert "\n" not in str(error) and len(str(error)) < 1000
            else:
                assert all(np.isfinite(a).all() for a in (g.means, g.scales, g.quats, g.opacities, g.sh))
                assert (g.scales >= 0).all() and (np.abs(g.quats).max(axis=1, initial=0) > 0).all()
