//! Light at vertices: the solution's element mesh, refined where direct light has edges, and fitted.
//!
//! Places are sampled all over the mesh, vertex values fitted to them, and the elements that are furthest off split, until
//! the error asked is met or the vertices are used up. Samples stay where they are: after a split their elements are
//! looked up anew, and only what has too few gets more.

mod parts;

use super::fit::{Facet, Observation, fit};
use super::light::{Lamp, Place, Seen, roughly};
use super::{Baked, Look, Report, Settings};
use crate::render::Progress;
use geometry::sampling::{self, Rng};
use geometry::{Rgb, Scene, World};
use radiosity::Solution;
use radiosity::element::{EdgeMarks, Elements, Side, slot};
use rayon::prelude::*;
use std::collections::HashMap;

/// Samples of one side of an element at least, one in each quarter of it.
const SAMPLES: u32 = 4;
/// Shadow rays of each of a sample's two looks: some eight samples make up a vertex.
const SHADOW_RAYS: u32 = 4;
/// Rounds of refinement at most; each halves the edges of the worst elements.
const ROUNDS: u32 = 7;
/// Shortest edge that refinement splits, in units of the rooms' size.
const SHORTEST: f32 = 0.002;
/// Of the squared error asked, what the elements that are left alone may have together.
const LEFT_ALONE: f64 = 0.5;
/// Fresh places at which the fit is judged.
const JUDGES: usize = 8192;
/// A sample that nobody sees counts so much: it must not darken what one sees beside it, behind a picture's frame or
/// where a wall stands on the floor.
const HIDDEN: f32 = 1e-3;
/// Of the error asked, what the mesh may be off the light that was looked up; the rest is for the solution, and shadows
/// with a ragged edge are seen long before they are 5 % of the light.
const FIT_SHARE: f32 = 0.25;
/// Share of the vertices that a round splits off at most: what four samples say of an element is mostly noise, and only the
/// worst of them are surely off.
const GROWTH: f32 = 0.2;
/// Share of the vertices allowed that counts as all of them.
const USED_UP: f32 = 0.9;

/// One side of an element: a facet of the fit.
struct Face {
    leaf: u32,
    triangle: u32,
    /// Barycentrics of its corners in the triangle.
    uv: [[f32; 2]; 3],
    side: Side,
    /// Its light is its own.
    glows: bool,
}

/// Light at a place.
struct Sample {
    place: Place,
    value: Rgb,
    variance: f32,
    hidden: bool,
}

/// A mesh in the making.
struct Mesh<'a> {
    world: &'a World,
    solution: &'a Solution,
    looks: Vec<Look>,
    elements: Elements,
    /// Whether light comes to the back of each face of the scene.
    lit_back: Vec<bool>,
    samples: Vec<Sample>,
    /// Face of each sample, and its barycentrics there.
    located: Vec<(u32, [f32; 3])>,
    faces: Vec<Face>,
    facets: Vec<Facet>,
    /// Face of each side of each leaf.
    face_of: Vec<u32>,
    unknowns: usize,
    values: Vec<Rgb>,
    /// Mean luminance of the light, lamps left out, cd/m².
    brightness: f64,
}

const NONE: u32 = u32::MAX;

/// Bakes to the element mesh, refined to at most `most` vertices where it has not more already.
pub fn bake(
    world: &World,
    solution: &Solution,
    looks: Vec<Look>,
    settings: &Settings,
    most: usize,
    progress: &dyn Progress,
) -> Baked {
    let lamp = Lamp::new(world, solution, SHADOW_RAYS);
    let mut mesh = Mesh {
        world,
        solution,
        looks,
        elements: solution.elements().clone(),
        lit_back: Vec::new(),
        samples: Vec::new(),
        located: Vec::new(),
        faces: Vec::new(),
        facets: Vec::new(),
        face_of: Vec::new(),
        unknowns: 0,
        values: Vec::new(),
        brightness: 0.0,
    };
    mesh.lit_back = mesh.find_lit_backs();
    let mut report = Report::default();
    let mut round = 0;
    let flux_kept = loop {
        progress.stage("sample", 0);
        mesh.number();
        mesh.sample(&lamp, settings.seed, round);
        progress.stage("fit", 0);
        let flux_kept = mesh.fit();
        report.error = mesh.error(&lamp, settings.seed);
        report.first_error = report.first_error.or(report.error);
        let (error, target) = (report.error.unwrap_or(0.0), FIT_SHARE * settings.error);
        report.out_of_vertices =
            error > target && mesh.elements.vertices.len() as f32 >= USED_UP * most as f32;
        if error <= target || round == ROUNDS || progress.stopped() {
            break flux_kept;
        }
        match mesh.refine(target, most) {
            Refined::Some => round += 1,
            Refined::Nothing => break flux_kept,
            Refined::NoRoom => {
                report.out_of_vertices = true;
                break flux_kept;
            }
        }
    };
    report.flux_kept = flux_kept;
    let parts = parts::parts(&mesh);
    Baked { looks: mesh.looks, parts, map: None, report }
}

/// What a round of refinement did.
enum Refined {
    Some,
    /// No element is off enough, or none that is may be split.
    Nothing,
    /// All vertices are used up.
    NoRoom,
}

impl Mesh<'_> {
    fn scene(&self) -> &Scene {
        &self.world.scene
    }

    fn look(&self, triangle: u32) -> Look {
        self.looks[self.scene().mesh.materials[triangle as usize].0 as usize]
    }

    /// The faces to whose back some light comes: backs without are never seen, or black.
    fn find_lit_backs(&self) -> Vec<bool> {
        let mut lit = vec![false; self.elements.faces as usize];
        self.elements.visit_leaves(self.scene().mesh.triangles.len() as u32, |leaf, triangle, uv| {
            let lit = &mut lit[self.elements.face_of(leaf) as usize];
            if !*lit {
                let seen = roughly(self.world, self.solution, Place { triangle, uv, side: Side::Back });
                *lit = !seen.white.is_black() || !seen.emission.is_black();
            }
        });
        lit
    }

    /// Numbers faces and unknowns: one for each side of a vertex; those that glow have their own.
    fn number(&mut self) {
        let elements = &self.elements;
        let (mut faces, mut facets) = (Vec::new(), Vec::new());
        let mut face_of = vec![NONE; 2 * elements.nodes.len()];
        let mut of_slot = vec![NONE; 2 * elements.vertices.len()];
        let mut glowing: HashMap<(usize, u32), u32> = HashMap::new();
        let mut unknowns = 0u32;
        elements.visit_leaf_corners(self.scene().mesh.triangles.len() as u32, |leaf, triangle, uv| {
            let material = self.scene().mesh.materials[triangle as usize].0;
            let look = self.look(triangle);
            if !look.takes_light() {
                return;
            }
            let two_sided = self.scene().materials[material as usize].double_sided;
            for side in Side::BOTH {
                if side == Side::Back && !(two_sided && self.lit_back[elements.face_of(leaf) as usize]) {
                    continue;
                }
                let corners = elements.nodes[leaf as usize].vertices;
                let glows = look == Look::Glowing;
                let number = |v: u32| {
                    let s = slot(v, side);
                    let known =
                        if glows { glowing.entry((s, material)).or_insert(NONE) } else { &mut of_slot[s] };
                    if *known == NONE {
                        *known = unknowns;
                        unknowns += 1;
                    }
                    *known
                };
                facets.push(Facet { unknowns: corners.map(number), corners: elements.corners(leaf) });
                face_of[slot(leaf, side)] = faces.len() as u32;
                faces.push(Face { leaf, triangle, uv, side, glows });
            }
        });
        self.faces = faces;
        self.facets = facets;
        self.face_of = face_of;
        self.unknowns = unknowns as usize;
    }

    /// The face that holds `place`, and where in it.
    fn locate(&self, place: Place) -> (u32, [f32; 3]) {
        let [u, v] = place.uv;
        let (leaf, at) = self.elements.locate(place.triangle, u, v);
        (self.face_of[slot(leaf, place.side)], at)
    }

    /// Light as the place's look wants it.
    fn value(&self, triangle: u32, seen: &Seen) -> Rgb {
        if self.look(triangle) == Look::Glowing { seen.radiance() } else { seen.white }
    }

    /// Gives every face that has too few samples more.
    fn sample(&mut self, lamp: &Lamp, seed: u64, round: u32) {
        let mut located: Vec<_> = self.samples.par_iter().map(|s| self.locate(s.place)).collect();
        let mut counts = vec![0u32; self.faces.len()];
        located.iter().for_each(|l| counts[l.0 as usize] += 1);
        let this = &*self;
        let more: Vec<Sample> = counts
            .par_iter()
            .enumerate()
            .filter(|&(_, &count)| count < SAMPLES)
            .flat_map_iter(|(f, _)| {
                let face = &this.faces[f];
                let mut rng = Rng::new(
                    seed ^ 0x6261_6b65,
                    (u64::from(face.leaf) << 8) + 2 * u64::from(round) + face.side.index() as u64,
                );
                (0..SAMPLES).map(move |quarter| {
                    let place = face.place(quarter, &mut rng);
                    let seen = lamp.seen(place, &mut rng);
                    Sample {
                        place,
                        value: this.value(place.triangle, &seen),
                        variance: seen.variance,
                        hidden: seen.hidden,
                    }
                })
            })
            .collect();
        located.par_extend(more.par_iter().map(|s| self.locate(s.place)));
        self.samples.extend(more);
        self.located = located;
    }

    /// Fits all values; returns the share of the samples' light that they hold.
    fn fit(&mut self) -> f32 {
        let located = &self.located;
        let mut counts = vec![0f32; self.faces.len()];
        located.iter().for_each(|l| counts[l.0 as usize] += 1.0);
        let observe = |(s, &(facet, at)): (&Sample, &(u32, [f32; 3]))| {
            let weight = self.facets[facet as usize].area() / counts[facet as usize];
            Observation { facet, at, value: s.value, weight: if s.hidden { HIDDEN * weight } else { weight } }
        };
        let observations: Vec<Observation> = self.samples.iter().zip(located).map(observe).collect();
        // Least squares overshoot beside an edge, below zero where there is no light.
        self.values =
            fit(self.unknowns, &self.facets, &observations).into_iter().map(|v| v.max(Rgb::BLACK)).collect();
        let (mut kept, mut fell) = (0.0, 0.0);
        let (mut bright, mut area) = (0.0, 0.0);
        for o in &observations {
            if !self.faces[o.facet as usize].glows {
                bright += f64::from(o.weight * o.value.luminance());
                area += f64::from(o.weight);
            }
            kept += f64::from(o.weight * self.fitted(o.facet, o.at).luminance());
            fell += f64::from(o.weight * o.value.luminance());
        }
        self.brightness = if area > 0.0 { bright / area } else { 0.0 };
        if fell > 0.0 { (kept / fell) as f32 } else { 1.0 }
    }

    fn fitted(&self, facet: u32, at: [f32; 3]) -> Rgb {
        let corners = self.facets[facet as usize].unknowns;
        (0..3).map(|k| self.values[corners[k] as usize] * at[k]).sum()
    }

    /// Square of the difference from `s` at its place relative to the light there, less what is the sample's own noise.
    fn square(&self, s: &Sample, (face, at): (u32, [f32; 3])) -> f64 {
        if s.hidden {
            return 0.0;
        }
        let (held, seen) = (self.fitted(face, at).luminance(), s.value.luminance());
        let square = f64::from(held - seen).powi(2) - f64::from(s.variance);
        square / relative_to(f64::from(held.max(seen)), self.brightness)
    }

    /// The error at fresh places, spread evenly over the area; lamps do not count.
    fn error(&self, lamp: &Lamp, seed: u64) -> Option<f32> {
        let mut sum = 0.0;
        let sums: Vec<f64> = (self.faces.iter().zip(&self.facets))
            .map(|(face, facet)| {
                sum += if face.glows { 0.0 } else { f64::from(facet.area()) };
                sum
            })
            .collect();
        if sum <= 0.0 || self.brightness <= 0.0 {
            return None;
        }
        let judged: Vec<(f64, f64)> = (0..JUDGES)
            .into_par_iter()
            .map(|i| {
                let mut rng = Rng::new(seed ^ 0x6a75_6467, i as u64);
                let at = (i as f64 + f64::from(rng.f32())) / JUDGES as f64 * sum;
                let face = &self.faces[sums.partition_point(|&s| s <= at).min(sums.len() - 1)];
                let place = face.anywhere(&mut rng);
                let seen = lamp.seen(place, &mut rng);
                let value = self.value(place.triangle, &seen);
                let sample = Sample { place, value, variance: seen.variance, hidden: seen.hidden };
                if seen.hidden {
                    return (0.0, 0.0);
                }
                (self.square(&sample, self.locate(place)), 1.0)
            })
            .collect();
        let (off, count) = judged.iter().fold((0.0, 0.0), |(a, b), &(x, y)| (a + x, b + y));
        (count > 0.0).then(|| (off.max(0.0) / count).sqrt() as f32)
    }

    /// Splits the elements that are furthest off.
    fn refine(&mut self, error: f32, most: usize) -> Refined {
        let Some(room) = most.checked_sub(self.elements.vertices.len()).filter(|&room| room > 0) else {
            return Refined::NoRoom;
        };
        let mut off = vec![(0.0, 0.0); self.faces.len()];
        let mut area_of_all = 0.0;
        let squares: Vec<f64> =
            self.samples.par_iter().zip(&self.located).map(|(s, &at)| self.square(s, at)).collect();
        for (&(face, _), square) in self.located.iter().zip(squares) {
            let sum: &mut (f64, f64) = &mut off[face as usize];
            *sum = (sum.0 + square, sum.1 + 1.0);
        }
        let mut worst: Vec<(f64, u32)> = Vec::new();
        let mut all = 0.0;
        for (f, &(square, count)) in off.iter().enumerate() {
            let face = &self.faces[f];
            if face.glows || count == 0.0 {
                continue;
            }
            let area = f64::from(self.facets[f].area());
            area_of_all += area;
            let energy = area * (square / count).max(0.0);
            all += energy;
            if self.elements.longest_edge(face.leaf) > 2.0 * SHORTEST * self.world.scale && energy > 0.0 {
                worst.push((energy, face.leaf));
            }
        }
        worst.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let target = LEFT_ALONE * f64::from(error).powi(2) * area_of_all;
        let growth = GROWTH * self.elements.vertices.len() as f32 + 100.0;
        let mut marks = EdgeMarks::default();
        for (energy, leaf) in worst {
            // A split takes two or three vertices with those its neighbours need.
            if all <= target || 2 * marks.len() > room || marks.len() as f32 > growth {
                break;
            }
            all -= energy;
            let [a, b, c] = self.elements.nodes[leaf as usize].vertices;
            [(a, b), (b, c), (c, a)].into_iter().for_each(|(p, q)| marks.mark(p, q));
        }
        if marks.is_empty() {
            return Refined::Nothing;
        }
        self.elements.split(&mut marks);
        Refined::Some
    }
}

/// What a squared difference is relative to, where the brighter of both is `l` and the mean light `mean`: a tenth of the
/// mean stands for what is darker, as in [`crate::metrics`], and no difference is more than 100 %, so that a few dark
/// corners do not make up all of the error.
pub(super) fn relative_to(l: f64, mean: f64) -> f64 {
    l * l + 0.01 * mean * mean
}

impl Face {
    /// A random place in one of the quarters that the middles of its edges make.
    fn place(&self, quarter: u32, rng: &mut Rng) -> Place {
        let (u, v) = sampling::triangle(rng.vec2());
        let (u, v) = (0.5 * u, 0.5 * v);
        self.at(match quarter {
            0 => [u, v],
            1 => [u + 0.5, v],
            2 => [u, v + 0.5],
            _ => [0.5 - u, 0.5 - v],
        })
    }

    fn anywhere(&self, rng: &mut Rng) -> Place {
        let (u, v) = sampling::triangle(rng.vec2());
        self.at([u, v])
    }

    /// The place at its own barycentrics.
    fn at(&self, [u, v]: [f32; 2]) -> Place {
        let [a, b, c] = self.uv;
        let uv = [0, 1].map(|k| a[k] + (b[k] - a[k]) * u + (c[k] - a[k]) * v);
        Place { triangle: self.triangle, uv, side: self.side }
    }
}
