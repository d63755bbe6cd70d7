#!/usr/bin/env python3
"""Recordings of the domain grain-pour by another simulator, with a key: worlds on which the domain was not made.

    benches/peers/pours.py make FOLDER [--worlds NAME ...]     LIGGGHTS pours, a camera looks
    benches/peers/pours.py score FOLDER MISSING_PHYSICS        diagnoses each, and says how it did

Needs numpy. 16 worlds of four pours take some 10 CPU minutes. Debian: apt install liggghts.
"""

import argparse
import json
import math
import pathlib
import random
import struct
import subprocess
import sys
import time
import zlib

import numpy

import grains
from grains import Scene

HEIGHTS = (0.04, 0.06, 0.09, 0.12)
COUNT, RADIUS, DENSITY = 1000, 2e-3, 1300.0


def rod(aspect):
    """Spheres of a rod as heavy as a grain: x, y, z, radius."""
    # A capsule of length aspect x width; its spheres lie a third of a width apart.
    r = RADIUS * (2 / (3 * aspect - 1)) ** (1 / 3)
    half = (aspect - 1) * r
    n = 1 + math.ceil(2 * half / (0.67 * r))
    return tuple((0.0, 0.0, -half + 2 * half * k / (n - 1), r) for k in range(n))


def tilted(angle, azimuth):
    side, down = 9.81 * math.sin(angle), 9.81 * math.cos(angle)
    return (side * math.cos(azimuth), side * math.sin(azimuth), -down)


# Per world: what is concealed (of the scene; of the camera; the funnel's offset) and the key.
WORLDS = {
    "null-1": ({}, {}, []),
    "null-2": ({}, {}, []),
    "null-3": ({}, {}, []),
    "null-4": ({}, {}, []),
    "cohesion-1": ({"work_of_adhesion": 0.02}, {}, [("cohesion", {"work_of_adhesion_j_m2": 0.02})]),
    "cohesion-2": ({"work_of_adhesion": 0.08}, {}, [("cohesion", {"work_of_adhesion_j_m2": 0.08})]),
    "ground-1": ({"ground": 0.2}, {}, [("ground-friction", {"mu_ground": 0.2})]),
    "ground-2": ({"ground": 0.9}, {}, [("ground-friction", {"mu_ground": 0.9})]),
    "spread": ({"variation": 0.25}, {}, [("size-spread", {"coefficient_of_variation": 0.25})]),
    "tilt": ({"gravity": tilted(0.04, 2.2)}, {}, [("tilted-ground", {"angle_rad": 0.04})]),
    "rods": ({"clump": rod(1.8)}, {}, [("non-spherical-grains", {"aspect_ratio": 1.8})]),
    "funnel": ({}, {"funnel": 0.02}, [("funnel-offset", {"offset_m": 0.02})]),
    "blur": ({}, {"blur": 1.4}, [("depth-blur", {"sigma_px": 1.4})]),
    "offset": ({}, {"offset": -0.004}, [("depth-offset", {"offset_m": -0.004})]),
    "drag": ({"drag": 3.0}, {}, [("air-drag", {"k_per_m": 3.0})]),
    "tilt-blur": (
        {"gravity": tilted(0.05, -0.7)},
        {"blur": 1.2},
        [("tilted-ground", {"angle_rad": 0.05}), ("depth-blur", {"sigma_px": 1.2})],
    ),
    # The camera does not stand over the funnel: no mechanism of the list.
    "aside": ({}, {"aside": (0.012, 0.006)}, []),
}


def render(places, camera):
    """Depth of every pixel: the nearest sphere along its ray, or the ground."""
    n, f, c, h = camera["size"], camera["f"], camera["c"], camera["height"]
    depth = numpy.full((n, n), h)
    for x, y, z, r in places:
        below = h - z
        if below < 2 * r:
            continue
        reach = 1.1 * r / (below - r) * f + 1
        u, v = f * x / below + c, -f * y / below + c
        u0, u1 = max(0, int(u - reach)), min(n, int(u + reach) + 2)
        v0, v1 = max(0, int(v - reach)), min(n, int(v + reach) + 2)
        if u0 >= u1 or v0 >= v1:
            continue
        a, b = numpy.meshgrid((numpy.arange(u0, u1) - c) / f, -(numpy.arange(v0, v1) - c) / f)
        square, along = a * a + b * b + 1, a * x + b * y + below
        root = along**2 - square * (x * x + y * y + below**2 - r * r)
        t = numpy.where(root > 0, (along - numpy.sqrt(numpy.maximum(root, 0))) / square, h)
        patch = depth[v0:v1, u0:u1]
        numpy.minimum(patch, t, out=patch)
    return depth


def expose(depth, camera, dice):
    """Counts: blur, noise, pixels that are missing (more at edges), rounding."""
    if camera["blur"] > 0:
        reach = math.ceil(4 * camera["blur"])
        kernel = numpy.exp(-0.5 * (numpy.arange(-reach, reach + 1) / camera["blur"]) ** 2)
        kernel /= kernel.sum()
        for axis in (0, 1):
            wide = numpy.pad(depth, [(reach, reach) if a == axis else (0, 0) for a in (0, 1)], mode="edge")
            depth = numpy.apply_along_axis(lambda line: numpy.convolve(line, kernel, "valid"), axis, wide)
    step = numpy.zeros(depth.shape)
    step[:, 1:] = abs(numpy.diff(depth, axis=1))
    gone = dice.random(depth.shape) < 0.005 + 0.1 * (step > RADIUS)
    noisy = depth + camera["offset"] + camera["noise"] * dice.standard_normal(depth.shape)
    counts = numpy.rint(noisy / 1e-4).clip(1, 65535).astype(">u2")
    counts[gone] = 0
    return counts


def png(path, counts):
    """16-bit greyscale."""
    rows, columns = counts.shape
    raw = b"".join(b"\0" + row.tobytes() for row in counts)
    chunk = lambda name, data: struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    head = struct.pack(">IIBBBBB", columns, rows, 16, 0, 0, 0, 0)
    body = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + body)


def make(folder, name):
    """One world: pours, pictures, recording, key."""
    hidden, seen, mechanisms = WORLDS[name]
    dice = random.Random(f"grain-pour {name}")
    truth = {
        "friction": round(dice.uniform(0.35, 0.7), 3),
        "rolling": round(math.exp(dice.uniform(math.log(0.08), math.log(0.2))), 3),
        "restitution": round(dice.uniform(0.35, 0.65), 3),
    }
    camera = {
        "size": 240, "c": 119.5, "f": round(dice.uniform(230, 280), 2), "height": round(dice.uniform(0.33, 0.4), 3),
        "noise": dice.uniform(5e-4, 1e-3), "blur": 0.0, "offset": 0.0, "funnel": 0.0,
        "aside": (0.0, 0.0), **seen,
    }
    folder.mkdir(parents=True, exist_ok=True)
    rows, cpu = ["run,funnel_height_m,depth_image"], 0.0
    for run, height in enumerate(dice.sample(HEIGHTS, len(HEIGHTS)), start=1):
        scene = Scene(
            count=COUNT, height=height + camera["funnel"], duration=2.0, step=6e-5, modulus=1.5e6, **truth, **hidden
        )
        at = folder / "pours" / str(run)
        if not (at / "end.txt").exists():
            cpu += grains.pour("liggghts", at.resolve(), scene, dice.randrange(10**6)) or 0.0
        # The funnel is gone in the picture, and with it what stuck in it.
        x, y = camera["aside"]
        places = [(p[0] + x, p[1] + y, *p[2:]) for p in grains.end(at / "end.txt") if p[2] < scene.height]
        camera_dice = numpy.random.default_rng(dice.randrange(10**9))
        png(folder / f"pour-{run}.png", expose(render(places, camera), camera, camera_dice))
        rows.append(f"{run},{height:.3f},pour-{run}.png")
        print(f"{name} {run}: {len(places)} spheres, mean radius %.1f mm, height %.1f mm" % grains.heap(places), flush=True)
    (folder / "runs.csv").write_text("\n".join(rows) + "\n")
    mass = DENSITY * 4 / 3 * math.pi * RADIUS**3 * (1 + hidden.get("variation", 0.0) ** 2) ** 3
    (folder / "recording.toml").write_text(f"""format = 1
domain = "grain-pour"
data = "runs.csv"

[camera]
fx_px = {camera['f']}
fy_px = {camera['f']}
cx_px = {camera['c']}
cy_px = {camera['c']}
height_m = {camera['height']}
depth_unit_m = 0.0001

[rig]
grain_diameter_m = {2 * RADIUS}
grain_mass_kg = {mass:.4e}
grain_count = {COUNT}
funnel = {{ outlet_radius_m = {grains.OUTLET}, cone_half_angle_rad = {math.pi / 4:.4f}, tube_radius_m = {grains.TUBE} }}
""")
    key = {
        "accepted": [sorted(m for m, _ in mechanisms)],
        "kind": "unlisted" if name == "aside" else "listed" if mechanisms else "null",
        "mechanisms": [{"id": m, "parameters": p} for m, p in mechanisms],
        "truth": truth,
    }
    (folder / "key.json").write_text(json.dumps(key, indent=1) + "\n")
    print(f"{name}: {cpu:.0f} CPU s", flush=True)


def score(folder, program):
    """Diagnoses every world below a folder: verdict, names, strengths beside the key's."""
    tally = dict.fromkeys(["worlds", "false alarms", "named", "among the named", "wrong names", "missed"], 0)
    for at in sorted(p.parent for p in folder.glob("*/key.json")):
        key = json.loads((at / "key.json").read_text())
        begun = time.monotonic()
        subprocess.run([program, "diagnose", at, "--json", at / "answer.json", "--threads", "1"], check=True, capture_output=True)
        answer = json.loads((at / "answer.json").read_text())
        said = sorted(answer["chosen"])
        others = [sorted(s) for s in answer["confused_with"]]
        wanted = key["accepted"][0]
        alarm = answer["verdict"] != "adequate"
        listed = key["kind"] == "listed"
        tally["worlds"] += 1
        if key["kind"] == "null":
            outcome = "false alarms" if alarm else None
        elif said == wanted and alarm and (listed or answer["verdict"] == "unexplained"):
            outcome = "named"
        elif wanted in others:
            outcome = "among the named"
        else:
            outcome = "wrong names" if answer["verdict"] in ("explained", "ambiguous") or not listed and said else "missed"
        if outcome:
            tally[outcome] += 1
        values = []
        found = {p["name"]: p for m in answer["mechanisms"] for p in m["parameters"] if m["id"] in wanted}
        for mechanism in key["mechanisms"]:
            for name, value in mechanism["parameters"].items():
                if name in found:
                    low, high = found[name]["ci95"]
                    values.append(f"{name} {value:g}: {found[name]['value']:.4g} [{low:.4g}, {high:.4g}]")
        print(
            f"{at.name:12} {answer['verdict']:12} {'+'.join(said) or '-':32} p {answer['p_value']:<8.2g} "
            f"{outcome or 'right':16} {time.monotonic() - begun:4.0f} s  {'; '.join(values)}"
            + (f"  (or {', '.join('+'.join(o) for o in others)})" if others else ""),
            flush=True,
        )
    print(", ".join(f"{name} {count}" for name, count in tally.items()))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    making = commands.add_parser("make")
    making.add_argument("folder", type=pathlib.Path)
    making.add_argument("--worlds", nargs="*", default=list(WORLDS), choices=list(WORLDS))
    scoring = commands.add_parser("score")
    scoring.add_argument("folder", type=pathlib.Path)
    scoring.add_argument("program")
    options = parser.parse_args()
    if options.command == "score":
        return score(options.folder, options.program)
    for name in options.worlds:
        try:
            make(options.folder / name, name)
        except RuntimeError as error:
            print(f"{name}: {error}", file=sys.stderr)


if __name__ == "__main__":
    main()
