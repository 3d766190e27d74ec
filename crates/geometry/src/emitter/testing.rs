//! Small lamps for the tests of this folder.

use crate::math::Vec3;
use crate::{Material, MaterialId, Mesh, Rgb, Scene};

/// A scene whose triangles all shine with `radiance`.
pub fn scene_of(mut mesh: Mesh, radiance: f32) -> Scene {
    mesh.materials = vec![MaterialId(0); mesh.triangles.len()];
    let material = Material { emissive: Rgb::splat(radiance), ..Material::default() };
    Scene { mesh, materials: vec![material], ..Scene::default() }
}

/// A square of `side` around `at` that faces down, added to `mesh`; returns its corners.
pub fn append_quad(mesh: &mut Mesh, at: Vec3, side: f32) -> [Vec3; 4] {
    let h = 0.5 * side;
    let corners = [[-h, -h], [h, -h], [h, h], [-h, h]].map(|[x, z]| at + Vec3::new(x, 0.0, z));
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(corners);
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    corners
}

/// One square of 1 m at a height of 1.5 m, off the axis.
pub fn quad() -> Mesh {
    let mut mesh = Mesh::default();
    append_quad(&mut mesh, Vec3::new(0.3, 1.5, -0.2), 1.0);
    mesh
}

/// A disc of `n` corners that faces down at height `h`.
pub fn disc(n: u32, radius: f32, h: f32) -> Mesh {
    let corner = |i: u32| {
        let (sin, cos) = (std::f32::consts::TAU * i as f32 / n as f32).sin_cos();
        Vec3::new(radius * cos, h, radius * sin)
    };
    let positions = std::iter::once(Vec3::Y * h).chain((0..n).map(corner)).collect();
    let triangles = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect();
    Mesh { positions, triangles, ..Mesh::default() }
}

/// Kronecker sequence on the generalised golden ratio of six dimensions (Roberts, 2018).
pub fn points(n: u32) -> impl Iterator<Item = [f32; 6]> {
    let phi = 1.113_320_529_f64;
    (0..n).map(move |i| std::array::from_fn(|k| ((i as f64 + 0.5) / phi.powi(k as i32 + 1)).fract() as f32))
}
