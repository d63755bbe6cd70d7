//! Meshes against closed forms, against clipping triangle by triangle, and what is no mesh.
#![cfg(feature = "mesh")]
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use liquid_haptics::container::mesh::{MeshContainer, MeshError};
use liquid_haptics::container::{Container, Cylinder, up_at_tilt};
use nalgebra::{Isometry3, Point3, UnitVector3, Vector3};
use proptest::prelude::*;

type Mesh = (Vec<Point3<f64>>, Vec<[u32; 3]>);

fn cuboid(low: [f64; 3], high: [f64; 3]) -> Mesh {
    let pick = |k: usize, axis: usize| if k >> axis & 1 == 1 { high[axis] } else { low[axis] };
    let vertices = (0..8).map(|k| Point3::new(pick(k, 0), pick(k, 1), pick(k, 2))).collect();
    let quads: [[u32; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    (vertices, triangles)
}

fn together(parts: &[Mesh]) -> Mesh {
    let (mut vertices, mut triangles): Mesh = (Vec::new(), Vec::new());
    for (v, t) in parts {
        let first = vertices.len() as u32;
        vertices.extend(v);
        triangles.extend(t.iter().map(|t| t.map(|i| i + first)));
    }
    (vertices, triangles)
}

/// A profile of (radius, z), from the bottom's middle to the lid's, turned about the axis in `n` steps.
fn turned(profile: &[(f64, f64)], n: u32) -> Mesh {
    let (bottom, lid) = (profile[0].1, profile[profile.len() - 1].1);
    let rings = &profile[1..profile.len() - 1];
    let mut vertices = vec![Point3::new(0.0, 0.0, bottom), Point3::new(0.0, 0.0, lid)];
    for (radius, z) in rings {
        for k in 0..n {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(n)).sin_cos();
            vertices.push(Point3::new(radius * cos, radius * sin, *z));
        }
    }
    let at = |ring: u32, k: u32| 2 + ring * n + k % n;
    let mut triangles = Vec::new();
    for k in 0..n {
        triangles.push([0, at(0, k + 1), at(0, k)]);
        let last = rings.len() as u32 - 1;
        triangles.push([1, at(last, k), at(last, k + 1)]);
        for ring in 0..last {
            triangles.push([at(ring, k), at(ring, k + 1), at(ring + 1, k + 1)]);
            triangles.push([at(ring, k), at(ring + 1, k + 1), at(ring + 1, k)]);
        }
    }
    (vertices, triangles)
}

fn drum(radius: f64, length: f64, n: u32) -> MeshContainer {
    let (v, t) = turned(&[(0.0, 0.0), (radius, 0.0), (radius, length), (0.0, length)], n);
    MeshContainer::new(v, t).unwrap()
}

/// A ring-shaped pipe: concave, with a hole through it, like a hollow handle.
fn ring(n: u32, m: u32) -> MeshContainer {
    let (big, small) = (0.06, 0.02);
    let mut vertices = Vec::new();
    for i in 0..n {
        let (s, c) = (std::f64::consts::TAU * f64::from(i) / f64::from(n)).sin_cos();
        for j in 0..m {
            let (t, d) = (std::f64::consts::TAU * f64::from(j) / f64::from(m)).sin_cos();
            let r = big + small * d;
            vertices.push(Point3::new(r * c, small * t, r * s));
        }
    }
    let at = |i: u32, j: u32| (i % n) * m + j % m;
    let mut triangles = Vec::new();
    for i in 0..n {
        for j in 0..m {
            triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
        }
    }
    let mesh = MeshContainer::new(vertices.clone(), triangles.clone());
    mesh.unwrap_or_else(|_| {
        MeshContainer::new(vertices, triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect()).unwrap()
    })
}

/// Volume and centre of mass below a height by clipping every triangle: cones from a point on the level.
fn clipped(mesh: &MeshContainer, up: &Vector3<f64>, height: f64) -> (f64, Vector3<f64>) {
    let apex = up * height;
    let (mut volume, mut moment) = (0.0, Vector3::zeros());
    for t in mesh.triangles() {
        let corners = t.map(|i| mesh.vertices()[i as usize].coords);
        let mut polygon = Vec::new();
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            let (ha, hb) = (a.dot(up) - height, b.dot(up) - height);
            if ha <= 0.0 {
                polygon.push(a);
            }
            if (ha < 0.0 && hb > 0.0) || (ha > 0.0 && hb < 0.0) {
                polygon.push(a + (b - a) * (ha / (ha - hb)));
            }
        }
        for k in 1..polygon.len().max(2) - 1 {
            let (a, b, c) = (polygon[0] - apex, polygon[k] - apex, polygon[k + 1] - apex);
            let v = a.dot(&b.cross(&c)) / 6.0;
            volume += v;
            moment += ((a + b + c) / 4.0 + apex) * v;
        }
    }
    (volume, moment / volume)
}

#[test]
fn a_cube_is_a_cube() {
    let (v, t) = cuboid([0.0; 3], [1.0; 3]);
    let cube = MeshContainer::new(v, t).unwrap();
    assert!((cube.capacity_m3() - 1.0).abs() < 1e-15);
    let upright = cube.fill(&up_at_tilt(0.0), 0.25).unwrap();
    assert!((upright.surface_height_m - 0.25).abs() < 1e-14);
    assert!((upright.center_of_mass - Vector3::new(0.5, 0.5, 0.125)).norm() < 1e-14);
    // On an edge at 45 degrees: a prism of triangles; half full the surface is the diagonal.
    let up = up_at_tilt(std::f64::consts::FRAC_PI_4);
    let half = cube.fill(&up, 0.5).unwrap();
    assert!(half.surface_height_m.abs() < 1e-14);
    assert!((half.center_of_mass - Vector3::new(2.0 / 3.0, 0.5, 1.0 / 3.0)).norm() < 1e-14);
    let eighth = cube.fill(&up, 0.125).unwrap();
    assert!((eighth.center_of_mass - Vector3::new(5.0 / 6.0, 0.5, 1.0 / 6.0)).norm() < 1e-14);
    // Empty, full, and beyond.
    assert!((cube.fill(&up, 1.0).unwrap().center_of_mass - Vector3::repeat(0.5)).norm() < 1e-14);
    assert!(cube.fill(&up, 0.0).unwrap().center_of_mass.z.abs() < 1e-15);
    assert!(cube.fill(&up, 1.01).is_err() && cube.fill(&up, f64::NAN).is_err());
    assert_eq!(cube.volume_below(&up, -9.0).unwrap(), 0.0);
    assert!((cube.volume_below(&up, 9.0).unwrap() - 1.0).abs() < 1e-15);
}

/// With twice as many facets the error falls to a quarter.
#[test]
fn a_fine_drum_becomes_a_cylinder_with_the_second_order() {
    let exact = Cylinder::new(0.04, 0.15, 0.0).unwrap();
    for tilt in [0.3, 1.2, 1.57, 2.6] {
        let up = up_at_tilt(tilt);
        let error = |n: u32| {
            let mesh = drum(0.04, 0.15, n);
            // Compared at equal shares of the capacity.
            let share = 0.3;
            let (a, b) = (
                mesh.fill(&up, share * mesh.capacity_m3()).unwrap(),
                exact.fill(&up, share * exact.capacity_m3()).unwrap(),
            );
            (a.center_of_mass - b.center_of_mass).norm()
        };
        let errors = [error(24), error(48), error(96), error(192)];
        let orders: Vec<f64> = errors.windows(2).map(|w| (w[0] / w[1]).log2()).collect();
        println!("tilt {tilt}: errors {errors:.1?} m, orders {orders:.2?}");
        assert!(orders.iter().all(|o| (1.8..2.2).contains(o)), "{orders:?}");
        assert!(errors[3] < 1e-5);
    }
}

#[test]
fn several_cavities_and_holes_are_fine() {
    let (v, t) = together(&[cuboid([0.0; 3], [1.0; 3]), cuboid([2.0, 0.0, 0.5], [3.0, 1.0, 2.5])]);
    let two = MeshContainer::new(v, t).unwrap();
    // One level in both.
    let fill = two.fill(&up_at_tilt(0.0), 0.5 + 0.5).unwrap();
    assert!((fill.surface_height_m - 0.75).abs() < 1e-14);
    let ring = ring(64, 32);
    let half = ring.fill(&up_at_tilt(0.7), 0.5 * ring.capacity_m3()).unwrap();
    // By symmetry a half-full ring has its surface through its middle.
    assert!(half.surface_height_m.abs() < 1e-4, "{}", half.surface_height_m);
}

#[test]
fn what_is_no_cavity_is_refused_and_says_where() {
    let (v, t) = cuboid([0.0; 3], [1.0; 3]);
    let new = |v: &Vec<Point3<f64>>, t: Vec<[u32; 3]>| MeshContainer::new(v.clone(), t).unwrap_err();
    assert_eq!(new(&v, vec![]), MeshError::Empty);
    assert!(matches!(new(&v, t[1..].to_vec()), MeshError::Open { uses: 0 | 1, .. }));
    let mut one_turned = t.clone();
    one_turned[3].swap(0, 1);
    assert!(matches!(new(&v, one_turned), MeshError::Open { uses: 2, back: 0, .. }));
    let inside_out = t.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    assert!(
        matches!(new(&v, inside_out), MeshError::Inverted { volume_m3 } if (volume_m3 + 1.0).abs() < 1e-12)
    );
    let mut missing = t.clone();
    missing[2][1] = 99;
    assert!(matches!(new(&v, missing), MeshError::Index { triangle: 2, vertex: 99, vertices: 8 }));
    let mut bad = v.clone();
    bad[5].y = f64::NAN;
    assert_eq!(new(&bad, t.clone()), MeshError::NotFinite { vertex: 5 });
    let (v, t) = together(&[cuboid([0.0; 3], [1.0; 3]), cuboid([0.5, 0.25, 0.25], [1.5, 0.75, 0.75])]);
    let MeshError::SelfIntersecting { at, .. } = new(&v, t) else { panic!("expected a crossing") };
    assert!((at[0] - 1.0).abs() < 1e-9, "they cross in the face x = 1: {at:?}");
    // Touching at a face is no crossing.
    let (v, t) = together(&[cuboid([0.0; 3], [1.0; 3]), cuboid([1.0, 0.0, 0.0], [2.0, 1.0, 1.0])]);
    MeshContainer::new(v, t).unwrap();
}

#[test]
fn walls_move_every_face_inwards() {
    let (v, t) = cuboid([0.0; 3], [1.0, 2.0, 3.0]);
    let solid = MeshContainer::new(v, t).unwrap();
    let inner = solid.with_wall(0.1).unwrap();
    assert!((inner.capacity_m3() - 0.8 * 1.8 * 2.8).abs() < 1e-12);
    let (low, high) = inner.bounds();
    assert!(
        (low - Point3::new(0.1, 0.1, 0.1)).norm() < 1e-12
            && (high - Point3::new(0.9, 1.9, 2.9)).norm() < 1e-12
    );
    for wall_m in [0.5, 0.6, 5.0, -0.1, f64::NAN] {
        assert!(solid.with_wall(wall_m).is_err(), "{wall_m}");
    }
    // A drum: the facets move in by the thickness, so that the radius to their middles falls by it.
    let (outer, n) = (drum(0.04, 0.15, 60), 60.0);
    let radius = 0.04 * (std::f64::consts::PI / n).cos() - 0.002;
    let area = n * radius * radius * (std::f64::consts::PI / n).tan();
    assert!((outer.with_wall(0.002).unwrap().capacity_m3() - area * 0.146).abs() < 1e-9);
    assert!((outer.shell_center().z - 0.075).abs() < 1e-12);
}

fn stl_of(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = vec![0u8; 80];
    bytes.extend((mesh.1.len() as u32).to_le_bytes());
    for t in &mesh.1 {
        bytes.extend([0u8; 12]);
        for i in t {
            for x in mesh.0[*i as usize].coords.iter() {
                bytes.extend((*x as f32).to_le_bytes());
            }
        }
        bytes.extend([0u8; 2]);
    }
    bytes
}

#[test]
fn files_are_read_and_placed() {
    let cube = cuboid([0.0; 3], [10.0, 20.0, 40.0]);
    let bytes = stl_of(&cube);
    let place = Isometry3::translation(0.0, 0.0, 0.5);
    let mesh = MeshContainer::from_stl(&bytes, 1e-3, &place).unwrap();
    assert!((mesh.capacity_m3() - 8e-6).abs() < 1e-15);
    assert!((mesh.bounds().0.z - 0.5).abs() < 1e-12);
    let mut text = String::from("solid cube\n");
    let mut obj = String::from("# a cube\no cube\n");
    for t in &cube.1 {
        text += "facet normal 0 0 0\nouter loop\n";
        for i in t {
            let p = cube.0[*i as usize];
            text += &format!("vertex {} {} {}\n", p.x, p.y, p.z);
        }
        text += "endloop\nendfacet\n";
    }
    text += "endsolid cube\n";
    for p in &cube.0 {
        obj += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    // Quadrilaterals, as people write them.
    for q in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
        obj += &format!("f {} {} {} {}\n", q[0] + 1, q[1] + 1, q[2] + 1, q[3] + 1);
    }
    let one = Isometry3::identity();
    for mesh in [
        MeshContainer::from_stl(text.as_bytes(), 1e-3, &one).unwrap(),
        MeshContainer::from_obj(obj.as_bytes(), 1e-3, &one).unwrap(),
    ] {
        assert!((mesh.capacity_m3() - 8e-6).abs() < 1e-15);
    }
    assert!(MeshContainer::from_stl(&bytes, 0.0, &one).is_err());
}

#[test]
fn files_that_are_none_are_errors() {
    let one = Isometry3::identity();
    let bytes = stl_of(&cuboid([0.0; 3], [1.0; 3]));
    let mut lying = bytes.clone();
    lying[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    for bad in [&b""[..], b"solid", b"solid x\nfacet normal 0 0", &bytes[..200], &lying, &[0xff; 300]] {
        let error = MeshContainer::from_stl(bad, 1.0, &one).unwrap_err();
        assert!(!error.to_string().contains('\n'), "{error}");
    }
    for bad in
        [&b""[..], b"f 1 2 3\n", b"v 1 2\nf 1 1 1\n", b"v a b c\n", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"]
    {
        let error = MeshContainer::from_obj(bad, 1.0, &one).unwrap_err();
        assert!(!error.to_string().contains('\n'), "{error}");
    }
}

fn bottle() -> MeshContainer {
    let profile =
        [(0.0, 0.0), (0.03, 0.0), (0.035, 0.01), (0.035, 0.1), (0.015, 0.13), (0.018, 0.16), (0.0, 0.16)];
    let (v, t) = turned(&profile, 24);
    MeshContainer::new(v, t).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn the_plan_is_what_clipping_gives(
        x in -1.0f64..1.0, y in -1.0f64..1.0, z in -1.0f64..1.0, share in 0.0f64..1.0, which in 0..3usize, flat in 0..4usize
    ) {
        let mesh = [bottle(), ring(24, 12), drum(0.04, 0.15, 17)][which].clone();
        // Often along an axis, where whole faces are level.
        let up = match flat {
            0 => Vector3::ith((x.abs() * 2.99) as usize, z.signum()),
            _ => Vector3::new(x, y, z + 1e-9),
        };
        let up = UnitVector3::new_normalize(up);
        let plan = mesh.plan(&up);
        let capacity = mesh.capacity_m3();
        prop_assert!((plan.capacity_m3() / capacity - 1.0).abs() < 1e-12);
        let fill = plan.fill(share * capacity).unwrap();
        let (volume, center) = clipped(&mesh, &up, fill.surface_height_m);
        prop_assert!((volume - share * capacity).abs() < 1e-11 * capacity, "{} {}", volume, share * capacity);
        if share > 1e-3 {
            prop_assert!((center - fill.center_of_mass).norm() < 1e-10, "{center} {}", fill.center_of_mass);
        }
        prop_assert!(fill.center_of_mass.dot(&up) <= fill.surface_height_m + 1e-12);
        let back = plan.volume_below(fill.surface_height_m).unwrap();
        prop_assert!((back - share * capacity).abs() < 1e-12 * capacity);
        let more = plan.fill((share * 1.01).min(1.0) * capacity).unwrap();
        prop_assert!(more.surface_height_m >= fill.surface_height_m);
    }

    /// No bytes make it panic.
    #[test]
    fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400), solid in any::<bool>()) {
        let mut all = if solid { b"solid ".to_vec() } else { Vec::new() };
        all.extend(bytes);
        let _ = MeshContainer::from_stl(&all, 1.0, &Isometry3::identity());
        let _ = MeshContainer::from_obj(&all, 1.0, &Isometry3::identity());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// In a convex drum the centre of mass lies below the surface and inside; more liquid stands higher; what is full and what is
    /// empty balance; a mirrored tilt gives the mirror image.
    #[test]
    fn liquid_in_a_mesh_lies_where_liquid_lies(tilt in 0.0f64..3.1, share in 0.01f64..0.98, more in 0.001f64..0.02) {
        let drum = drum(0.04, 0.15, 24);
        let (up, capacity) = (up_at_tilt(tilt), drum.capacity_m3());
        let fill = drum.fill(&up, share * capacity).unwrap();
        let c = fill.center_of_mass;
        prop_assert!(c.dot(&up) <= fill.surface_height_m + 1e-12);
        prop_assert!(c.x.hypot(c.y) <= 0.04 && (0.0..=0.15).contains(&c.z));
        let fuller = drum.fill(&up, (share + more) * capacity).unwrap();
        prop_assert!(fuller.surface_height_m > fill.surface_height_m);
        // The air above is what is left of the whole, whose centre is the drum's.
        let down = UnitVector3::new_unchecked(-up.into_inner());
        let air = drum.fill(&down, (1.0 - share) * capacity).unwrap();
        let whole = c * share + air.center_of_mass * (1.0 - share);
        prop_assert!((whole - Vector3::new(0.0, 0.0, 0.075)).norm() < 1e-9, "{}", whole);
        prop_assert!((air.surface_height_m + fill.surface_height_m).abs() < 1e-9);
        let mirrored = drum.fill(&up_at_tilt(-tilt), share * capacity).unwrap().center_of_mass;
        prop_assert!((mirrored.x + c.x).abs() < 1e-9 && (mirrored.z - c.z).abs() < 1e-9);
    }
}
