//! The fitted mesh as it is written: a part for each material of each mesh of the scene, equal corners shared.

use super::super::Part;
use super::Mesh;
use geometry::{Rgb, Scene, Vec2, Vec3};
use radiosity::element::Side;
use std::collections::HashMap;

/// The mesh as it is written: elements where light is kept, the scene's triangles elsewhere.
pub fn parts(mesh: &Mesh) -> Vec<Part> {
    let scene = mesh.scene();
    let mut of_triangle = vec![Vec::new(); scene.mesh.triangles.len()];
    for (f, face) in mesh.faces.iter().enumerate() {
        of_triangle[face.triangle as usize].push(f as u32);
    }
    let mut parts = Vec::new();
    for range in &scene.mesh.parts {
        let mut triangles: Vec<u32> = (range.first..range.first + range.count).collect();
        triangles.sort_by_key(|&t| scene.mesh.materials[t as usize]);
        for run in
            triangles.chunk_by(|&a, &b| scene.mesh.materials[a as usize] == scene.mesh.materials[b as usize])
        {
            let mut build = Builder::new(scene, &range.name, scene.mesh.materials[run[0] as usize].0);
            for &t in run {
                if !mesh.look(t).takes_light() {
                    build.triangle(t, Side::Front);
                }
                for &f in &of_triangle[t as usize] {
                    build.face(mesh, f);
                }
            }
            parts.extend(build.finish());
        }
    }
    parts
}

/// A part in the making.
struct Builder<'a> {
    scene: &'a Scene,
    part: Part,
    known: HashMap<(u64, [u32; 8]), u32>,
}

impl<'a> Builder<'a> {
    fn new(scene: &'a Scene, name: &str, material: u32) -> Builder<'a> {
        let part = Part { name: name.into(), material, ..Part::default() };
        Builder { scene, part, known: HashMap::new() }
    }

    /// A triangle of the scene as it is.
    fn triangle(&mut self, t: u32, side: Side) {
        let mesh = &self.scene.mesh;
        let corners = mesh.triangles[t as usize];
        let uv = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let at = [0, 1, 2].map(|k| {
            self.vertex(t, uv[k], mesh.positions[corners[k] as usize], side, u64::from(corners[k]), None)
        });
        self.push(at, side);
    }

    /// One side of an element.
    fn face(&mut self, mesh: &Mesh, f: u32) {
        let (face, facet) = (&mesh.faces[f as usize], &mesh.facets[f as usize]);
        let at = [0, 1, 2].map(|k| {
            let unknown = facet.unknowns[k];
            let light = Some(mesh.values[unknown as usize]);
            self.vertex(face.triangle, face.uv[k], facet.corners[k], face.side, u64::from(unknown), light)
        });
        self.push(at, face.side);
    }

    fn push(&mut self, [a, b, c]: [u32; 3], side: Side) {
        self.part.triangles.push(if side == Side::Front { [a, b, c] } else { [a, c, b] });
    }

    /// The vertex with these attributes: an old one if there is one.
    fn vertex(&mut self, t: u32, uv: [f32; 2], p: Vec3, side: Side, id: u64, light: Option<Rgb>) -> u32 {
        let mesh = &self.scene.mesh;
        let [u, v] = uv;
        let uvs: [Option<Vec2>; 2] = [0, 1]
            .map(|set: usize| (!mesh.uvs[set].is_empty()).then(|| mesh.interpolate(t, u, v, &mesh.uvs[set])));
        let color = (!mesh.colors.is_empty()).then(|| mesh.interpolate(t, u, v, &mesh.colors).to_array());
        let smooth =
            if mesh.normals.is_empty() { Vec3::ZERO } else { mesh.interpolate(t, u, v, &mesh.normals) };
        let normal = smooth.try_normalize().unwrap_or_else(|| mesh.geometric_normal(t)) * side.sign();
        // Two triangles interpolate to the same on their common edge but for rounding.
        let rough = |x: f32| (x * 65536.0).round() as i32 as u32;
        let c = color.unwrap_or_default();
        let [a, b] = uvs.map(|uv| uv.unwrap_or_default());
        let key = [
            rough(a.x),
            rough(a.y),
            rough(b.x),
            rough(b.y),
            rough(c[0]),
            rough(c[1]),
            rough(c[2]),
            rough(c[3]),
        ];
        *self.known.entry((id, key)).or_insert_with(|| {
            let part = &mut self.part;
            part.positions.push(p);
            part.normals.push(normal);
            for (set, uv) in part.uvs.iter_mut().zip(uvs) {
                set.extend(uv);
            }
            part.colors.extend(color);
            part.light.extend(light);
            part.positions.len() as u32 - 1
        })
    }

    fn finish(self) -> Option<Part> {
        (!self.part.triangles.is_empty()).then_some(self.part)
    }
}
