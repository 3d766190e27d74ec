//! Which sides of which pieces of surface light can reach at all.
//!
//! Both sides of a surface reflect, so each has an irradiance of its own; but the outside of a windowless room and
//! the inside of a box are dark for ever. A few hundred thousand particles, sent from the emitters and scattered
//! about, tell them apart whichever way the triangles face. A dead side needs no gathering, and a vertex that sees
//! mostly dead sides is buried inside something.

use crate::element::{Elements, Side};
use geometry::sampling::Rng;
use geometry::{Ray, Surface, World, math};
use rayon::prelude::*;

/// Particles sent: a piece with a thousandth of the surface still meets a few hundred.
const PARTICLES: usize = 100_000;
/// Scatterings after which a particle is dropped.
const BOUNCES: usize = 12;
/// A side that nothing met is dead only if its other side was met this often: a piece that nothing met on either
/// side is small, not dark.
const EVIDENCE: u32 = 16;

/// Which sides light reaches.
#[derive(Clone, Debug)]
pub struct Reach {
    /// For each piece, front and back.
    alive: Vec<[bool; 2]>,
}

impl Reach {
    /// Whether light can come to `side` of the piece numbered `piece`.
    pub fn alive(&self, piece: u32, side: Side) -> bool {
        self.alive[piece as usize][side.index()]
    }

    /// Every side of `pieces` pieces counts as reached.
    pub fn everywhere(pieces: u32) -> Reach {
        Reach { alive: vec![[true; 2]; pieces as usize] }
    }

    /// Sends particles and looks where they come.
    pub fn explore(world: &World, elements: &Elements, seed: u64) -> Reach {
        let pieces = elements.pieces as usize;
        let met = (0..PARTICLES.div_ceil(1024))
            .into_par_iter()
            .map(|batch| {
                let mut met = vec![[0u32; 2]; pieces];
                for i in 0..1024 {
                    wander(
                        world,
                        elements,
                        &mut Rng::new(seed ^ 0x72_6561_6368, (batch * 1024 + i) as u64),
                        &mut met,
                    );
                }
                met
            })
            .reduce(
                || vec![[0u32; 2]; pieces],
                |mut a, b| {
                    for (a, b) in a.iter_mut().zip(b) {
                        (a[0], a[1]) = (a[0] + b[0], a[1] + b[1]);
                    }
                    a
                },
            );
        let alive = met.iter().map(|&[f, b]| [f > 0 || b < EVIDENCE, b > 0 || f < EVIDENCE]).collect();
        Reach { alive }
    }
}

/// One particle's way; counts the sides it meets.
fn wander(world: &World, elements: &Elements, rng: &mut Rng, met: &mut [[u32; 2]]) {
    let u = [rng.f32(), rng.f32(), rng.f32(), rng.f32(), rng.f32()];
    let Some(start) = world.emitters.emit(&world.scene, u) else { return };
    let mut ray: Ray = start.ray;
    for _ in 0..BOUNCES {
        let Some(hit) = world.bvh.closest_hit(&ray) else { return };
        let surface = Surface::new(&world.scene, &ray, &hit);
        if let Some(piece) = elements.piece(hit.triangle) {
            met[piece as usize][Side::met(surface.front).index()] += 1;
        }
        if rng.f32() >= surface.coverage {
            ray = Ray::new(math::offset_origin(surface.position, -surface.ng), ray.direction);
            continue;
        }
        let u = [rng.f32(), rng.f32(), rng.f32()];
        let Some(next) = surface.bsdf.sample(-ray.direction, u) else { return };
        let out = if next.wi.dot(surface.ng) > 0.0 { surface.ng } else { -surface.ng };
        ray = Ray::new(math::offset_origin(surface.position, out), next.wi);
    }
}
