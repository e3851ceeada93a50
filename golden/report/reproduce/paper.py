"""What the paper says, typed in once, each number with its place; and why ours may differ, in words.

Numbers are the paper's own (*Neo*, ASPLOS '26), or those of its public artifact where the place says so. Scenes are
theirs: six of Tanks and Temples, two of Mill 19 for Fig. 17(a). Nothing else in this package holds a result.
"""

from __future__ import annotations

from dataclasses import dataclass

FPS = "fps"
MS = "ms a frame"
GB = "GB in 60 frames"
LOSS = "loss at 28 dB, dB"
AREA = "area, mm2"
POWER = "power, mW"
NODE = "7 nm"
ENGINES = "sorting and rasterization engines"


@dataclass(frozen=True)
class Claim:
    """One number of the paper: of a mean over its scenes, unless the quantity says otherwise."""

    figure: str
    size: str
    hardware: str
    quantity: str
    value: float
    place: str
    relation: str = ""  # "<" or ">" where the paper gives a bound only


# Table 2: PSNR of (the original, Neo), dB against photographs
TABLE2 = {
    "Family": (28.2, 28.1),
    "Francis": (28.9, 28.9),
    "Horse": (28.0, 27.9),
    "Lighthouse": (26.0, 26.0),
    "Playground": (25.1, 25.0),
    "Train": (25.0, 24.9),
}
COUNT = 16  # of each unit
# Table 4: area in mm2 and power in mW of all COUNT units (7 nm, 1 GHz)
TABLE4 = {
    "Preprocessing Engine": (0.026, 194.9),
    "Merge Sort Unit+": (0.005, 12.4),
    "Bitonic Sort Unit": (0.008, 75.0),
    "Sorting Engine, buffers and others": (0.040, 71.6),
    "Sorting Engine": (0.053, 159.0),
    "Subtile Compute Unit": (0.228, 375.0),
    "Intersection Test Unit": (0.030, 58.7),
    "Rasterization Engine, buffers and others": (0.050, 10.2),
    "Rasterization Engine": (0.308, 443.9),
    "Total": (0.387, 797.8),
}
BOTH_ENGINES = tuple(map(sum, zip(TABLE4["Sorting Engine"], TABLE4["Rasterization Engine"])))  # mm2, mW
REPLAYED = tuple(TABLE4)[1:7]  # rows of Table 4 whose power `make power` tells
MAPPED = tuple(TABLE4)[1:9]  # and whose area `make synth` tells
GROUND_TRUTH_DB = 28.0  # a typical PSNR of Table 2, at which errors of ours are turned into its losses

CLAIMS = (
    Claim("fig3", "hd", "gscore, 4 cores", FPS, 66.7, "Section 3.1"),
    Claim("fig3", "fhd", "gscore, 4 cores", FPS, 31.1, "Section 3.1"),
    Claim("fig3", "qhd", "gscore, 4 cores", FPS, 15.8, "Section 3.1"),
    Claim("fig4", "qhd", "gscore, 4 cores, 51.2 GB/s", FPS, 15.8, "Section 3.1"),
    Claim("fig4", "qhd", "gscore, 16 cores, 51.2 GB/s", FPS, 17.9, "public artifact"),
    Claim("fig4", "qhd", "gscore, 16 cores, 204.8 GB/s", FPS, 60.0, "Section 3.2", ">"),
    Claim("fig4", "qhd", "gscore, 51.2 GB/s", "fps of 16 cores over 4", 1.12, "Section 3.2"),
    Claim("fig4", "qhd", "gscore, 16 cores", "fps at 204.8 over 51.2 GB/s", 3.83, "Section 3.2"),
    Claim("fig5", "hd", "gscore", GB, 44.2, "public artifact"),
    Claim("fig5", "fhd", "gscore", GB, 60.7, "Section 3.2"),
    Claim("fig5", "qhd", "gscore", GB, 80.0, "Section 3.2"),
    Claim("fig5", "qhd", "gscore", "sorting's share, %", 69.3, "Section 3.2"),
    Claim("fig5", "qhd", "gpu", "sorting's share, %", 90.8, "Section 3.2"),
    Claim("fig5", "qhd", "gscore", f"preprocess, {GB}", 16.0, "public artifact"),
    Claim("fig5", "qhd", "gscore", f"sorting, {GB}", 55.3, "public artifact"),
    Claim("fig5", "qhd", "gscore", f"raster, {GB}", 8.5, "public artifact"),
    Claim("fig6", "qhd", "64-pixel tiles", "% of tiles that keep more than 78 %", 90.0, "Section 3.3", ">"),
    Claim("fig7", "qhd", "64-pixel tiles", "places moved, 99th percentile", 31.0, "Section 3.3"),
    Claim("fig10", "qhd", "gpu, Neo in software", "less traffic, %", 70.4, "Section 4.5"),
    Claim("fig10", "qhd", "gpu, Neo in software", "less traffic of sorting, %", 82.8, "Section 4.5"),
    Claim("fig10", "qhd", "gpu, Neo in software", "speed-up", 1.1, "Section 4.5"),
    Claim("fig10", "qhd", "gpu, Neo in software", "speed-up of sorting", 1.54, "Section 4.5"),
    Claim("fig10", "qhd", "gpu", "raster's share of the time, %", 68.8, "Section 4.5"),
    Claim("fig15", "qhd", "neo", FPS, 99.3, "Section 6.2"),
    Claim("fig15", "hd", "gscore", FPS, 73.0, "public artifact"),
    Claim("fig15", "fhd", "gscore", FPS, 35.0, "public artifact"),
    Claim("fig15", "qhd", "gscore", FPS, 17.9, "public artifact"),
    Claim("fig15", "hd", "gscore", MS, 13.7, "public artifact"),
    Claim("fig15", "fhd", "gscore", MS, 28.5, "public artifact"),
    Claim("fig15", "qhd", "gscore", MS, 56.0, "public artifact"),
    Claim("fig15", "hd", "neo", "speed-up over gscore", 1.8, "Section 6.2"),
    Claim("fig15", "fhd", "neo", "speed-up over gscore", 3.3, "Section 6.2"),
    Claim("fig15", "qhd", "neo", "speed-up over gscore", 5.6, "Section 6.2"),
    Claim("fig15", "hd", "neo", "speed-up over gpu", 5.0, "Section 6.2"),
    Claim("fig15", "fhd", "neo", "speed-up over gpu", 7.2, "Section 6.2"),
    Claim("fig15", "qhd", "neo", "speed-up over gpu", 10.0, "Section 6.2"),
    Claim("fig16", "qhd", "gpu", GB, 346.5, "Section 6.2"),
    Claim("fig16", "qhd", "gscore", GB, 104.6, "Section 6.2"),
    Claim("fig16", "qhd", "neo", GB, 19.6, "Section 6.2"),
    Claim("fig16", "qhd", "neo", "less than gpu, %", 94.4, "Section 6.2"),
    Claim("fig16", "qhd", "neo", "less than gscore, %", 81.3, "Section 6.2"),
    Claim("fig17a", "qhd", "neo", FPS, 65.2, "Section 6.2"),
    Claim("fig17a", "qhd", "gscore", FPS, 24.9, "Section 6.2", "<"),
    Claim("fig17a", "qhd", "gpu", FPS, 13.6, "Section 6.2", "<"),
    *(Claim("fig17b", "qhd", "neo", f"fps at motion x{x}", 60.0, "Section 6.2", ">") for x in (2, 4, 8, 16)),
    Claim("fig18", "qhd", "neo-s", "speed-up over gscore", 3.3, "Section 6.3"),
    Claim("fig18", "qhd", "neo-s", "less traffic than gscore, %", 71.1, "Section 6.3"),
    Claim("fig18", "qhd", "neo", "speed-up over neo-s", 1.7, "Section 6.3"),
    Claim("fig18", "qhd", "neo", "less traffic than neo-s, %", 35.8, "Section 6.3"),
    Claim("fig18", "qhd", "neo-s", "more traffic than neo, %", 33.2, "Section 4.4: without deferred depth update"),
    Claim("fig19", "qhd", "periodic", "mean latency over reuse's", 1.0, "Section 6.3", "<"),
    Claim("fig19", "qhd", "periodic", "worst latency, ms", 16.6, "Section 6.3", ">"),
    Claim("fig19", "qhd", "background", "mean latency over reuse's", 1.0, "Section 6.3", ">"),
    Claim("fig19", "qhd", "hierarchical", "mean latency over reuse's", 1.0, "Section 6.3", ">"),
    Claim("table2", "qhd", "neo", f"{LOSS}, worst frame", max(a - b for a, b in TABLE2.values()), "Table 2, largest"),
    Claim("table3", NODE, ENGINES, AREA, BOTH_ENGINES[0], "Tables 3 and 4, without preprocessing"),
    Claim("table3", NODE, ENGINES, POWER, BOTH_ENGINES[1], "Tables 3 and 4, without preprocessing"),
    Claim("table3", NODE, ENGINES, "clock, MHz", 1000, "Table 3"),
    *(Claim("table4", NODE, name, AREA, TABLE4[name][0], "Table 4") for name in MAPPED),
    *(Claim("table4", NODE, name, POWER, TABLE4[name][1], "Table 4") for name in REPLAYED),
    Claim("accounting", "qhd", "neo", FPS, 99.3, "Section 6.2"),
    Claim("accounting", "qhd", "neo, none of these charged", FPS, 99.3, "Section 6.2"),
)

# One sentence a figure: why ours and theirs differ
WHY = {
    "fig3": "GSCore's frames a second are its bytes, and those follow the number of Gaussians in sight: our scenes are "
    "not theirs, our exact tile test lists fewer pairs than a 3-sigma box, and no simulator of GSCore is public.",
    "fig4": "Both are bound by memory at 51.2 GB/s; how much a core adds depends on how full its raster units are, "
    "which the paper's simulator counts without intersection tests or imbalance.",
    "fig5": "The paper's own Fig. 5 and Fig. 16 give GSCore two different totals for QHD, and its raster bytes do not "
    "change with the size of the picture; ours do, since more pixels mean more tiles for each Gaussian.",
    "fig6": "What a tile keeps follows how far the camera moves between two frames: ours is a hand-held phone at 30 "
    "frames a second, theirs each capture's own path; and large Gaussians stay longer than small ones.",
    "fig7": "A place is counted among the Gaussians that stay, since insertions move everybody behind them; long "
    "tables move further, and theirs are not published.",
    "fig10": "A roofline on bytes knows no irregular access and no idle lanes, which the paper names as what eats the "
    "gain, so it flatters the sorting stage.",
    "fig15": "Frames a second are bytes here as there (Fig. 16), and our scenes need fewer, GSCore's tables above all; "
    "where bytes are few, intersection tests, imbalance and projection bind Neo instead, which the paper's simulator "
    "does not charge (accounting), while our GSCore is given its hits and lists no more than the exact test does.",
    "fig16": "Most of the paper's reduction is the tile, 64 pixels against 16, and it grows with the tiles that a "
    "Gaussian touches; the same GSCore on 64-pixel tiles (gscore-64) shows what reuse itself saves.",
    "fig17a": "Another large scene, seen from another height: what counts is how many Gaussians are in sight.",
    "fig17b": "Faster motion brings more incoming entries; beyond a share of them a frame is sorted from scratch.",
    "fig18": "What a separate update pass costs depends on the records it fetches again; the paper gives two different "
    "numbers for it (a reduction in Section 6.3, an increase in Section 4.4).",
    "fig19": "The paper does not say how often periodic sorting sorts nor how late background sorting is; ours are in "
    "the names of the rows. Latencies below its limit are possible here since the scene differs.",
    "table2": "Ours is the distance to the exact float64 picture and no photograph, and the loss what that distance "
    "costs at a typical PSNR of the paper's table; it comes from keys one frame old, so it follows the motion.",
    "table3": "Ours is mapped by Yosys without wires, clock tree and preprocessing; a commercial flow gains 1.25 to "
    "1.6 times in area. Our power leaves out control and buffers of the raster core (docs/synthesis.md).",
    "table4": "As Table 3. Our ITUs share their set-up, so four are counted as one; the raster core's buffers hold the "
    "pixels of a whole tile in full precision. Power is that of units at work on tiles of one scene.",
    "beyond": "Not in the paper: what each option of this project changes on plain Neo, alone and all together.",
    "slices": "Not in the paper: a slice is four of each unit, and four slices are its machine. Areas are those of "
    "Table 4's two engines, ours with their memories (neo with `gs_raster_core`, splatcore with `gs_late_core`), "
    "the paper's 0.361 mm2, before gates of joined paths grow (0.4 %); memory bandwidth is the same for all.",
    "accounting": "The paper's public simulator charges nothing for these; each is switched off here in turn.",
    "summary": "Not in the paper: the numbers that README quotes, so that one command makes them.",
}


def find(figure: str, size: str, hardware: str, quantity: str) -> Claim | None:
    """The claim about one row; strategies are looked up without their number (periodic:6 is "periodic")."""
    key = (figure, size, hardware.partition(":")[0], quantity)
    for claim in CLAIMS:
        if (claim.figure, claim.size, claim.hardware, claim.quantity) == key:
            return claim
    return None
