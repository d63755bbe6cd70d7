#!/usr/bin/env python3
"""The peer scene of granular-infer in LIGGGHTS and LAMMPS: writes their inputs, and runs those that are installed.

    benches/peers/grains.py [FOLDER] [--seeds 3] [--step 5e-5]

2,000 grains of 4 mm, 1,300 kg/m3, E 5 MPa, nu 0.25, e 0.5, mu_s 0.5, mu_r 0.2 (times the radius), from a 45 degree cone with an outlet
of 14 mm radius, 12 cm above the ground; 2.5 s. Debian: apt install liggghts lammps. The same here:

    cargo test --release -p granular-infer --test peer -- --ignored --nocapture
"""

import argparse
import dataclasses
import math
import pathlib
import random
import resource
import shutil
import subprocess

OUTLET, TUBE = 0.014, 0.04
# Height in m over which rods are strewn: from higher up they would rain onto the heap.
FILL = 0.08
# An empty box of +-1 m makes the neighbour grids of both six times slower.
BOX = "-0.25 0.25 -0.25 0.25 -0.01 0.5"
# LIGGGHTS takes primes as seeds.
PRIMES = (32452867, 49979687, 49979693, 67867967, 67867979, 86028121, 86028157, 104395301)


@dataclasses.dataclass(frozen=True)
class Scene:
    """Grains and what happens to them, SI; as it stands here, the peer scene."""

    count: int = 2000
    radius: float = 2e-3
    density: float = 1300.0
    variation: float = 0.0
    height: float = 0.12
    duration: float = 2.5
    step: float = 5e-5
    modulus: float = 5e6
    friction: float = 0.5
    rolling: float = 0.2
    restitution: float = 0.5
    ground: float | None = None
    work_of_adhesion: float = 0.0
    drag: float = 0.0
    gravity: tuple = (0.0, 0.0, -9.81)
    clump: tuple = ()


def cone_stl(path, scene, rings=60):
    """The cone and 0.2 m of tube above it, as triangles."""
    top = scene.height + (TUBE - OUTLET)
    profile = [(OUTLET, scene.height), (TUBE, top), (TUBE, top + 0.2)]
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


def grains(path, scene, seed):
    """A loose fill of the tube, layer by layer, shaken a little; both programs read it."""
    dice = random.Random(seed)
    # Log-normal diameters of the stated mean, cut at three sigmas.
    s = math.sqrt(math.log1p(scene.variation**2))
    size = lambda: scene.radius * math.exp(s * max(-3.0, min(3.0, dice.gauss(0, 1))) - 0.5 * s * s)
    radii = [size() if s > 0 else scene.radius for _ in range(scene.count)]
    largest = max(radii)
    pitch = 2.4 * largest
    cells = [i * pitch for i in range(-20, 21)]
    layer = [(x, y) for x in cells for y in cells if math.hypot(x, y) < TUBE - 1.3 * largest]
    bottom = scene.height + TUBE - OUTLET + 2 * largest
    lines = ["grains", "", f"{scene.count} atoms", "3 atom types", ""]
    lines += ["%s %s %slo %shi" % (*BOX.split()[2 * k : 2 * k + 2], a, a) for k, a in enumerate("xyz")]
    lines += ["", "Atoms", ""]
    for k, radius in enumerate(radii):
        x, y = layer[k % len(layer)]
        place = [c + dice.uniform(-0.15, 0.15) * largest for c in (x, y, bottom + pitch * (k // len(layer)))]
        lines.append(f"{k + 1} 1 {2 * radius:.7g} {scene.density} %.6g %.6g %.6g" % tuple(place))
    path.write_text("\n".join(lines) + "\n")


def gravity(scene):
    size = math.hypot(*scene.gravity)
    return f"fix gravity all gravity {size} vector %.9g %.9g %.9g" % tuple(g / size for g in scene.gravity)


def air(scene):
    """Quadratic drag, -k m |v| v."""
    if scene.drag == 0.0:
        return ""
    force = lambda a: f"variable f{a} atom -{scene.drag}*mass*v{a}*sqrt(vx*vx+vy*vy+vz*vz)"
    return "\n".join([*map(force, "xyz"), "fix air all addforce v_fx v_fy v_fz"])


def clumps(scene, seed):
    """Rods, or any spheres, that LIGGGHTS strews into the tube by itself."""
    pathlib.Path(scene.clump[0]).write_text("".join("%.7g %.7g %.7g %.7g\n" % s for s in scene.clump[1]))
    bottom = scene.height + TUBE - OUTLET
    return f"""fix shape all particletemplate/multisphere 15485863 atom_type 1 density constant {scene.density} nspheres {len(scene.clump[1])} ntry 200000 spheres file {scene.clump[0]} scale 1.0 type 1
fix shapes all particledistribution/discrete 32452843 1 shape 1.0
region tube cylinder z 0 0 {TUBE} {bottom} {bottom + FILL} units box
fix fill all insert/pack seed {PRIMES[seed % len(PRIMES)]} distributiontemplate shapes insert_every once overlapcheck yes all_in yes orientation random particles_in_region {scene.count} region tube
fix move all multisphere"""


def adhesion_j_m3(scene):
    """The pull of LIGGGHTS's cohesion is this times the area of contact: as strong as 2 pi w R* at three grains' weight."""
    reduced, moduli = 0.5 * scene.radius, 0.5 * scene.modulus / (1 - 0.25**2)
    load = 3 * 9.81 * scene.density * 4 / 3 * math.pi * scene.radius**3
    overlap = (0.75 * load / (moduli * math.sqrt(reduced))) ** (2 / 3)
    return scene.work_of_adhesion / overlap


def pairs(own, ground, funnel):
    """A table over grains, ground and funnel, whose values matter against grains alone."""
    return f"{own} {ground} {funnel} {ground} {own} {own} {funnel} {own} {own}"


def liggghts(folder, scene, seed=0):
    friction = scene.friction
    ground = friction if scene.ground is None else scene.ground
    cohesion, density = "", adhesion_j_m3(scene)
    if density > 0.0:
        cohesion = "cohesion sjkr "
    law = f"hertz tangential history {cohesion}rolling_friction epsd2"
    if scene.clump:
        start = f"region box block {BOX} units box\ncreate_box 3 box"
        move = clumps(dataclasses.replace(scene, clump=(str(folder / "clump.txt"), scene.clump)), seed)
    else:
        start, move = "read_data grains.data", "fix move all nve/sphere"
    text = f"""atom_style granular
atom_modify map array
boundary f f f
newton off
units si
processors 1 1 1
{"soft_particles yes" if scene.modulus < 5e6 else ""}
communicate single vel yes
{start}
neighbor 0.001 bin
neigh_modify delay 0 binsize {max(0.005, 2 * scene.radius + 0.001)}
fix m1 all property/global youngsModulus peratomtype {3 * f"{scene.modulus} "}
fix m2 all property/global poissonsRatio peratomtype 0.25 0.25 0.25
fix m3 all property/global coefficientRestitution peratomtypepair 3 {9 * f"{scene.restitution} "}
fix m4 all property/global coefficientFriction peratomtypepair 3 {pairs(friction, ground, friction)}
fix m5 all property/global coefficientRollingFriction peratomtypepair 3 {9 * f"{scene.rolling} "}
fix m6 all property/global coefficientRollingViscousDamping peratomtypepair 3 {9 * "0.3 "}
{f"fix m7 all property/global cohesionEnergyDensity peratomtypepair 3 {pairs(density, density, 0.0)}" if cohesion else ""}
pair_style gran model {law}
pair_coeff * *
timestep {scene.step}
{gravity(scene)}
fix cone all mesh/surface file funnel.stl type 3
fix funnel all wall/gran model {law} mesh n_meshes 1 meshes cone
fix ground all wall/gran model {law} primitive type 2 zplane 0.0
{air(scene)}
{move}
thermo 10000
thermo_modify lost ignore norm no
run {round(scene.duration / scene.step)}
dump out all custom 1 end.txt id x y z radius
run 0
"""
    (folder / "in.liggghts").write_text(text)
    return ["-in", "in.liggghts"]


def lammps(folder, scene, seed=0):
    contact = f"hertz/material {scene.modulus} {scene.restitution} 0.25 tangential mindlin NULL 1.0 {scene.friction}"
    contact += f" rolling sds 100 0.04 {scene.rolling} damping tsuji"
    text = f"""atom_style sphere
boundary f f f
newton off
units si
comm_modify vel yes
read_data grains.data
neighbor 0.001 bin
neigh_modify delay 0 binsize 0.005
variable contact string "{contact}"
pair_style granular
pair_coeff * * ${{contact}}
timestep {scene.step}
{gravity(scene)}
region cone cone z 0 0 {OUTLET} {TUBE} {scene.height} {scene.height + TUBE - OUTLET} open 1 open 2 units box
region tube cylinder z 0 0 {TUBE} {scene.height + TUBE - OUTLET} 0.45 open 1 open 2 units box
fix cone all wall/gran/region granular ${{contact}} region cone
fix tube all wall/gran/region granular ${{contact}} region tube
fix ground all wall/gran granular ${{contact}} zplane 0.0 NULL
fix move all nve/sphere
thermo 10000
# A grain that rolls out of the box is no error.
thermo_modify lost ignore
run {round(scene.duration / scene.step)}
write_dump all custom end.txt id x y z radius
"""
    (folder / "in.lammps").write_text(text)
    return ["-in", "in.lammps", "-log", "none"]


PEERS = {"liggghts": (["liggghts"], liggghts), "lammps": (["lmp", "lmp_serial", "lammps"], lammps)}


def installed(name):
    """The path of a peer's program, or none."""
    return next((p for p in map(shutil.which, PEERS[name][0]) if p), None)


def pour(name, folder, scene, seed):
    """Writes a peer's input and runs it where it is installed: CPU s, or none."""
    folder.mkdir(parents=True, exist_ok=True)
    cone_stl(folder / "funnel.stl", scene)
    grains(folder / "grains.data", scene, seed)
    arguments = PEERS[name][1](folder, scene, seed)
    program = installed(name)
    if not program:
        return None
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    run = subprocess.run([program, *arguments], cwd=folder, capture_output=True, text=True)
    cpu = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    (folder / "out.txt").write_text(run.stdout + run.stderr)
    if run.returncode or not (folder / "end.txt").exists():
        raise RuntimeError(f"{name} failed, see {folder / 'out.txt'}")
    return cpu


def end(path):
    """Places and radii of the grains at the end, m."""
    rows = path.read_text().split("ITEM: ATOMS")[-1].splitlines()[1:]
    return [tuple(map(float, row.split()[1:5])) for row in rows if row.strip()]


def heap(places):
    """Mean distance from the axis and highest point of the grains, mm."""
    radius = sum(math.hypot(x, y) for x, y, *_ in places) / len(places)
    return 1e3 * radius, 1e3 * max(z + r for *_, z, r in places)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", default="peer-scene")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--step", type=float, default=5e-5)
    options = parser.parse_args()
    for name in PEERS:
        for seed in range(options.seeds):
            folder = (pathlib.Path(options.folder) / f"{name}-{seed}").resolve()
            try:
                cpu = pour(name, folder, Scene(step=options.step), seed)
            except RuntimeError as error:
                print(f"{name} {seed}: {error}")
                continue
            if cpu is None:
                print(f"{name} {seed}: not installed; its input is in {folder}")
                continue
            places = end(folder / "end.txt")
            radius, height = heap(places)
            print(f"{name} {seed}: {cpu:.1f} CPU s, {len(places)} grains, mean radius {radius:.1f} mm, height {height:.1f} mm")


if __name__ == "__main__":
    main()
