//! What the rays are shot at.

use anyhow::{Context, Result};
use geometry::{Camera, Mesh, Projection, Vec3};
use glam::Mat4;
use std::f32::consts::{PI, TAU};
use std::path::Path;

/// A scene by the name of its file, or one that is made here; and where to look from.
pub fn load(name: &str) -> Result<(Mesh, Camera)> {
    match name {
        "room" => Ok(room(24, 32)),
        "million" => Ok(room(24, 144)),
        _ => file(name),
    }
}

/// A box of 6 × 3 × 8 m with `count` lumpy balls of 2 · `n`² triangles each.
fn room(count: u32, n: u32) -> (Mesh, Camera) {
    let mut mesh = Mesh::default();
    let (lo, hi) = (Vec3::new(-3.0, 0.0, -4.0), Vec3::new(3.0, 3.0, 4.0));
    let corner = |i: u32| Vec3::select(glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0), hi, lo);
    mesh.positions.extend((0..8).map(corner));
    for [a, b, c, d] in [[0, 1, 3, 2], [4, 6, 7, 5], [0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6]] {
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    for i in 0..count {
        let cell = Vec3::new((i % 4) as f32 - 1.5, (i / 12) as f32 - 0.5, (i / 4 % 3) as f32 - 1.0);
        lump(&mut mesh, Vec3::new(0.0, 1.3, -0.7) + cell * Vec3::new(1.4, 1.3, 1.6), 0.5, n, i as f32);
    }
    mesh.materials = vec![Default::default(); mesh.triangles.len()];
    let eye = Vec3::new(0.4, 1.6, 3.8);
    let back = (eye - Vec3::new(0.0, 1.2, 0.0)).normalize();
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let to_world = Mat4::from_cols(right.extend(0.0), up.extend(0.0), back.extend(0.0), eye.extend(1.0));
    let projection = Projection::Perspective { yfov: 1.0 };
    (mesh, Camera { name: "door".into(), to_world, projection, near: 0.0, aspect: None })
}

/// A ball with ripples of a tenth of its radius.
fn lump(mesh: &mut Mesh, centre: Vec3, radius: f32, n: u32, phase: f32) {
    let first = mesh.positions.len() as u32;
    for (i, j) in (0..=n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let (theta, phi) = (PI * i as f32 / n as f32, TAU * j as f32 / n as f32);
        let d = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        let ripple = (7.0 * d.x + phase).sin() * (9.0 * d.y).sin() * (8.0 * d.z + phase).cos();
        mesh.positions.push(centre + radius * (1.0 + 0.1 * ripple) * d);
    }
    let at = |i: u32, j: u32| first + i * n + j % n;
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        mesh.triangles.extend([[a, c, b], [a, d, c]]);
    }
}

/// A glTF file, seen from its first camera.
fn file(name: &str) -> Result<(Mesh, Camera)> {
    let loaded = geometry::gltf::load(Path::new(name))?;
    let mesh = loaded.scene.mesh;
    let (lo, hi) = mesh.bounds().context("no triangles")?;
    let camera = loaded.cameras.into_iter().next().unwrap_or_else(|| Camera::framing(lo, hi));
    Ok((mesh, camera))
}
