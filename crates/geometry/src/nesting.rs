//! Solids within solids: what lies on either side of a boundary where several overlap.
//!
//! A liquid in a tumbler is modelled to reach a little into the glass, for a gap would be seen and surfaces in one
//! place cannot be told apart. Where solids overlap the one of the highest priority is there and the others are not
//! (Schmidt and Budge, "Simple Nested Dielectrics in Ray Traced Images", Journal of Graphics Tools 7(2), 2002), so that
//! some boundaries bend nothing, and others bend light from liquid to glass rather than from air.
//!
//! Schmidt and Budge keep a list along each path. Here a boundary asks for itself, by the crossings of the same ray with
//! all solids further on: a ray that starts within a liquid, as gather and shadow rays do, needs no list that nobody
//! could have made. It costs a ray through a small tree, at boundaries that lie in the box of two solids only.

use crate::solid::{Solid, solids};
use crate::{Bvh, Hit, Material, MaterialId, Mesh, Ray, Scene, Vec3};

/// Boundaries this near to one another count as one, in units of the size of the solids' overlap.
const TOGETHER: f32 = 1e-4;
/// Crossings that are looked at along one ray.
const MOST: usize = 64;
/// Different materials that may lie about one place.
const DEEP: usize = 8;

/// What is on either side of a boundary: where the ray came from, and where it goes; `None` is air.
pub type Sides = [Option<MaterialId>; 2];

/// The closed solids of a scene, where some overlap.
#[derive(Debug)]
pub struct Nesting {
    mesh: Mesh,
    /// Of each triangle here, which it is in the scene.
    triangles: Vec<u32>,
    bvh: Bvh,
    /// Where the boxes of two solids overlap, m.
    crowded: Vec<(Vec3, Vec3)>,
}

impl Nesting {
    /// `None` where no two closed solids overlap, as far as their boxes tell.
    pub fn new(scene: &Scene) -> Option<Nesting> {
        let closed: Vec<Solid> = solids(scene).into_iter().filter(|s| s.open == 0).collect();
        let mut crowded = Vec::new();
        for (i, a) in closed.iter().enumerate() {
            for b in &closed[..i] {
                let (low, high) = (a.bounds.0.max(b.bounds.0), a.bounds.1.min(b.bounds.1));
                if low.cmple(high).all() {
                    let near = Vec3::splat(TOGETHER * (high - low).length());
                    crowded.push((low - near, high + near));
                }
            }
        }
        if crowded.is_empty() {
            return None;
        }
        let triangles: Vec<u32> = closed.iter().flat_map(|s| s.triangles.iter().copied()).collect();
        let mesh = Mesh {
            positions: triangles.iter().flat_map(|&t| scene.mesh.corners(t)).collect(),
            triangles: (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            materials: triangles.iter().map(|&t| scene.mesh.materials[t as usize]).collect(),
            ..Mesh::default()
        };
        Some(Nesting { bvh: Bvh::build(&mesh), mesh, triangles, crowded })
    }

    /// What lies before and beyond the boundary that `ray` met at `hit`; `None` where no other solid is near, or the
    /// surface bounds none. Both are the same where the boundary is not really there.
    pub fn sides(&self, scene: &Scene, ray: &Ray, hit: &Hit) -> Option<Sides> {
        let here = scene.mesh.materials[hit.triangle as usize];
        scene.materials[here.0 as usize].enclosed()?;
        let position = ray.at(hit.t);
        let inside = |(low, high): &&(Vec3, Vec3)| low.cmple(position).all() && position.cmple(*high).all();
        let size = |(low, high): &(Vec3, Vec3)| (*high - *low).length();
        let near = TOGETHER * self.crowded.iter().filter(inside).map(size).min_by(f32::total_cmp)?;
        let mut windings = Windings::default();
        let mut count = |material, normal: Vec3, which: &[usize]| {
            let out = if normal.dot(ray.direction) > 0.0 { 1 } else { -1 };
            which.iter().for_each(|&side| windings.add(material, side, out));
        };
        // What was decided where the ray set out, or will be at a boundary in the same place, is not decided here.
        let mut undecided = hit.t < near;
        self.crossings(
            Ray { t_min: hit.t, t_max: f32::INFINITY, ..*ray },
            |t, triangle, material, normal| {
                if triangle != hit.triangle {
                    undecided |= t < hit.t + near;
                    count(material, normal, &[0, 1]);
                }
            },
        );
        let before = Ray { t_min: (hit.t - near).max(0.0), t_max: hit.t, ..*ray };
        self.crossings(before, |_, triangle, material, normal| {
            if triangle != hit.triangle {
                count(material, normal, &[0]);
            }
        });
        count(here, scene.mesh.geometric_normal(hit.triangle), &[0]);
        let [before, beyond] = [0, 1].map(|side| windings.winner(&scene.materials, side));
        Some(if undecided { [beyond, beyond] } else { [before, beyond] })
    }

    /// Calls `met` with the distance, triangle in the scene, material and normal of each crossing.
    fn crossings(&self, mut ray: Ray, mut met: impl FnMut(f32, u32, MaterialId, Vec3)) {
        for _ in 0..MOST {
            let Some(hit) = self.bvh.closest_hit(&ray) else { return };
            let t = hit.triangle as usize;
            met(hit.t, self.triangles[t], self.mesh.materials[t], self.mesh.geometric_normal(hit.triangle));
            ray.t_min = hit.t;
        }
    }
}

/// How many times each material lies around a place, before and beyond a boundary: exits less entries further on.
#[derive(Default)]
struct Windings {
    of: [(MaterialId, [i32; 2]); DEEP],
    len: usize,
}

impl Windings {
    fn add(&mut self, material: MaterialId, side: usize, out: i32) {
        let i = match self.of[..self.len].iter().position(|(m, _)| *m == material) {
            Some(i) => i,
            None if self.len < DEEP => {
                self.of[self.len] = (material, [0; 2]);
                self.len += 1;
                self.len - 1
            }
            None => return,
        };
        self.of[i].1[side] += out;
    }

    /// The material that is there.
    fn winner(&self, materials: &[Material], side: usize) -> Option<MaterialId> {
        let there = self.of[..self.len].iter().filter(|(_, n)| n[side] > 0).map(|(m, _)| *m);
        there.max_by(|a, b| {
            let [of_a, of_b] = [a, b].map(|m| &materials[m.0 as usize]);
            let by_priority = of_a.priority.cmp(&of_b.priority);
            by_priority.then(of_a.ior.total_cmp(&of_b.ior)).then(b.0.cmp(&a.0))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::offset_origin;
    use crate::optics::refract;
    use crate::{Rgb, Volume, World};

    fn solid(ior: f32, priority: i32) -> Material {
        let volume = Some(Volume { attenuation_color: Rgb::splat(1.0 / ior), attenuation_distance: 1.0 });
        let name = format!("{ior}");
        Material {
            name,
            metallic: 0.0,
            roughness: 0.0,
            transmission: 1.0,
            ior,
            volume,
            priority,
            ..Material::default()
        }
    }

    /// Boxes from `low` to `high`; a box with its corners exchanged is a hole.
    fn boxes(all: &[(Material, Vec3, Vec3)]) -> World {
        let mut scene = Scene::default();
        for (material, low, high) in all {
            let (id, first) = (MaterialId(scene.materials.len() as u32), scene.mesh.positions.len() as u32);
            let id = match scene.materials.iter().position(|m| m.name == material.name) {
                Some(known) => MaterialId(known as u32),
                None => {
                    scene.materials.push(material.clone());
                    id
                }
            };
            let pick = |bit: u32, axis: usize| if bit == 0 { low[axis] } else { high[axis] };
            scene
                .mesh
                .positions
                .extend((0..8).map(|i| Vec3::new(pick(i & 1, 0), pick(i & 2, 1), pick(i & 4, 2))));
            let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
            for [a, b, c, d] in faces.map(|f| f.map(|v| v + first)) {
                scene.mesh.triangles.extend([[a, b, c], [a, c, d]]);
                scene.mesh.materials.extend([id; 2]);
            }
        }
        World::new(scene)
    }

    /// A ray bent at every boundary, without reflection: index after index of what it goes through, its last direction,
    /// and how many boundaries were there in name only.
    fn through(world: &World, origin: Vec3, direction: Vec3) -> (Vec<f32>, Vec3, usize) {
        let (mut ray, mut went, mut passed) = (Ray::new(origin, direction), Vec::new(), 0);
        let index = |v: Option<Volume>| v.map_or(1.0, |v| 1.0 / v.attenuation_color.g);
        while let Some(hit) = world.closest(&ray) {
            let s = world.surface(&ray, &hit);
            if s.coverage == 0.0 {
                passed += 1;
                ray.t_min = hit.t;
                continue;
            }
            if went.is_empty() {
                went.push(index(s.before));
            }
            went.push(index(s.beyond));
            let eta = index(s.before) / index(s.beyond);
            assert!((s.bsdf.layers.eta() - eta).abs() < 1e-6, "{eta}: {}", s.bsdf.layers.eta());
            let Some(wi) = refract(-ray.direction, s.ns, eta) else { panic!("totally reflected") };
            ray = Ray::new(offset_origin(s.position, -s.ng), wi);
        }
        (went.iter().map(|n| (n * 100.0).round() / 100.0).collect(), ray.direction, passed)
    }

    const WIDE: Vec3 = Vec3::new(50.0, 0.0, 50.0);

    fn slab(ior: f32, priority: i32, low: f32, high: f32) -> (Material, Vec3, Vec3) {
        (solid(ior, priority), Vec3::Y * low - WIDE, Vec3::Y * high + WIDE)
    }

    /// Both ways, from without and from within: what lies where does not depend on who asks.
    #[test]
    fn a_liquid_that_reaches_into_glass_ends_where_the_glass_begins() {
        let world = boxes(&[slab(1.5, 0, 1.0, 2.0), slab(1.33, 0, 0.0, 1.1)]);
        let down = Vec3::new(0.5, -1.0, 0.2).normalize();
        let (went, out, passed) = through(&world, Vec3::Y * 3.0, down);
        assert_eq!((went, passed), (vec![1.0, 1.5, 1.33, 1.0], 1));
        assert!((out - down).length() < 1e-5, "a slab shifts, and does not turn");
        let (went, ..) = through(&world, Vec3::NEG_Y, -down);
        assert_eq!(went, [1.0, 1.33, 1.5, 1.0]);
        let (went, out, _) = through(&world, Vec3::Y * 0.5, -down);
        assert_eq!(went, [1.33, 1.5, 1.0]);
        let sine = |d: Vec3| d.with_y(0.0).length();
        assert!((sine(out) - 1.33 * sine(down)).abs() < 1e-5, "Snell, from liquid by glass to air");
    }

    #[test]
    fn surfaces_in_one_place_are_one_boundary() {
        for low in [0.0, 1.0] {
            let world = boxes(&[slab(1.5, 0, 1.0, 2.0), slab(1.33, 0, low, low + 1.0)]);
            let down = Vec3::new(0.3, -1.0, 0.2).normalize();
            let expected = if low == 0.0 { vec![1.0, 1.5, 1.33, 1.0] } else { vec![1.0, 1.5, 1.0] };
            for from in [3.0, 1.5] {
                let (went, ..) = through(&world, Vec3::Y * from, down);
                assert_eq!(went, expected[usize::from(from < 2.0)..], "from {from}");
            }
            let (went, ..) = through(&world, Vec3::NEG_Y, -down);
            assert_eq!(went, expected.iter().rev().copied().collect::<Vec<f32>>());
        }
    }

    #[test]
    fn a_priority_decides_before_the_index_does() {
        let within = |priority| {
            let world = boxes(&[slab(1.5, 0, 0.0, 3.0), slab(1.1, priority, 1.0, 2.0)]);
            through(&world, Vec3::Y * 4.0, Vec3::NEG_Y).0
        };
        assert_eq!(within(0), [1.0, 1.5, 1.0], "the weaker is not there");
        assert_eq!(within(1), [1.0, 1.5, 1.1, 1.5, 1.0]);
    }

    #[test]
    fn holes_and_pieces_of_one_material() {
        let (glass, low, high) = slab(1.5, 0, 1.0, 2.0);
        let world = boxes(&[
            slab(1.5, 0, 0.0, 3.0),
            (glass, low.with_y(2.0), high.with_y(1.0)),
            slab(1.33, 0, 1.2, 1.8),
        ]);
        let (went, _, passed) = through(&world, Vec3::Y * 4.0, Vec3::NEG_Y);
        assert_eq!(
            (went, passed),
            (vec![1.0, 1.5, 1.0, 1.33, 1.0, 1.5, 1.0], 0),
            "a drop in a bubble in glass"
        );
        let grown = boxes(&[slab(1.5, 0, 0.0, 2.0), slab(1.5, 0, 1.0, 3.0)]);
        assert_eq!(
            through(&grown, Vec3::Y * 4.0, Vec3::NEG_Y),
            (vec![1.0, 1.5, 1.0], Vec3::NEG_Y, 2),
            "one piece"
        );
    }

    #[test]
    fn solids_apart_and_open_ones_cost_nothing() {
        let apart = boxes(&[slab(1.5, 0, 0.0, 1.0), slab(1.33, 0, 2.0, 3.0)]);
        assert!(Nesting::new(&apart.scene).is_none());
        let mut open = boxes(&[slab(1.5, 0, 1.0, 2.0), slab(1.33, 0, 0.0, 1.1)]).scene;
        open.mesh.triangles.pop();
        open.mesh.materials.pop();
        assert!(Nesting::new(&open).is_none());
    }
}
