//! Meshes and walls that move, against planes, cones and closed forms.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use approx::assert_relative_eq;
use granular_infer::dem::{
    Coefficients, DemError, Law, Mesh, MeshError, Setup, Shape, Simulation, Wall, WallMotion, stable_step_s,
};

const R: f64 = 2e-3;
const DENSITY: f64 = 1300.0;
const G: f64 = 9.81;
const LAW: Law = Law::Hertz { modulus_pa: 5e6, poisson_ratio: 0.25 };

fn setup(shape: Shape, with: Coefficients, gravity_m_s2: [f64; 3]) -> Setup {
    Setup {
        law: LAW,
        density_kg_m3: DENSITY,
        grains: with,
        walls: vec![Wall { shape, coefficients: with }],
        gravity_m_s2,
        drag_per_m: 0.0,
        step_s: 0.5 * stable_step_s(&LAW, DENSITY, R, 1.0).unwrap(),
        fastest_m_s: 1.0,
    }
}

fn plane() -> Shape {
    Shape::Plane { point_m: [0.0; 3], normal: [0.0, 0.0, 1.0] }
}

/// A square of many triangles in the plane z = 0.
fn sheet() -> Mesh {
    let n = 12_usize;
    let vertices: Vec<[f64; 3]> = (0..=n * (n + 2))
        .map(|k| [0.05 * (k % (n + 1)) as f64 - 0.1, 0.05 * (k / (n + 1)) as f64 - 0.3, 0.0])
        .collect();
    let mut triangles = Vec::new();
    for i in 0..n {
        for j in 0..n {
            let a = j * (n + 1) + i;
            triangles.push([a, a + 1, a + n + 2]);
            triangles.push([a, a + n + 2, a + n + 1]);
        }
    }
    Mesh::new(&vertices, &triangles, 1).unwrap()
}

/// Sliding, rolling and crossing a dozen edges, a grain on a mesh does what it does on a plane.
#[test]
fn a_slope_of_triangles_is_a_plane() {
    for (mu, rolling, angle) in [(0.2, 0.0, 0.8_f64), (0.8, 0.1, 0.3)] {
        let with = Coefficients::dry(0.5, mu, rolling);
        let gravity = [G * angle.sin(), 0.02, -G * angle.cos()];
        let end = |shape: Shape| {
            let setup = setup(shape, with, gravity);
            let mut s = Simulation::new(&setup, &[R], &[[0.0, 0.0, 1.001 * R]]).unwrap();
            s.run((0.3 / setup.step_s) as u64).unwrap();
            (s.positions_m().next().unwrap(), s.spins_rad_s().next().unwrap())
        };
        let (on_plane, on_mesh) = (end(plane()), end(Shape::Mesh(sheet())));
        assert!(on_plane.0[0] > 0.06, "it crossed no edge");
        for k in 0..3 {
            assert_relative_eq!(on_plane.0[k], on_mesh.0[k], epsilon = 1e-9);
            assert_relative_eq!(on_plane.1[k], on_mesh.1[k], epsilon = 1e-5);
        }
    }
}

/// A cone of 400 pieces holds a grain where the smooth cone does, to a pixel of its facets.
#[test]
fn a_turned_mesh_is_its_frustum() {
    let with = Coefficients::dry(0.3, 0.5, 0.1);
    let frustum = Shape::Frustum {
        axis_m: [0.0; 2],
        bottom_m: 0.0,
        bottom_radius_m: 1e-3,
        top_radius_m: 0.041,
        half_angle_rad: std::f64::consts::FRAC_PI_4,
    };
    let mesh = Mesh::turned(&[[1e-3, 0.0], [0.041, 0.04]], 400).unwrap();
    let rests = |shape: Shape| {
        let setup = setup(shape, with, [0.0, 0.0, -G]);
        let mut s = Simulation::new(&setup, &[R], &[[0.01, 0.0, 0.02]]).unwrap();
        s.run((1.0 / setup.step_s) as u64).unwrap();
        s.positions_m().next().unwrap()
    };
    let (a, b) = (rests(frustum), rests(Shape::Mesh(mesh)));
    // It lies in the outlet, which is narrower than itself, touching all around.
    assert!(a[2] < 3e-3 && (a[2] - b[2]).abs() < 1e-5, "{a:?} and {b:?}");
}

#[test]
fn meshes_with_holes_are_refused() {
    let bowl = [[0.0, 0.0], [0.02, 2e-3], [0.03, 0.01], [0.04, 0.02]];
    assert!(Mesh::turned(&bowl, 24).is_ok());
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (k, [r, z]) in bowl.iter().enumerate() {
        for a in 0..24_usize {
            let (s, c) = (std::f64::consts::TAU * a as f64 / 24.0).sin_cos();
            vertices.push([r * c, r * s, *z]);
            if k > 0 {
                let (i, j) = ((k - 1) * 24 + a, (k - 1) * 24 + (a + 1) % 24);
                triangles.push([i, j, j + 24]);
                triangles.push([i, j + 24, i + 24]);
            }
        }
    }
    assert!(Mesh::new(&vertices, &triangles, 1).is_ok());
    // A triangle that meets the rim in a corner, or one lower down, is missing.
    let mut cornered = triangles.clone();
    cornered.remove(4 * 24 + 10);
    assert!(matches!(Mesh::new(&vertices, &cornered, 1), Err(MeshError::Openings { found: 2, .. })));
    triangles.remove(2 * 24 + 11);
    let refused = Mesh::new(&vertices, &triangles, 1).unwrap_err();
    let MeshError::Openings { expected: 1, found: 2, width_m, .. } = refused else {
        unreachable!("{refused}")
    };
    assert!(width_m > 4e-3 && width_m < 0.03, "{width_m}");
    assert!(matches!(Mesh::new(&vertices, &[[0, 1, 99]], 1), Err(MeshError::Index { vertex: 99, .. })));
    assert_eq!(Mesh::new(&[], &[], 0), Err(MeshError::Empty));
    vertices[3][1] = f64::NAN;
    assert_eq!(Mesh::new(&vertices, &triangles, 1), Err(MeshError::NotFinite { vertex: 3 }));
    assert!(matches!(Mesh::from_stl(b"not a mesh at all", 1.0, 0), Err(MeshError::Stl { .. })));
}

/// A tetrahedron in ASCII, in mm.
#[test]
fn stl_is_read() {
    let corner = ["0 0 0", "10 0 0", "0 10 0", "0 0 10"];
    let mut text = String::from("solid t\n");
    for [a, b, c] in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] {
        text += "facet normal 0 0 0\nouter loop\n";
        for v in [a, b, c] {
            text += &format!("vertex {}\n", corner[v]);
        }
        text += "endloop\nendfacet\n";
    }
    text += "endsolid t\n";
    assert!(Mesh::from_stl(text.as_bytes(), 1e-3, 0).is_ok());
    assert!(matches!(
        Mesh::from_stl(text.as_bytes(), 1e-3, 1),
        Err(MeshError::Openings { expected: 1, found: 0, .. })
    ));
}

/// A belt: the grain is dragged with mu g until it slides no more; then the belt's surface and its own agree. It started at
/// rest, so that it ends with 2/7 of the belt's speed.
#[test]
fn a_moving_plane_drags_a_grain() {
    let (mu, belt) = (0.3, 0.5);
    let setup = setup(plane(), Coefficients::dry(0.5, mu, 0.0), [0.0, 0.0, -G]);
    let mut s = Simulation::new(&setup, &[R], &[[0.0, 0.0, R]]).unwrap();
    s.run((0.1 / setup.step_s) as u64).unwrap();
    s.move_wall(0, WallMotion { velocity_m_s: [belt, 0.0, 0.0], ..WallMotion::default() }).unwrap();
    s.run((0.02 / setup.step_s) as u64).unwrap();
    assert_relative_eq!(s.velocities_m_s().next().unwrap()[0], mu * G * 0.02, max_relative = 0.01);
    s.run((0.5 / setup.step_s) as u64).unwrap();
    let (v, w) = (s.velocities_m_s().next().unwrap()[0], s.spins_rad_s().next().unwrap()[1]);
    assert_relative_eq!(v, 2.0 / 7.0 * belt, max_relative = 3e-3);
    assert_relative_eq!(v - w * R, belt, max_relative = 3e-3);
    let fast = WallMotion { velocity_m_s: [1.5, 0.0, 0.0], ..WallMotion::default() };
    assert!(matches!(s.move_wall(0, fast), Err(DemError::OutOfRange { .. })));
    assert!(matches!(s.move_wall(9, WallMotion::default()), Err(DemError::Index { received: 9, .. })));
}

/// A bowl lifted, turned slowly about a pivot beside it and stopped: the grain in it lies at its new lowest point.
#[test]
fn a_bowl_carries_its_grain() {
    let with = Coefficients::dry(0.3, 0.6, 0.05);
    // A piece of a sphere of 30 mm: its lowest point stays under its centre, however it is turned.
    let profile: Vec<[f64; 2]> = (0..=20)
        .map(|k| {
            let (s, c) = (0.06 * f64::from(k)).sin_cos();
            [0.03 * s, 0.03 * (1.0 - c)]
        })
        .collect();
    let setup = setup(Shape::Mesh(Mesh::turned(&profile, 60).unwrap()), with, [0.0, 0.0, -G]);
    let mut s = Simulation::new(&setup, &[R], &[[0.0, 0.0, R]]).unwrap();
    let about_m = [0.05, 0.0, 0.0];
    s.move_wall(0, WallMotion { velocity_m_s: [0.0, 0.0, 0.1], spin_rad_s: [0.0, 0.4, 0.0], about_m })
        .unwrap();
    s.run((0.5 / setup.step_s) as u64).unwrap();
    let t = s.time_s();
    s.move_wall(0, WallMotion::default()).unwrap();
    s.run((1.0 / setup.step_s) as u64).unwrap();
    // The sphere's centre starts at (0, 0, 30 mm), the pivot rises.
    let (sine, cosine) = (0.4 * t).sin_cos();
    let centre = [0.05 - 0.05 * cosine + 0.03 * sine, 0.05 * sine + 0.03 * cosine + 0.1 * t];
    let p = s.positions_m().next().unwrap();
    assert_relative_eq!(p[2], centre[1] - 0.03 + R, epsilon = 2e-4);
    // mu_r = 0.05 lets it stand up to 0.05 of the slope beside the lowest point, facets aside.
    assert!((p[0] - centre[0]).abs() < 0.06 * 0.03 + 1e-3 && p[1].abs() < 2e-3, "{p:?} {centre:?}");
}
