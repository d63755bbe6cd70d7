//! Vertices and triangles from the bytes of a file.

use std::io::Cursor;

use nalgebra::Point3;

use super::MeshError;

type Mesh = (Vec<Point3<f64>>, Vec<[u32; 3]>);

fn wrong(format: &'static str, why: impl Into<String>) -> MeshError {
    MeshError::Parse { format, why: why.into() }
}

/// STL, binary or ASCII; equal vertices become one.
pub(super) fn stl(bytes: &[u8]) -> Result<Mesh, MeshError> {
    let ascii = bytes.starts_with(b"solid") && bytes.iter().take(4096).all(|b| b.is_ascii());
    if !ascii {
        // A binary file says how many triangles it has: believe it only where as many bytes follow.
        let Some(count) = bytes.get(80..84) else {
            return Err(wrong("STL", format!("{} bytes, expected at least 84", bytes.len())));
        };
        let count = u32::from_le_bytes([count[0], count[1], count[2], count[3]]) as usize;
        let expected = count.saturating_mul(50).saturating_add(84);
        if bytes.len() < expected {
            let why = format!("{} bytes, expected {expected} for {count} triangles", bytes.len());
            return Err(wrong("STL", why));
        }
    }
    let mesh =
        stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|e| wrong("STL", one_line(&e.to_string())))?;
    let vertices: Vec<Point3<f64>> = mesh
        .vertices
        .iter()
        .map(|v| {
            let v: [f32; 3] = (*v).into();
            Point3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]))
        })
        .collect();
    Ok((vertices, mesh.faces.iter().map(|f| f.vertices.map(|i| i as u32)).collect()))
}

/// OBJ: all objects together, polygons as fans.
pub(super) fn obj(bytes: &[u8]) -> Result<Mesh, MeshError> {
    let options = tobj::LoadOptions { triangulate: true, single_index: false, ..Default::default() };
    let materials = |_: &std::path::Path| Ok((Vec::new(), Default::default()));
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, materials)
        .map_err(|e| wrong("OBJ", one_line(&e.to_string())))?;
    let (mut vertices, mut triangles): Mesh = (Vec::new(), Vec::new());
    // Each object comes with the vertices that it uses: those that coincide are one.
    let mut known = std::collections::HashMap::new();
    for model in models {
        let at: Vec<u32> = model
            .mesh
            .positions
            .chunks_exact(3)
            .map(|p| {
                let key = [p[0], p[1], p[2]].map(|x| (x + 0.0).to_bits());
                *known.entry(key).or_insert_with(|| {
                    vertices.push(Point3::new(p[0], p[1], p[2]));
                    vertices.len() as u32 - 1
                })
            })
            .collect();
        for face in model.mesh.indices.chunks_exact(3) {
            let corner =
                |i: u32| at.get(i as usize).copied().ok_or_else(|| wrong("OBJ", "a face without a vertex"));
            triangles.push([corner(face[0])?, corner(face[1])?, corner(face[2])?]);
        }
    }
    Ok((vertices, triangles))
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(200).collect()
}
