#!/usr/bin/env python3
"""The peer scene of granular-infer in LIGGGHTS and LAMMPS: writes their inputs, and runs those that are installed.

    benches/peers/grains.py [FOLDER] [--seeds 3] [--step 5e-5]

2,000 grains of 4 mm, 1,300 kg/m3, E 5 MPa, nu 0.25, e 0.5, mu_s 0.5, mu_r 0.2 (times the radius), from a 45 degree cone with an outlet
of 14 mm radius, 12 cm above the ground; 2.5 s. Debian: apt install liggghts lammps. The same here:

    cargo test --release -p granular-infer --test peer -- --ignored --nocapture
"""

import argparse
import math
import pathlib
import random
import resource
import shutil
import subprocess

RADIUS, COUNT, DENSITY, HEIGHT = 2e-3, 2000, 1300.0, 0.12
OUTLET, TUBE, DURATION = 0.014, 0.04, 2.5
# An empty box of +-1 m makes the neighbour grids of both six times slower.
BOX = "-0.25 0.25 -0.25 0.25 -0.01 0.5"


def cone_stl(path, rings=60):
    """The cone and 0.2 m of tube above it, as triangles."""
    top = HEIGHT + (TUBE - OUTLET)
    profile = [(OUTLET, HEIGHT), (TUBE, top), (TUBE, top + 0.2)]
    lines = ["solid funnel"]
    for (r0, z0), (r1, z1) in zip(profile, profile[1:]):
        for k in range(rings):
            a, b = (2 * math.pi * i / rings for i in (k, k + 1))
            corner = lambda r, z, t: (r * math.cos(t), r * math.sin(t), z)
            p, q, r, s = corner(r0, z0, a), corner(r0, z0, b), corner(r1, z1, b), corner(r1, z1, a)
            for triangle in ((p, q, r), (p, r, s)):
                lines += ["facet normal 0 0 0", "outer loop"]
                lines += ["vertex %.7g %.7g %.7g" % v for v in triangle]
                lines += ["endloop", "endfacet"]
    path.write_text("\n".join(lines + ["endsolid funnel"]) + "\n")


def grains(path, seed):
    """A loose fill of the tube, layer by layer, shaken a little; both programs read it."""
    dice, pitch = random.Random(seed), 2.4 * RADIUS
    cells = [i * pitch for i in range(-20, 21)]
    layer = [(x, y) for x in cells for y in cells if math.hypot(x, y) < TUBE - 1.3 * RADIUS]
    bottom = HEIGHT + TUBE - OUTLET + 2 * RADIUS
    lines = ["grains", "", f"{COUNT} atoms", "1 atom types", ""]
    lines += ["%s %s %slo %shi" % (*BOX.split()[2 * k : 2 * k + 2], a, a) for k, a in enumerate("xyz")]
    lines += ["", "Atoms", ""]
    for k in range(COUNT):
        x, y = layer[k % len(layer)]
        place = [c + dice.uniform(-0.15, 0.15) * RADIUS for c in (x, y, bottom + pitch * (k // len(layer)))]
        lines.append(f"{k + 1} 1 {2 * RADIUS} {DENSITY} %.6g %.6g %.6g" % tuple(place))
    path.write_text("\n".join(lines) + "\n")


def liggghts(folder, step):
    text = f"""atom_style granular
boundary f f f
newton off
units si
processors 1 1 1
communicate single vel yes
read_data grains.data
neighbor 0.001 bin
neigh_modify delay 0 binsize 0.005
fix m1 all property/global youngsModulus peratomtype 5e6
fix m2 all property/global poissonsRatio peratomtype 0.25
fix m3 all property/global coefficientRestitution peratomtypepair 1 0.5
fix m4 all property/global coefficientFriction peratomtypepair 1 0.5
fix m5 all property/global coefficientRollingFriction peratomtypepair 1 0.2
fix m6 all property/global coefficientRollingViscousDamping peratomtypepair 1 0.3
pair_style gran model hertz tangential history rolling_friction epsd2
pair_coeff * *
timestep {step}
fix gravity all gravity 9.81 vector 0.0 0.0 -1.0
fix cone all mesh/surface file funnel.stl type 1
fix funnel all wall/gran model hertz tangential history rolling_friction epsd2 mesh n_meshes 1 meshes cone
fix ground all wall/gran model hertz tangential history rolling_friction epsd2 primitive type 1 zplane 0.0
fix move all nve/sphere
thermo 10000
run {round(DURATION / step)}
dump out all custom 1 end.txt id x y z
run 0
"""
    (folder / "in.liggghts").write_text(text)
    return ["in.liggghts"]


def lammps(folder, step):
    text = f"""atom_style sphere
boundary f f f
newton off
units si
comm_modify vel yes
read_data grains.data
neighbor 0.001 bin
neigh_modify delay 0 binsize 0.005
variable contact string "hertz/material 5e6 0.5 0.25 tangential mindlin NULL 1.0 0.5 rolling sds 100 0.04 0.2 damping tsuji"
pair_style granular
pair_coeff * * ${{contact}}
timestep {step}
fix gravity all gravity 9.81 vector 0 0 -1
region cone cone z 0 0 {OUTLET} {TUBE} {HEIGHT} {HEIGHT + TUBE - OUTLET} open 1 open 2 units box
region tube cylinder z 0 0 {TUBE} {HEIGHT + TUBE - OUTLET} 0.45 open 1 open 2 units box
fix cone all wall/gran/region granular ${{contact}} region cone
fix tube all wall/gran/region granular ${{contact}} region tube
fix ground all wall/gran granular ${{contact}} zplane 0.0 NULL
fix move all nve/sphere
thermo 10000
# A grain that rolls out of the box is no error.
thermo_modify lost ignore
run {round(DURATION / step)}
write_dump all custom end.txt id x y z
"""
    (folder / "in.lammps").write_text(text)
    return ["-in", "in.lammps", "-log", "none"]


def heap(path):
    """Mean distance from the axis and highest point of the grains, mm."""
    rows = path.read_text().split("ITEM: ATOMS")[-1].splitlines()[1:]
    places = [tuple(map(float, row.split()[1:4])) for row in rows if row.strip()]
    radius = sum(math.hypot(x, y) for x, y, _ in places) / len(places)
    return len(places), 1e3 * radius, 1e3 * (max(z for *_, z in places) + RADIUS)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", default="peer-scene")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--step", type=float, default=5e-5)
    options = parser.parse_args()
    peers = [("liggghts", ["liggghts"], liggghts), ("lammps", ["lmp", "lmp_serial", "lammps"], lammps)]
    for name, programs, write in peers:
        program = next((p for p in map(shutil.which, programs) if p), None)
        for seed in range(options.seeds):
            folder = pathlib.Path(options.folder) / f"{name}-{seed}"
            folder.mkdir(parents=True, exist_ok=True)
            cone_stl(folder / "funnel.stl")
            grains(folder / "grains.data", seed)
            arguments = write(folder, options.step)
            if not program:
                continue
            if name == "liggghts":
                arguments = ["-in", *arguments]
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            run = subprocess.run([program, *arguments], cwd=folder, capture_output=True, text=True)
            cpu = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
            (folder / "out.txt").write_text(run.stdout + run.stderr)
            if run.returncode or not (folder / "end.txt").exists():
                print(f"{name} {seed}: failed, see {folder / 'out.txt'}")
                continue
            count, radius, height = heap(folder / "end.txt")
            print(f"{name} {seed}: {cpu:.1f} CPU s, {count} grains, mean radius {radius:.1f} mm, height {height:.1f} mm")
        if not program:
            print(f"{name}: not installed; inputs are in {options.folder}")


if __name__ == "__main__":
    main()
