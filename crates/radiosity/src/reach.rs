//! Which sides of which pieces of surface light can reach at all.
//!
//! Both sides of a surface reflect, so each has an irradiance of its own; but the outside of a windowless room and
//! the inside of a box are dark for ever. Rays from either side of every piece tell whether it sees an emitter, and
//! which other sides it sees; what sees a lit side is lit. So the two sides are told apart whichever way the triangles
//! face. A dead side needs no gathering, and a vertex that sees mostly dead sides is buried inside something.

use crate::element::{Elements, Side};
use geometry::math::{offset_origin, to_world};
use geometry::sampling::{self, Rng};
use geometry::{Hit, Mesh, Ray, Surface, Vec3, World};
use rayon::prelude::*;

/// Rays from each side of every piece, at least.
const RAYS: usize = 64;
/// Rays shared among all sides by area beside those.
const SHARED: usize = 200_000;
/// Mirrors and panes that a ray passes at most.
const LONGEST: usize = 16;

/// Which sides light reaches.
#[derive(Clone, Debug)]
pub struct Reach {
    /// For each piece, front and back.
    alive: Vec<[bool; 2]>,
}

/// What the rays of one side found.
#[derive(Default)]
struct Found {
    lit: bool,
    /// Sides seen, as 2 · piece + side.
    seen: Vec<u32>,
}

impl Reach {
    /// Whether light can come to `side` of the piece numbered `piece`.
    pub fn alive(&self, piece: u32, side: Side) -> bool {
        self.alive[piece as usize][side.index()]
    }

    /// Sends rays from every side and follows what they see back to the emitters.
    pub fn explore(world: &World, elements: &Elements, seed: u64) -> Reach {
        let pieces = elements.pieces as usize;
        let areas = Areas::new(&world.scene.mesh, elements);
        let found: Vec<Found> = (0..2 * pieces)
            .into_par_iter()
            .map(|s| look_around(world, elements, &areas, s / 2, Side::BOTH[s % 2], seed))
            .collect();
        let mut seen_by: Vec<Vec<u32>> = vec![Vec::new(); 2 * pieces];
        for (s, f) in found.iter().enumerate() {
            for &other in &f.seen {
                seen_by[other as usize].push(s as u32);
            }
        }
        let mut alive = vec![[false; 2]; pieces];
        let mut open: Vec<u32> = (0..2 * pieces as u32).filter(|&s| found[s as usize].lit).collect();
        while let Some(s) = open.pop() {
            let lit = &mut alive[s as usize / 2][s as usize % 2];
            if !std::mem::replace(lit, true) {
                open.extend(&seen_by[s as usize]);
            }
        }
        Reach { alive }
    }
}

/// The triangles of every piece with running sums of their areas.
struct Areas {
    of: Vec<Vec<(u32, f32)>>,
    total: f32,
}

impl Areas {
    fn new(mesh: &Mesh, elements: &Elements) -> Areas {
        let mut of: Vec<Vec<(u32, f32)>> = vec![Vec::new(); elements.pieces as usize];
        let mut total = 0.0;
        for t in 0..mesh.triangles.len() as u32 {
            let Some(piece) = elements.piece(t) else { continue };
            let area = mesh.area(t);
            total += area;
            let before = of[piece as usize].last().map_or(0.0, |l| l.1);
            of[piece as usize].push((t, before + area));
        }
        Areas { of, total }
    }

    /// Area of a piece, m².
    fn piece(&self, piece: usize) -> f32 {
        self.of[piece].last().map_or(0.0, |l| l.1)
    }

    /// A point of a piece, even in area.
    fn point(&self, mesh: &Mesh, piece: usize, rng: &mut Rng) -> Option<(Vec3, Vec3)> {
        let triangles = &self.of[piece];
        let at = rng.f32() * self.piece(piece);
        let i = triangles.partition_point(|&(_, sum)| sum <= at).min(triangles.len().checked_sub(1)?);
        let t = triangles[i].0;
        let (u, v) = sampling::triangle(rng.vec2());
        Some((mesh.interpolate(t, u, v, &mesh.positions), mesh.geometric_normal(t)))
    }
}

/// Rays from random points on one side of a piece.
fn look_around(
    world: &World,
    elements: &Elements,
    areas: &Areas,
    piece: usize,
    side: Side,
    seed: u64,
) -> Found {
    let mut found = Found::default();
    let rays = RAYS + (SHARED as f32 * areas.piece(piece) / (2.0 * areas.total).max(1e-30)) as usize;
    let mut rng = Rng::new(seed ^ 0x72_6561_6368, (2 * piece + side.index()) as u64);
    for _ in 0..rays {
        let Some((p, n)) = areas.point(&world.scene.mesh, piece, &mut rng) else { return found };
        let n = n * side.sign();
        let u = rng.array();
        if let Some(light) = world.emitters.sample(&world.scene, p, n, u).filter(|l| l.wi.dot(n) > 0.0) {
            found.lit |=
                !light.radiance.is_black() && !world.transmittance(&light.shadow_ray(p, n)).is_black();
        }
        let wi = to_world(sampling::cosine_hemisphere(rng.vec2()), n);
        look(world, elements, Ray::new(offset_origin(p, n), wi), &mut rng, &mut found);
    }
    found.seen.sort_unstable();
    found.seen.dedup();
    found
}

/// One ray: the sides it meets, through panes and mirrors, and whether it ends in a light.
fn look(world: &World, elements: &Elements, mut ray: Ray, rng: &mut Rng, found: &mut Found) {
    for _ in 0..LONGEST {
        let Some(hit): Option<Hit> = world.bvh.closest_hit(&ray) else {
            found.lit |= world.scene.sky.is_some();
            return;
        };
        let surface = Surface::new(&world.scene, &ray, &hit);
        found.lit |= !surface.emission.is_black();
        let on = if rng.f32() >= surface.coverage {
            ray.direction
        } else {
            if let Some(piece) = elements.piece(hit.triangle) {
                found.seen.push(2 * piece + Side::met(surface.front).index() as u32);
            }
            match surface.bsdf.sample_specular(-ray.direction, rng.array()) {
                Some(next) => next.wi,
                None => return,
            }
        };
        let away = if on.dot(surface.ng) > 0.0 { surface.ng } else { -surface.ng };
        ray = Ray::new(offset_origin(surface.position, away), on);
    }
}
