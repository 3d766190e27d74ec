//! E at vertices and anywhere between, and what the solve reports.

use crate::caustic::Caustics;
use crate::doubt::Doubt;
use crate::element::{Elements, Side, slot};
use crate::field::Sources;
use crate::flags::{Flags, Voices, visible_weights};
use crate::lights::Lights;
use crate::refine::Refiner;
use crate::solver::Convergence;
use geometry::{Hit, Ray, Rgb, Surface, Vec3, World};
use rayon::prelude::*;

/// Relative error of a leaf that has a corner of which nothing is known.
const GUESS: f32 = 0.5;

/// The solved prepass: indirect irradiance everywhere on the scene's surfaces. It belongs to the world it was solved for.
#[derive(Clone, Debug)]
pub struct Solution {
    pub(crate) elements: Elements,
    /// Indirect irradiance at each slot, lx; zero where a slot is not usable.
    values: Vec<Rgb>,
    usable: Vec<bool>,
    pub(crate) flags: Flags,
    /// How far each slot's value may be off; empty when that is not known.
    doubts: Vec<Doubt>,
    /// Direct irradiance at each slot, lx: for the `vertex` mode and for baking.
    direct: Vec<Rgb>,
    /// Photons' irradiance at each slot, lx; empty when there are none.
    caustic_values: Vec<Rgb>,
    /// Light by way of mirrors and glass alone.
    pub caustics: Caustics,
    /// What the slots' values are made from, where there are sites.
    pub(crate) at_sites: Option<AtSites>,
    /// How the solve went.
    pub report: Report,
}

/// Values where they were gathered.
#[derive(Clone, Debug, Default)]
pub(crate) struct AtSites {
    /// How each slot draws on them.
    pub sources: Sources,
    /// Indirect irradiance, lx.
    pub indirect: Vec<Rgb>,
    /// Direct irradiance, lx.
    pub direct: Vec<Rgb>,
    /// How far the indirect irradiance may be off.
    pub doubts: Vec<Doubt>,
    /// The same by groups of lights, where these are kept apart.
    pub lights: Option<Lights>,
}

/// How a solve went.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Which solver of the classical ones, and its form factors; empty for the default.
    pub solver: String,
    /// Vertices of the element mesh.
    pub vertices: usize,
    /// Leaves of the element mesh.
    pub elements: usize,
    /// Sides of vertices where rays were gathered; patches, for the classical solvers.
    pub sites: usize,
    /// Gather rays that landed on a diffuse surface.
    pub landings: usize,
    /// Bytes of the rows, or of the matrix.
    pub row_bytes: usize,
    /// How the iteration ended.
    pub convergence: Convergence,
    /// Largest row sum: the share of an error that one bounce keeps at most.
    pub norm: f32,
    /// Mean indirect irradiance over sites, lx.
    pub mean: Rgb,
    /// Light that arrives indirectly over light that surfaces send out and that does not escape: 1 when energy is kept.
    pub balance: f32,
    /// Leaf sides where pass 2 gathers for itself, as a share of all.
    pub flagged: f32,
    /// Photons kept.
    pub photons: usize,
    /// Light that photons brought, lm.
    pub caustic_flux: Rgb,
}

impl Report {
    pub(crate) fn new(
        world: &World,
        refiner: &Refiner,
        flags: &Flags,
        extra: &[Rgb],
        direct: &[Rgb],
        convergence: Convergence,
        norm: f32,
        caustics: &Caustics,
    ) -> Report {
        let elements = &refiner.elements;
        Report {
            solver: String::new(),
            vertices: elements.vertices.len(),
            elements: elements.leaves().count(),
            sites: refiner.field.sites.len(),
            landings: refiner.landings(),
            row_bytes: refiner.row_bytes(),
            convergence,
            norm,
            mean: crate::settle::mean(&refiner.e),
            balance: balance(world, refiner, extra, direct),
            flagged: flags.share(),
            photons: caustics.len(),
            caustic_flux: caustics.flux(),
        }
    }
}

/// Σ A E over Σ A ρ (E + D + C) kept, over surfaces that reflect diffusely: what arrives at them indirectly, over what
/// leaves them for one another.
fn balance(world: &World, refiner: &Refiner, extra: &[Rgb], direct: &[Rgb]) -> f32 {
    let (elements, field) = (&refiner.elements, &refiner.field);
    let e = field.spread(&refiner.e);
    let kept: Vec<Rgb> = field.sites.iter().map(|s| Rgb::splat(s.row.kept)).collect();
    let kept = field.spread(&kept);
    let (mut arrived, mut left) = (0f64, 0f64);
    elements.visit_leaves(world.scene.mesh.triangles.len() as u32, |leaf, t, [u, v]| {
        let [a, b, c] = elements.corners(leaf);
        let area = geometry::triangle::area(a, b, c);
        let n = world.scene.mesh.geometric_normal(t);
        for side in Side::BOTH {
            if !refiner.reach.alive(elements.face_of(leaf), side) {
                continue;
            }
            let n = n * side.sign();
            let ray = Ray::new((a + b + c) / 3.0 + n, -n);
            let surface = Surface::new(&world.scene, &ray, &Hit { t: 1.0, triangle: t, u, v });
            let behind = surface.turned();
            if !surface.bsdf.has_diffuse() && behind.is_none() {
                continue;
            }
            let rho = surface.bsdf.diffuse_reflectance();
            let tau = behind.map_or(Rgb::BLACK, |b| b.bsdf.diffuse_reflectance());
            for v in elements.nodes[leaf as usize].vertices {
                let (s, o) = (slot(v, side), slot(v, Side::BOTH[1 - side.index()]));
                if !field.usable(s) {
                    continue;
                }
                let light = |s: usize| e[s] + direct[s] + extra.get(s).copied().unwrap_or(Rgb::BLACK);
                let weight = f64::from(area / 3.0);
                arrived += weight * f64::from(e[s].mean());
                left += weight * f64::from((rho * light(s) + tau * light(o)).mean() * kept[s].r);
            }
        }
    });
    if left > 0.0 { (arrived / left) as f32 } else { 1.0 }
}

/// A place on one side of a surface, with what the mesh knows of it.
#[derive(Clone, Copy)]
pub struct Spot<'a> {
    solution: &'a Solution,
    /// Its leaf.
    node: u32,
    /// Of the corners of that.
    slots: [usize; 3],
    /// Its weights among them; all 0 for a triangle without area.
    place: [f32; 3],
    /// The same for those that may speak for it; `None` where none may.
    spoken: Option<Voices>,
    /// The leaf is flagged as one that the mesh does not resolve.
    unresolved: bool,
}

impl Spot<'_> {
    /// Indirect irradiance, lx: light that has left at least one diffuse surface.
    pub fn irradiance(&self) -> Rgb {
        self.interpolate(&self.solution.values)
    }

    /// Irradiance straight from the emitters, as the vertices know it, lx: shadows as coarse as the mesh.
    pub fn direct(&self) -> Rgb {
        self.interpolate(&self.solution.direct)
    }

    /// Irradiance by photons, as the vertices know it, lx.
    pub fn caustic(&self) -> Rgb {
        if self.solution.caustic_values.is_empty() {
            return Rgb::BLACK;
        }
        self.interpolate(&self.solution.caustic_values)
    }

    /// How far [`Spot::irradiance`] may be off; infinitely where nothing is known.
    pub fn doubt(&self) -> Doubt {
        let Solution { doubts, usable, values, .. } = self.solution;
        if doubts.is_empty() {
            return Doubt::default();
        }
        let known = || self.slots.iter().zip(self.place).filter(|(s, _)| usable[**s]);
        let sum: f32 = known().map(|(_, w)| w).sum();
        // On a side that no light reaches there is nothing to be known.
        if sum <= 1e-6 {
            return Doubt { mesh: if self.unresolved { f32::INFINITY } else { 0.0 }, ray: 0.0 };
        }
        let doubt = known().map(|(&s, w)| doubts[s] * w).sum::<Doubt>() * (1.0 / sum);
        // What a buried corner would have said is anybody's guess, and where it lies shadows are near.
        let e: f32 = known().map(|(&s, w)| values[s].mean() * w).sum::<f32>() / sum;
        let buried = self.unresolved && self.slots.iter().any(|&s| !usable[s]);
        // So is what one beyond a wall would: the others may be as far from the place as it is.
        let silenced = self.spoken.map_or(0.0, |said| said.silenced);
        let guess = (GUESS * e).powi(2) * if buried { 1.0 } else { silenced };
        Doubt { mesh: doubt.mesh + guess, ..doubt }
    }

    /// Longest edge of the leaf, m: what is said of it changes little within that.
    pub fn extent(&self) -> f32 {
        if self.place == [0.0; 3] {
            return 0.0;
        }
        let [a, b, c] = self.solution.elements.corners(self.node);
        a.distance(b).max(b.distance(c)).max(c.distance(a))
    }

    fn interpolate(&self, values: &[Rgb]) -> Rgb {
        self.spoken.map_or(Rgb::BLACK, |said| (0..3).map(|i| values[self.slots[i]] * said.weights[i]).sum())
    }
}

impl Solution {
    pub(crate) fn new(
        refiner: Refiner,
        flags: Flags,
        direct: Vec<Rgb>,
        doubts: Vec<Doubt>,
        lights: Option<Lights>,
        caustics: Caustics,
        report: Report,
    ) -> Solution {
        let at_sites =
            AtSites { sources: refiner.field.sources, indirect: refiner.e, direct, doubts, lights };
        Solution::of_sites(refiner.elements, flags, at_sites, caustics, report)
    }

    /// From values at sites.
    pub(crate) fn of_sites(
        elements: Elements,
        flags: Flags,
        at_sites: AtSites,
        caustics: Caustics,
        report: Report,
    ) -> Solution {
        let sources = &at_sites.sources;
        Solution {
            values: sources.spread(&at_sites.indirect),
            usable: (0..sources.0.len()).into_par_iter().map(|s| sources.usable(s)).collect(),
            direct: sources.spread(&at_sites.direct),
            doubts: sources.spread(&at_sites.doubts),
            caustic_values: caustics.at_vertices(&elements, |slot| sources.usable(slot)),
            elements,
            flags,
            caustics,
            at_sites: Some(at_sites),
            report,
        }
    }

    /// From values at the slots of a mesh, as the classical methods have them: no leaf is known to be pierced or coarse.
    pub(crate) fn of_slots(
        elements: Elements,
        values: Vec<Rgb>,
        usable: Vec<bool>,
        direct: Vec<Rgb>,
        caustic_values: Vec<Rgb>,
        caustics: Caustics,
        report: Report,
    ) -> Solution {
        Solution {
            elements,
            values,
            usable,
            flags: Flags::default(),
            direct,
            doubts: Vec::new(),
            caustic_values,
            caustics,
            at_sites: None,
            report,
        }
    }

    /// What is known at barycentric (u, v) of scene triangle `triangle`, on one side.
    pub fn spot(&self, world: &World, triangle: u32, u: f32, v: f32, side: Side) -> Spot<'_> {
        if self.elements.piece(triangle).is_none() {
            let (node, slots) = (triangle, [0; 3]);
            return Spot { solution: self, node, slots, place: [0.0; 3], spoken: None, unresolved: false };
        }
        let (node, place) = self.elements.locate(triangle, u, v);
        let usable = |s: usize| self.usable[s];
        Spot {
            solution: self,
            node,
            slots: self.elements.nodes[node as usize].vertices.map(|v| slot(v, side)),
            place,
            spoken: visible_weights(world, &self.elements, &self.flags, usable, node, side, place),
            unresolved: self.flags.unresolved(node, side),
        }
    }

    /// [`Spot::irradiance`] at barycentric (u, v) of scene triangle `triangle`, on one side.
    pub fn irradiance(&self, world: &World, triangle: u32, u: f32, v: f32, side: Side) -> Rgb {
        self.spot(world, triangle, u, v, side).irradiance()
    }

    /// [`Spot::direct`] there.
    pub fn direct(&self, world: &World, triangle: u32, u: f32, v: f32, side: Side) -> Rgb {
        self.spot(world, triangle, u, v, side).direct()
    }

    /// [`Spot::caustic`] there.
    pub fn caustic(&self, world: &World, triangle: u32, u: f32, v: f32, side: Side) -> Rgb {
        self.spot(world, triangle, u, v, side).caustic()
    }

    /// Whether the mesh does not resolve the light at this place, and the one who asks should gather for itself.
    pub fn unresolved(&self, triangle: u32, u: f32, v: f32, side: Side) -> bool {
        let (node, _) = self.elements.locate(triangle, u, v);
        self.flags.unresolved(node, side)
    }

    /// The element mesh.
    pub fn elements(&self) -> &Elements {
        &self.elements
    }

    /// Positions of the vertices with their indirect irradiance on `side`, for charts and tests.
    pub fn vertices(&self, side: Side) -> impl Iterator<Item = (Vec3, Rgb)> + '_ {
        let value = move |(v, vertex): (usize, &crate::element::Vertex)| {
            let s = slot(v as u32, side);
            self.usable[s].then(|| (vertex.position, self.values[s]))
        };
        self.elements.vertices.iter().enumerate().filter_map(value)
    }
}
