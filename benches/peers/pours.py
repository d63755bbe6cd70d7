#!/usr/bin/env python3
"""Recordings of the domain grain-pour by another simulator, with a key: worlds on which the domain was not made.

    benches/peers/pours.py make FOLDER [--seed 1] [--kinds NAME ...] [--count 1000]     LIGGGHTS pours, a camera looks
    benches/peers/pours.py score FOLDER MISSING_PHYSICS                                 diagnoses each, and says how it did

Needs numpy. A world of four pours takes some 35 CPU s (rods: 90). Debian: apt install liggghts.
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
RADIUS, DENSITY = 2e-3, 1300.0


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


def scene(**changes):
    """A mechanism of the scene alone."""
    return changes, {}


def camera(**changes):
    """One of the camera (or of where the funnel is said to stand) alone."""
    return {}, changes


def either(dice, low, high):
    return dice.choice((-1, 1)) * dice.uniform(low, high)


def cohesion(dice, truth):
    w = round(math.exp(dice.uniform(math.log(0.02), math.log(0.1))), 4)
    return *scene(work_of_adhesion=w), [("cohesion", {"work_of_adhesion_j_m2": w})]


def ground(dice, truth):
    mu = round(truth["friction"] * math.exp(either(dice, 0.6, 1.0)), 3)
    return *scene(ground=mu), [("ground-friction", {"mu_ground": mu})]


def spread(dice, truth):
    cv = round(dice.uniform(0.15, 0.3), 3)
    return *scene(variation=cv), [("size-spread", {"coefficient_of_variation": cv})]


def tilt(dice, truth):
    angle = round(dice.uniform(0.025, 0.06), 4)
    return *scene(gravity=tilted(angle, dice.uniform(-math.pi, math.pi))), [("tilted-ground", {"angle_rad": angle})]


def rods(dice, truth):
    aspect = round(dice.uniform(1.4, 2.2), 2)
    return *scene(clump=rod(aspect)), [("non-spherical-grains", {"aspect_ratio": aspect})]


def funnel(dice, truth):
    offset = round(either(dice, 0.01, 0.02), 4)
    # The lowest funnel still has to let the grains out.
    return *camera(funnel=max(offset, -0.012)), [("funnel-offset", {"offset_m": max(offset, -0.012)})]


def blur(dice, truth):
    sigma = round(dice.uniform(0.8, 2.0), 2)
    return *camera(blur=sigma), [("depth-blur", {"sigma_px": sigma})]


def offset(dice, truth):
    by = round(either(dice, 2e-3, 6e-3), 4)
    return *camera(offset=by), [("depth-offset", {"offset_m": by})]


def drag(dice, truth):
    k = round(dice.uniform(1.5, 5.0), 2)
    return *scene(drag=k), [("air-drag", {"k_per_m": k})]


def both(first, second):
    def world(dice, truth):
        (s1, c1, m1), (s2, c2, m2) = first(dice, truth), second(dice, truth)
        return {**s1, **s2}, {**c1, **c2}, m1 + m2

    return world


# What is concealed, of the scene and of the camera, and the key. The camera of `aside` does not stand over the funnel: no
# mechanism of the list.
KINDS = {
    "null": lambda dice, truth: ({}, {}, []),
    "cohesion": cohesion,
    "ground": ground,
    "spread": spread,
    "tilt": tilt,
    "rods": rods,
    "funnel": funnel,
    "blur": blur,
    "offset": offset,
    "drag": drag,
    "tilt-blur": both(tilt, blur),
    "cohesion-offset": both(cohesion, offset),
    "aside": lambda dice, truth: (*camera(aside=(0.012, 0.006)), []),
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


def make(folder, kind, seed, count):
    """One world: pours, pictures, recording, key."""
    name = f"{kind}-{seed}"
    folder = folder / name
    dice = random.Random(f"grain-pour {name}")
    truth = {
        "friction": round(dice.uniform(0.35, 0.7), 3),
        "rolling": round(math.exp(dice.uniform(math.log(0.08), math.log(0.2))), 3),
        "restitution": round(dice.uniform(0.35, 0.65), 3),
    }
    hidden, seen, mechanisms = KINDS[kind](dice, truth)
    camera = {
        "size": 240, "c": 119.5, "f": round(dice.uniform(230, 280), 2), "height": round(dice.uniform(0.33, 0.4), 3),
        "noise": dice.uniform(5e-4, 1e-3), "blur": 0.0, "offset": 0.0, "funnel": 0.0,
        "aside": (0.0, 0.0), **seen,
    }
    folder.mkdir(parents=True, exist_ok=True)
    rows, cpu = ["run,funnel_height_m,depth_image"], 0.0
    for run, height in enumerate(dice.sample(HEIGHTS, len(HEIGHTS)), start=1):
        scene = Scene(
            count=count, height=height + camera["funnel"], duration=2.0, step=6e-5, modulus=1.5e6, **truth, **hidden
        )
        at, fill = folder / "pours" / str(run), dice.randrange(10**6)
        if not (at / "end.txt").exists():
            cpu += grains.pour("liggghts", at.resolve(), scene, fill) or 0.0
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
grain_count = {count}
funnel = {{ outlet_radius_m = {grains.OUTLET}, cone_half_angle_rad = {math.pi / 4:.4f}, tube_radius_m = {grains.TUBE} }}
""")
    key = {
        "accepted": [sorted(m for m, _ in mechanisms)],
        "kind": "unlisted" if kind == "aside" else "listed" if mechanisms else "null",
        "mechanisms": [{"id": m, "parameters": p} for m, p in mechanisms],
        "truth": truth,
    }
    (folder / "key.json").write_text(json.dumps(key, indent=1) + "\n")
    print(f"{name}: {cpu:.0f} CPU s", flush=True)


def outcome(key, answer):
    """How an answer stands to the key."""
    said, wanted = sorted(answer["chosen"]), key["accepted"][0]
    alarm = answer["verdict"] != "adequate"
    if key["kind"] == "null":
        return "false alarm" if alarm else "right"
    if said == wanted and (key["kind"] == "listed" or answer["verdict"] == "unexplained"):
        return "right" if alarm else "missed"
    if wanted in map(sorted, answer["confused_with"]):
        return "among the named"
    return "wrong name" if said else "unexplained" if alarm else "missed"


def strengths(key, answer):
    """Hidden parameters beside what was found, and whether the interval holds them."""
    wanted = key["accepted"][0]
    found = {p["name"]: p for m in answer["mechanisms"] for p in m["parameters"] if m["id"] in wanted}
    for mechanism in key["mechanisms"]:
        for name, value in mechanism["parameters"].items():
            if name in found:
                low, high = found[name]["ci95"]
                yield f"{name} {value:g}: {found[name]['value']:.4g} [{low:.4g}, {high:.4g}]", low <= value <= high


def score(folder, program):
    """Diagnoses every world below a folder: verdict, names, strengths beside the key's; then mechanism by answer."""
    table, tally, held = {}, {}, []
    for at in sorted(p.parent for p in folder.glob("**/key.json")):
        key = json.loads((at / "key.json").read_text())
        begun = time.monotonic()
        command = [program, "diagnose", at, "--json", at / "answer.json", "--threads", "1"]
        subprocess.run(command, check=True, capture_output=True)
        answer = json.loads((at / "answer.json").read_text())
        said = "+".join(sorted(answer["chosen"])) or answer["verdict"]
        others = ["+".join(sorted(s)) for s in answer["confused_with"]]
        result = outcome(key, answer)
        hidden = "+".join(key["accepted"][0]) or ("nothing" if key["kind"] == "null" else "something unlisted")
        answers = table.setdefault(hidden, {})
        answers[said] = answers.get(said, 0) + 1
        tally[result] = tally.get(result, 0) + 1
        sizes = list(strengths(key, answer))
        if said == hidden:
            held += [holds for _, holds in sizes]
        print(
            f"{at.name:18} {answer['verdict']:12} {said:32} p {answer['p_value']:<8.2g} "
            f"{result:16} {time.monotonic() - begun:4.0f} s  {'; '.join(text for text, _ in sizes)}"
            + (f"  (or {', '.join(others)})" if others else ""),
            flush=True,
        )
    print("\n| hidden | worlds | answers |\n|---|---|---|")
    for hidden, answers in sorted(table.items()):
        each = ", ".join(f"{said} {n}" for said, n in sorted(answers.items(), key=lambda a: -a[1]))
        print(f"| {hidden} | {sum(answers.values())} | {each} |")
    print("\n" + ", ".join(f"{name} {count}" for name, count in sorted(tally.items())))
    print(f"{sum(held)} of {len(held)} intervals of what is named hold the key's")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    making = commands.add_parser("make")
    making.add_argument("folder", type=pathlib.Path)
    making.add_argument("--seed", type=int, default=1)
    making.add_argument("--kinds", nargs="*", default=list(KINDS), choices=list(KINDS))
    making.add_argument("--count", type=int, default=1000, help="grains: of others than 1000 the tool makes its own pours first")
    scoring = commands.add_parser("score")
    scoring.add_argument("folder", type=pathlib.Path)
    scoring.add_argument("program")
    options = parser.parse_args()
    if options.command == "score":
        return score(options.folder, options.program)
    if not grains.installed("liggghts"):
        sys.exit("liggghts is not installed: these worlds are poured by it (Debian: apt install liggghts)")
    for kind in options.kinds:
        try:
            make(options.folder, kind, options.seed, options.count)
        except RuntimeError as error:
            print(f"{kind}: {error}", file=sys.stderr)


if __name__ == "__main__":
    main()
