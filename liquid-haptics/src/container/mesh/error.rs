/// Why a mesh is no cavity.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// The file does not parse.
    #[error("{format}: {why}")]
    Parse {
        /// `STL` or `OBJ`.
        format: &'static str,
        /// What is wrong and what is expected.
        why: String,
    },
    /// The unit of length is not above zero.
    #[error("a unit of {got} m, expected above 0")]
    Unit {
        /// What came.
        got: f64,
    },
    /// There are no triangles.
    #[error("the mesh has no triangles")]
    Empty,
    /// A coordinate is no number.
    #[error("vertex {vertex} has a coordinate that is no finite number")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex}, there are {vertices}")]
    Index {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// An edge is not shared by two triangles in opposite directions: the mesh has a hole, or its triangles disagree on
    /// which side is outside.
    #[error(
        "the edge from {from:?} to {to:?} belongs to {uses} triangles one way and {back} the other, expected one each"
    )]
    Open {
        /// The edge's first end, m.
        from: [f64; 3],
        /// The edge's second end, m.
        to: [f64; 3],
        /// Triangles that run along it from the first end to the second.
        uses: usize,
        /// Triangles that run along it the other way.
        back: usize,
    },
    /// The triangles face inwards.
    #[error("the mesh is inside out (its volume is {volume_m3} m^3): turn its triangles over")]
    Inverted {
        /// The signed volume, m^3.
        volume_m3: f64,
    },
    /// Two triangles cross.
    #[error("triangles {first} and {second} cross near {at:?}")]
    SelfIntersecting {
        /// Index of one.
        first: usize,
        /// Index of the other.
        second: usize,
        /// Where, m.
        at: [f64; 3],
    },
    /// The wall is too thick for the container.
    #[error("a wall of {wall_m} m leaves no cavity")]
    Wall {
        /// The wall's thickness, m.
        wall_m: f64,
    },
}
