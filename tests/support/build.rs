//! Scenes in code: rooms, blocks, balls and lamps.

use geometry::math::{Mat3, Mat4};
use geometry::{
    Camera, Light, LightKind, Material, MaterialId, Part, Projection, Rgb, Scene, Sky, Vec3, World,
};

/// A scene in the making. Every shape gets normals of its own, and is a part of its own.
#[derive(Clone, Debug, Default)]
pub struct Build {
    /// What there is so far.
    pub scene: Scene,
}

impl Build {
    /// Empty space.
    pub fn new() -> Build {
        Build::default()
    }

    /// Done: tree and lights are built.
    pub fn world(self) -> World {
        World::new(self.scene)
    }

    /// A plane quadrilateral; its front is where `corners` run counter-clockwise.
    pub fn quad(self, corners: [Vec3; 4], material: &Material) -> Build {
        let normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]).normalize();
        self.add(&corners, &[normal; 4], &[[0, 1, 2], [0, 2, 3]], material)
    }

    /// A level rectangle from `lo` to `hi` in (x, z) at height `y`; its front faces up or down.
    pub fn level(self, y: f32, lo: [f32; 2], hi: [f32; 2], up: bool, material: &Material) -> Build {
        let mut corners =
            [[lo[0], hi[1]], [hi[0], hi[1]], [hi[0], lo[1]], [lo[0], lo[1]]].map(|[x, z]| Vec3::new(x, y, z));
        if !up {
            corners.reverse();
        }
        self.quad(corners, material)
    }

    /// A room: the six faces of the box from `lo` to `hi`, fronts inward. The materials are those of
    /// x low and high, y low (floor) and high (ceiling), z low and high.
    pub fn room(self, lo: Vec3, hi: Vec3, materials: [&Material; 6]) -> Build {
        self.faces(lo, hi, true, materials)
    }

    /// A block: the same faces, fronts outward, of one material.
    pub fn block(self, lo: Vec3, hi: Vec3, material: &Material) -> Build {
        self.faces(lo, hi, false, [material; 6])
    }

    fn faces(mut self, lo: Vec3, hi: Vec3, inward: bool, materials: [&Material; 6]) -> Build {
        for axis in 0..3 {
            for side in 0..2 {
                let corner = |a: usize, b: usize| {
                    let mut p = if side == 1 { hi } else { lo };
                    p[(axis + 1) % 3] = [lo, hi][a][(axis + 1) % 3];
                    p[(axis + 2) % 3] = [lo, hi][b][(axis + 2) % 3];
                    p
                };
                let mut corners = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                if (side == 1) == inward {
                    corners.reverse();
                }
                self = self.quad(corners, materials[2 * axis + side]);
            }
        }
        self
    }

    /// A block whose six faces bound one solid of `material`.
    pub fn solid(self, lo: Vec3, hi: Vec3, material: &Material) -> Build {
        let first = self.scene.materials.len() as u32;
        let mut build = self.block(lo, hi, material);
        build.scene.mesh.materials.iter_mut().for_each(|m| m.0 = m.0.min(first));
        build
    }

    /// A plane quadrilateral as a grid of `n` × `n` cells, each of two triangles.
    pub fn grid(self, [a, b, c, d]: [Vec3; 4], n: usize, material: &Material) -> Build {
        let normal = (b - a).cross(d - a).normalize();
        let at = |i: usize, j: usize| {
            let (s, t) = (i as f32 / n as f32, j as f32 / n as f32);
            a.lerp(b, s).lerp(d.lerp(c, s), t)
        };
        let points: Vec<Vec3> = (0..(n + 1) * (n + 1)).map(|k| at(k % (n + 1), k / (n + 1))).collect();
        let cells = (0..n * n).flat_map(|k| {
            let p = (k % n + k / n * (n + 1)) as u32;
            let (right, up) = (1, n as u32 + 1);
            [[p, p + right, p + right + up], [p, p + right + up, p + up]]
        });
        let triangles: Vec<[u32; 3]> = cells.collect();
        self.add(&points, &vec![normal; points.len()], &triangles, material)
    }

    /// A ball of 8 · 4^`level` triangles (an octahedron divided `level` times) with smooth normals. `material` is asked
    /// for each triangle's centre, seen from the ball's; fronts outward, or inward for the inside of a sphere.
    pub fn ball(
        mut self,
        centre: Vec3,
        radius: f32,
        level: u32,
        inward: bool,
        material: impl Fn(Vec3) -> Material,
    ) -> Build {
        let mut faces: Vec<[Vec3; 3]> = Vec::new();
        for k in 0..8 {
            let s = |bit: u32| if k >> bit & 1 == 1 { -1.0 } else { 1.0 };
            let (x, y, z) = (Vec3::X * s(0), Vec3::Y * s(1), Vec3::Z * s(2));
            faces.push(if s(0) * s(1) * s(2) > 0.0 { [x, y, z] } else { [x, z, y] });
        }
        for _ in 0..level {
            let divided = faces.iter().flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [(a + b), (b + c), (c + a)].map(Vec3::normalize);
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            });
            faces = divided.collect();
        }
        // Triangles of one material go together, with shared corners, so that the surface is one piece.
        let mut groups: Vec<(Material, Vec<[Vec3; 3]>)> = Vec::new();
        for face in faces {
            let wanted = material((face[0] + face[1] + face[2]) / 3.0);
            match groups
                .iter_mut()
                .find(|(m, _)| m.base_color == wanted.base_color && m.emissive == wanted.emissive)
            {
                Some((_, list)) => list.push(face),
                None => groups.push((wanted, vec![face])),
            }
        }
        let sign = if inward { -1.0 } else { 1.0 };
        for (material, faces) in groups {
            let mut unit: Vec<Vec3> = Vec::new();
            let mut seen = std::collections::HashMap::new();
            let mut index = |p: Vec3| {
                *seen.entry(p.to_array().map(f32::to_bits)).or_insert_with(|| {
                    unit.push(p);
                    unit.len() as u32 - 1
                })
            };
            let triangles: Vec<[u32; 3]> = faces
                .iter()
                .map(|&[a, b, c]| {
                    let [a, b, c] = [index(a), index(b), index(c)];
                    if inward { [a, c, b] } else { [a, b, c] }
                })
                .collect();
            let points: Vec<Vec3> = unit.iter().map(|&p| centre + p * radius).collect();
            let normals: Vec<Vec3> = unit.iter().map(|&p| p * sign).collect();
            self = self.add(&points, &normals, &triangles, &material);
        }
        self
    }

    /// A lamp without extent of `intensity` cd.
    pub fn point_lamp(mut self, position: Vec3, intensity: f32) -> Build {
        let kind = LightKind::Point { position, range: f32::INFINITY };
        self.scene.lights.push(Light { name: "lamp".into(), intensity: Rgb::splat(intensity), kind });
        self
    }

    /// The same `radiance` (cd/m²) from everywhere beyond.
    pub fn sky(mut self, radiance: f32) -> Build {
        self.scene.sky = Some(Sky::Constant(Rgb::splat(radiance)));
        self
    }

    fn add(
        mut self,
        points: &[Vec3],
        normals: &[Vec3],
        triangles: &[[u32; 3]],
        material: &Material,
    ) -> Build {
        let Scene { mesh, materials, .. } = &mut self.scene;
        let (first, id) = (mesh.positions.len() as u32, MaterialId(materials.len() as u32));
        let name = format!("part {}", id.0);
        let (first_triangle, count) = (mesh.triangles.len() as u32, triangles.len() as u32);
        mesh.parts.push(Part { name, first: first_triangle, count, source: None });
        materials.push(material.clone());
        mesh.positions.extend(points);
        mesh.normals.extend(normals);
        mesh.triangles.extend(triangles.iter().map(|t| t.map(|i| i + first)));
        mesh.materials.extend(vec![id; triangles.len()]);
        self
    }
}

/// A perspective camera at `eye` that looks at `target`; `yfov` in radians.
pub fn camera(eye: Vec3, target: Vec3, yfov: f32) -> Camera {
    let z = (eye - target).normalize();
    let up = if z.y.abs() > 0.99 { Vec3::Z } else { Vec3::Y };
    let x = up.cross(z).normalize();
    Camera {
        name: "camera".into(),
        to_world: Mat4::from_cols(x.extend(0.0), z.cross(x).extend(0.0), z.extend(0.0), eye.extend(1.0)),
        projection: Projection::Perspective { yfov },
        near: 0.0,
        aspect: None,
    }
}

/// A camera of parallel rays through the square of half side `ymag` (m) around `eye`, that sees nothing nearer than `near`.
pub fn parallel(eye: Vec3, target: Vec3, ymag: f32, near: f32) -> Camera {
    Camera { projection: Projection::Orthographic { ymag }, near, ..camera(eye, target, 1.0) }
}

/// The scene and a camera moved, turned and scaled together. Directions of lamps turn; a lamp's intensity and a
/// surface's radiance stay, so that with `scale` s only punctual lamps change the picture, by 1/s².
pub fn moved(scene: &Scene, camera: &Camera, scale: f32, turn: Mat4, shift: Vec3) -> (Scene, Camera) {
    let mut scene = scene.clone();
    let place = |p: Vec3| turn.transform_point3(p * scale) + shift;
    for p in &mut scene.mesh.positions {
        *p = place(*p);
    }
    for n in &mut scene.mesh.normals {
        *n = turn.transform_vector3(*n);
    }
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Point { position, .. } => *position = place(*position),
            LightKind::Photometric { position, turn: of, .. } => {
                *position = place(*position);
                *of *= Mat3::from_mat4(turn).transpose();
            }
            LightKind::Spot { position, direction, .. } => {
                *position = place(*position);
                *direction = turn.transform_vector3(*direction);
            }
            LightKind::Directional { direction } => *direction = turn.transform_vector3(*direction),
        }
    }
    let mut camera = camera.clone();
    let eye = place(camera.to_world.w_axis.truncate());
    camera.to_world = turn * camera.to_world;
    camera.to_world.w_axis = eye.extend(1.0);
    camera.near *= scale;
    if let Projection::Orthographic { ymag } = &mut camera.projection {
        *ymag *= scale;
    }
    (scene, camera)
}
