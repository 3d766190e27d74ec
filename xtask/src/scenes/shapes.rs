//! Shapes that scenes are built of: triangles with normals, in f64, fronts outward.

use glam::{DMat3, DVec2, DVec3, DVec4, Vec3Swizzles};
use std::collections::HashMap;

/// Triangles with normals. Texture coordinates are empty or as many as the positions.
#[derive(Clone, Default)]
pub struct Shape {
    /// Corners, m.
    pub positions: Vec<DVec3>,
    /// Unit length.
    pub normals: Vec<DVec3>,
    /// v runs down the image, as glTF has it.
    pub uvs: Vec<DVec2>,
    /// Counter-clockwise as seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// A flat quadrilateral: a, b, c, d counter-clockwise as seen from the front.
    pub fn quad(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Shape {
        let normal = (c - a).cross(d - b).normalize();
        Shape {
            positions: vec![a, b, c, d],
            normals: vec![normal; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Shape::default()
        }
    }

    /// A closed box from its lowest to its highest corner.
    pub fn cuboid(lo: DVec3, hi: DVec3) -> Shape {
        Shape::faces(lo, hi).iter().fold(Shape::default(), |all, face| all.with(face))
    }

    /// The faces of a box toward −x, +x, −y, +y, −z and +z.
    pub fn faces(lo: DVec3, hi: DVec3) -> [Shape; 6] {
        let corner = |i: usize| {
            let pick = |bit: usize, lo: f64, hi: f64| if i >> bit & 1 == 1 { hi } else { lo };
            DVec3::new(pick(0, lo.x, hi.x), pick(1, lo.y, hi.y), pick(2, lo.z, hi.z))
        };
        [[0, 4, 6, 2], [5, 1, 3, 7], [0, 1, 5, 4], [6, 7, 3, 2], [1, 0, 2, 3], [4, 5, 7, 6]].map(|face| {
            let [a, b, c, d] = face.map(corner);
            Shape::quad(a, b, c, d)
        })
    }

    /// The top and the sides of a block: `top` counter-clockwise from above, sides down to the height `floor`.
    pub fn prism(top: [DVec3; 4], floor: f64) -> Shape {
        let mut shape = Shape::quad(top[0], top[1], top[2], top[3]);
        for i in 0..4 {
            let (p, q) = (top[i], top[(i + 1) % 4]);
            shape = shape.with(&Shape::quad(p.with_y(floor), q.with_y(floor), q, p));
        }
        shape
    }

    /// A sphere: an icosahedron whose faces were split in four `level` times, corners pushed onto the sphere.
    /// 20 · 4^level triangles of almost one size, smooth normals.
    pub fn sphere(centre: DVec3, radius: f64, level: u32) -> Shape {
        let golden = 0.5 * (1.0 + 5f64.sqrt());
        let mut points = Vec::new();
        for (s, t) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
            points.extend([DVec3::new(s, t, 0.0), DVec3::new(0.0, s, t), DVec3::new(t, 0.0, s)]);
        }
        let mut points: Vec<DVec3> = points.into_iter().map(DVec3::normalize).collect();
        let mut triangles = icosahedron(&points);
        for _ in 0..level {
            triangles = in_four(&triangles, |a, b| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            });
        }
        Shape {
            positions: points.iter().map(|&n| centre + radius * n).collect(),
            normals: points,
            triangles,
            ..Shape::default()
        }
    }

    /// Both shapes as one; either both have texture coordinates, or neither.
    pub fn with(mut self, other: &Shape) -> Shape {
        debug_assert!(self.positions.is_empty() || self.uvs.is_empty() == other.uvs.is_empty());
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.normals.extend(&other.normals);
        self.uvs.extend(&other.uvs);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| first + i)));
        self
    }

    /// Each triangle as four in its own plane: the same surface, normals and images.
    pub fn split(mut self) -> Shape {
        self.triangles = in_four(&std::mem::take(&mut self.triangles), |a, b| {
            let (a, b) = (a as usize, b as usize);
            self.positions.push(0.5 * (self.positions[a] + self.positions[b]));
            self.normals.push((self.normals[a] + self.normals[b]).normalize());
            if !self.uvs.is_empty() {
                self.uvs.push(0.5 * (self.uvs[a] + self.uvs[b]));
            }
            self.positions.len() as u32 - 1
        });
        self
    }

    /// Inside out: fronts become backs.
    pub fn flipped(mut self) -> Shape {
        self.normals.iter_mut().for_each(|n| *n = -*n);
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self
    }

    /// Turned about an axis through the origin, counter-clockwise as the axis points at us.
    pub fn turned(mut self, axis: DVec3, degrees: f64) -> Shape {
        let turn = DMat3::from_axis_angle(axis, degrees.to_radians());
        self.positions.iter_mut().chain(&mut self.normals).for_each(|v| *v = turn * *v);
        self
    }

    /// Moved by a vector, m.
    pub fn moved(mut self, by: DVec3) -> Shape {
        self.positions.iter_mut().for_each(|p| *p += by);
        self
    }

    /// With one image over each quadrilateral that [`Shape::quad`] made, upright: a is its lower left corner.
    pub fn pictured(mut self) -> Shape {
        let corners = [DVec2::new(0.0, 1.0), DVec2::ONE, DVec2::new(1.0, 0.0), DVec2::ZERO];
        self.uvs = corners.repeat(self.positions.len() / 4);
        self
    }

    /// With an image of `size` metres repeated over it, projected along the axis each normal is nearest to.
    pub fn tiled(mut self, size: f64) -> Shape {
        let project = |(p, n): (&DVec3, &DVec3)| {
            let n = n.abs();
            let uv = match n.max_element() {
                m if m == n.y => p.xz(),
                m if m == n.x => DVec2::new(p.z, -p.y),
                _ => DVec2::new(p.x, -p.y),
            };
            uv / size
        };
        self.uvs = self.positions.iter().zip(&self.normals).map(project).collect();
        self
    }

    /// The tangents that a normal map on [`Shape::pictured`] quadrilaterals needs: rightward, bitangent upward.
    pub fn tangents(&self) -> Vec<DVec4> {
        let right = |quad: &[DVec3]| (quad[1] - quad[0]).normalize().extend(1.0);
        self.positions.chunks(4).flat_map(|quad| [right(quad); 4]).collect()
    }

    /// The signed volume that the triangles enclose, m³: positive when a closed shape faces outward.
    #[cfg(test)]
    pub fn volume(&self) -> f64 {
        let corner = |i: u32| self.positions[i as usize];
        self.triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum()
    }
}

/// Each triangle as four; `middle` makes the vertex between two others, once for each edge.
fn in_four(triangles: &[[u32; 3]], mut middle: impl FnMut(u32, u32) -> u32) -> Vec<[u32; 3]> {
    let mut middles = HashMap::new();
    let mut split = |a: u32, b: u32| *middles.entry((a.min(b), a.max(b))).or_insert_with(|| middle(a, b));
    let four = |&[a, b, c]: &[u32; 3]| {
        let (ab, bc, ca) = (split(a, b), split(b, c), split(c, a));
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    };
    triangles.iter().flat_map(four).collect()
}

/// The twenty faces over twelve corners on the unit sphere: every three that are neighbours of one another.
fn icosahedron(points: &[DVec3]) -> Vec<[u32; 3]> {
    // cos of the angle between neighbours is 1/√5 = 0.447; the next corners lie at −0.447.
    let near = |a: usize, b: usize| points[a].dot(points[b]) > 0.4;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = points[a].dot(points[b].cross(points[c])) > 0.0;
                    let [b, c] = if outward { [b, c] } else { [c, b] };
                    triangles.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_box_faces_outward_and_encloses_its_volume() {
        let shape = Shape::cuboid(DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 4.0, 6.0));
        assert!((shape.volume() - 6.0).abs() < 1e-12);
        assert!((shape.flipped().volume() + 6.0).abs() < 1e-12);
    }

    #[test]
    fn a_sphere_has_its_corners_on_the_sphere() {
        let centre = DVec3::new(0.1, 0.2, 0.3);
        let shape = Shape::sphere(centre, 0.5, 4);
        assert_eq!(shape.triangles.len(), 5120);
        assert!(shape.positions.iter().all(|p| (p.distance(centre) - 0.5).abs() < 1e-15));
        // The chords lie inside: 5120 of them miss about half a per cent of the volume.
        let ratio = shape.volume() / (4.0 / 3.0 * PI * 0.125);
        assert!((0.99..1.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_split_shape_is_the_same_shape() {
        let whole = Shape::cuboid(DVec3::ZERO, DVec3::ONE).pictured();
        let split = whole.clone().split().split();
        assert_eq!(split.triangles.len(), 16 * whole.triangles.len());
        assert_eq!((split.positions.len(), split.normals.len()), (split.uvs.len(), split.uvs.len()));
        assert!((split.volume() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn normals_agree_with_the_winding() {
        for shape in [Shape::cuboid(DVec3::ZERO, DVec3::ONE), Shape::sphere(DVec3::ZERO, 1.0, 2)] {
            for &[a, b, c] in &shape.triangles {
                let [p, q, r] = [a, b, c].map(|i| shape.positions[i as usize]);
                assert!((q - p).cross(r - p).dot(shape.normals[a as usize]) > 0.0);
            }
        }
    }
}
