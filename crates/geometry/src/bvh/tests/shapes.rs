//! Meshes for the tests.

use super::Random;
use crate::Mesh;
use crate::math::Vec3;

/// From corners and indices.
pub fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    let materials = vec![Default::default(); triangles.len()];
    Mesh { positions, triangles, materials, ..Mesh::default() }
}

/// Triangles that share nothing.
pub fn soup(triangles: &[[Vec3; 3]]) -> Mesh {
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    mesh(triangles.concat(), indices)
}

/// `n` triangles of edge `size` about, anywhere in the cube [−1, 1]³.
pub fn random_soup(n: usize, size: f32, random: &mut Random) -> Mesh {
    let triangles: Vec<[Vec3; 3]> = (0..n)
        .map(|_| {
            let p = random.cube();
            [p, p + size * random.cube(), p + size * random.cube()]
        })
        .collect();
    soup(&triangles)
}

/// A closed sphere of `2 n²` triangles less those that meet in the poles, with one vertex at each pole.
pub fn sphere(centre: Vec3, radius: f32, n: u32) -> Mesh {
    let mut positions = vec![centre + radius * Vec3::Y];
    for i in 1..n {
        let theta = std::f32::consts::PI * i as f32 / n as f32;
        for j in 0..n {
            let phi = std::f32::consts::TAU * j as f32 / n as f32;
            let d = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            positions.push(centre + radius * d);
        }
    }
    positions.push(centre - radius * Vec3::Y);
    let last = positions.len() as u32 - 1;
    let at = |i: u32, j: u32| match i {
        0 => 0,
        i if i == n => last,
        i => 1 + (i - 1) * n + j % n,
    };
    let mut triangles = Vec::new();
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        triangles.extend(
            [[a, c, b], [a, d, c]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[0] != t[2]),
        );
    }
    mesh(positions, triangles)
}

/// The cube [−1, 1]³, closed, each side of 2 n² triangles.
pub fn cube(n: u32) -> Mesh {
    let mut triangles = Vec::new();
    let step = 2.0 / n as f32;
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let p = |i: u32, j: u32| {
                    let mut p = Vec3::ZERO;
                    p[axis] = side;
                    p[(axis + 1) % 3] = -1.0 + step * i as f32;
                    p[(axis + 2) % 3] = -1.0 + step * j as f32;
                    p
                };
                triangles.push([p(i, j), p(i + 1, j), p(i + 1, j + 1)]);
                triangles.push([p(i, j), p(i + 1, j + 1), p(i, j + 1)]);
            }
        }
    }
    soup(&triangles)
}

/// Every position through `f`.
pub fn moved(mut mesh: Mesh, f: impl Fn(Vec3) -> Vec3) -> Mesh {
    mesh.positions.iter_mut().for_each(|p| *p = f(*p));
    mesh
}

/// Both, the second's triangles after the first's.
pub fn both(mut a: Mesh, b: Mesh) -> Mesh {
    let offset = a.positions.len() as u32;
    a.positions.extend(b.positions);
    a.triangles.extend(b.triangles.into_iter().map(|t| t.map(|i| i + offset)));
    a.materials.extend(b.materials);
    a
}
