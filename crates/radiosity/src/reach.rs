//! Which sides of which faces light can reach at all.
//!
//! Both sides of a surface reflect, so each has an irradiance of its own; but the outside of a windowless room and
//! the inside of a box are dark for ever. Random walks from either side of every face tell them apart, whichever way
//! the triangles face: a side from which hardly any walk comes to a lit place is dead. It needs no gathering, and a
//! vertex that sees mostly dead sides is buried inside something.

use crate::element::{Elements, Side};
use geometry::math::{offset_origin, to_world};
use geometry::sampling::{self, Rng};
use geometry::{Mesh, Ray, Vec3, World};
use rayon::prelude::*;

/// Walks from each side of everything that is asked for, beside those shared.
const WALKS: usize = 48;
/// Walks shared among all sides by area beside those.
const SHARED: usize = 60_000;
/// A face of this share of all surface is asked for itself, smaller ones go by their piece: of what is finely modelled
/// with hard edges every triangle is a face.
const LARGE: f32 = 5e-4;
/// Walks from a face of a lit piece before it is taken for dark.
const STUBBORN: usize = 600;
/// Surfaces that a walk meets at most.
const LONGEST: usize = 10;
/// A side is lit when one walk in so many comes to a lit place: fewer come through the cracks between a room's walls
/// (0.65 % outside the measured Cornell box).
const RARE: usize = 300;
/// Light at less than this cosine does not count: a lamp let into a ceiling lies in the plane of the ceiling's outside, and
/// shines on it by rounding alone.
const GRAZING: f32 = 1e-4;
/// An emitter shines on a side when it does on one point in so many of it.
const SELDOM: usize = 50;

/// Which sides light reaches.
#[derive(Clone, Debug)]
pub struct Reach {
    /// For each face, front and back.
    sides: Vec<[Lit; 2]>,
}

/// What walks from one side of a piece found.
#[derive(Clone, Copy, Debug, Default)]
struct Lit {
    /// Light comes here.
    at_all: bool,
    /// It comes straight from an emitter to a good part of it.
    directly: bool,
}

impl Reach {
    /// Whether light can come to `side` of the face numbered `face`.
    pub fn alive(&self, face: u32, side: Side) -> bool {
        self.sides[face as usize][side.index()].at_all
    }

    /// Whether an emitter shines straight on a good part of `side` of the face numbered `face`.
    pub fn shone_on(&self, face: u32, side: Side) -> bool {
        self.sides[face as usize][side.index()].directly
    }

    /// Walks from every side and looks whether it comes to a lit place.
    pub fn explore(world: &World, elements: &Elements, seed: u64) -> Reach {
        let mesh = &world.scene.mesh;
        let pieces = Areas::new(mesh, elements.pieces, |t| elements.piece(t));
        let lit = |piece: usize| Side::BOTH.map(|side| walks(world, &pieces, piece, side, 0, seed));
        let of_pieces: Vec<[Lit; 2]> = (0..elements.pieces as usize).into_par_iter().map(lit).collect();
        let faces = Areas::new(mesh, elements.faces, |t| elements.face(t));
        let sides = (0..elements.faces as usize).into_par_iter().map(|face| {
            let Some(&(t, _)) = faces.of[face].first() else { return [Lit::default(); 2] };
            let piece = elements.piece(t).unwrap_or_default() as usize;
            let (area, whole) = (faces.area(face), pieces.area(piece));
            let part = area > LARGE * faces.total && area < 0.999 * whole;
            Side::BOTH.map(|side| match of_pieces[piece][side.index()] {
                lit if part && lit.at_all => walks(world, &faces, face, side, STUBBORN, seed ^ 1),
                lit => lit,
            })
        });
        Reach { sides: sides.collect() }
    }
}

/// The triangles of every part (piece or face) with running sums of their areas.
struct Areas {
    of: Vec<Vec<(u32, f32)>>,
    total: f32,
}

impl Areas {
    fn new(mesh: &Mesh, parts: u32, part: impl Fn(u32) -> Option<u32>) -> Areas {
        let mut of: Vec<Vec<(u32, f32)>> = vec![Vec::new(); parts as usize];
        let mut total = 0.0;
        for t in 0..mesh.triangles.len() as u32 {
            let Some(part) = part(t) else { continue };
            let area = mesh.area(t);
            total += area;
            let before = of[part as usize].last().map_or(0.0, |l| l.1);
            of[part as usize].push((t, before + area));
        }
        Areas { of, total }
    }

    /// Area of a part, m².
    fn area(&self, part: usize) -> f32 {
        self.of[part].last().map_or(0.0, |l| l.1)
    }

    /// A point of a part, even in area.
    fn point(&self, mesh: &Mesh, part: usize, rng: &mut Rng) -> Option<(Vec3, Vec3)> {
        let triangles = &self.of[part];
        let at = rng.f32() * self.area(part);
        let i = triangles.partition_point(|&(_, sum)| sum <= at).min(triangles.len().checked_sub(1)?);
        let t = triangles[i].0;
        let (u, v) = sampling::triangle(rng.vec2());
        Some((mesh.interpolate(t, u, v, &mesh.positions), mesh.geometric_normal(t)))
    }
}

/// Walks from random points on one side of a part: whether enough of them come to a lit place, and whether enough
/// of the points are such places. As long as none does, they go on until there were `stubborn` of them.
fn walks(world: &World, areas: &Areas, part: usize, side: Side, stubborn: usize, seed: u64) -> Lit {
    let walks = WALKS + (SHARED as f32 * areas.area(part) / (2.0 * areas.total).max(1e-30)) as usize;
    let mut rng = Rng::new(seed ^ 0x72_6561_6368, (2 * part + side.index()) as u64);
    let (mut lit, mut directly, mut done) = (0usize, 0usize, 0usize);
    while done < walks || (lit < done.div_ceil(RARE) && done < stubborn) {
        done += 1;
        let Some((p, n)) = areas.point(&world.scene.mesh, part, &mut rng) else { return Lit::default() };
        let n = n * side.sign();
        let shone = shone_on(world, p, n, &mut rng);
        directly += usize::from(shone);
        lit += usize::from(shone || walk(world, p, n, &mut rng));
    }
    Lit { at_all: lit >= done.div_ceil(RARE), directly: directly >= done.div_ceil(SELDOM) }
}

/// Whether a walk from `p`, on a side of unit normal `n`, comes to a place that an emitter shines on, or to an emitter.
fn walk(world: &World, p: Vec3, n: Vec3, rng: &mut Rng) -> bool {
    let mut ray = Ray::new(offset_origin(p, n), to_world(sampling::cosine_hemisphere(rng.vec2()), n));
    for _ in 0..LONGEST {
        let Some(hit) = world.bvh.closest_hit(&ray) else { return world.scene.sky.is_some() };
        let surface = world.surface(&ray, &hit);
        if !surface.emission.is_black() {
            return true;
        }
        let on = if rng.f32() >= surface.coverage {
            ray.direction
        } else if surface.bsdf.has_diffuse() && shone_on(world, surface.position, surface.ng, rng) {
            return true;
        } else {
            match surface.bsdf.sample(-ray.direction, rng.array()) {
                Some(next) => next.wi,
                None => return false,
            }
        };
        let away = if on.dot(surface.ng) > 0.0 { surface.ng } else { -surface.ng };
        ray = Ray::new(offset_origin(surface.position, away), on);
    }
    false
}

/// Whether one light sample reaches `p` on the side of unit normal `n`.
fn shone_on(world: &World, p: Vec3, n: Vec3, rng: &mut Rng) -> bool {
    world.emitters.sample(&world.scene, p, n, rng.array()).is_some_and(|light| {
        light.wi.dot(n) > GRAZING
            && !light.radiance.is_black()
            && !world.transmittance(&light.shadow_ray(p, n)).is_black()
    })
}
