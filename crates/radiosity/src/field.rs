//! Irradiance over the element mesh: gathered at sites, interpolated at the other vertices.

use crate::element::cluster::Grid;
use crate::element::{Elements, Side, Vertex, VertexId, slot};
use crate::transport::Row;
use geometry::math::offset_origin;
use geometry::{Ray, Rgb, World};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::iter::Sum;
use std::ops::{Add, Mul};

/// One side of one vertex where rays were gathered.
#[derive(Clone, Debug)]
pub struct Site {
    /// Which vertex.
    pub vertex: VertexId,
    /// Which side of it.
    pub side: Side,
    /// What was gathered.
    pub row: Row,
    /// Estimated variance of its value (mean of the channels), lx²: of the light that emitters throw on what it sees
    /// only, until the rest is solved for.
    pub variance: f32,
}

/// Where a slot's value comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Source {
    /// Light cannot reach it, or it is buried in something: it says nothing about its surroundings.
    Nothing,
    /// It was gathered.
    Site(u32),
    /// Interpolated from sites near by; weights sum to 1, unused ones are 0.
    Near([u32; 4], [f32; 4]),
    /// In the middle of an edge that promised no change on this side: the mean of the slots at its ends.
    Between(u32, u32),
}

/// Where every slot's value comes from.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Sources(pub(crate) Vec<Source>);

impl Sources {
    /// Whether the slot has a value that its surroundings may be interpolated from.
    pub(crate) fn usable(&self, slot: usize) -> bool {
        !matches!(self.0[slot], Source::Nothing)
    }

    /// From a value at each site to a value at each slot.
    pub(crate) fn spread<T>(&self, e: &[T]) -> Vec<T>
    where
        T: Copy + Default + Send + Sync + Add<Output = T> + Mul<f32, Output = T> + Sum,
    {
        let value = |source: &Source| match source {
            Source::Nothing | Source::Between(..) => T::default(),
            Source::Site(i) => e[*i as usize],
            Source::Near(sites, weights) => {
                sites.iter().zip(weights).filter(|(_, w)| **w > 0.0).map(|(&i, &w)| e[i as usize] * w).sum()
            }
        };
        let mut values: Vec<T> = self.0.par_iter().map(value).collect();
        // The ends of an edge are older than its middle, so they have their values by now.
        for (slot, source) in self.0.iter().enumerate() {
            if let Source::Between(a, b) = *source {
                values[slot] = (values[a as usize] + values[b as usize]) * 0.5;
            }
        }
        values
    }

    /// The transpose of [`Sources::spread`]: from a share of each slot to a share of each of `sites`.
    pub(crate) fn collect(&self, mut slots: Vec<f64>, sites: usize) -> Vec<f64> {
        let mut shares = vec![0.0; sites];
        // The middle of an edge is younger than its ends.
        for (slot, source) in self.0.iter().enumerate().rev() {
            let share = slots[slot];
            match source {
                Source::Nothing => {}
                Source::Site(i) => shares[*i as usize] += share,
                Source::Near(near, weights) => {
                    near.iter().zip(weights).for_each(|(&i, &w)| shares[i as usize] += share * f64::from(w));
                }
                Source::Between(a, b) => {
                    slots[*a as usize] += 0.5 * share;
                    slots[*b as usize] += 0.5 * share;
                }
            }
        }
        shares
    }
}

/// Sites, and how every vertex draws on them.
#[derive(Clone, Debug, Default)]
pub struct Field {
    /// In the order in which they were gathered.
    pub sites: Vec<Site>,
    pub(crate) sources: Sources,
    /// The ends of the edge in whose middle a vertex was put, for those that came by refinement.
    parents: HashMap<VertexId, [VertexId; 2]>,
    /// Sites that `sources` know of.
    connected: usize,
    /// For each slot, the squared distance within which a new site would change its source.
    reach: Vec<f32>,
}

/// Lift of a line between two vertices, in units of its length: where their normals agree, and for each unit between these,
/// for an arc rises above its chord by an eighth of the angle. At 0.3 everywhere a wall heard of its light from the front
/// of a picture that hangs two centimetres before it.
const LIFT: f32 = 0.02;
const LIFT_OF_ARCS: f32 = 0.3;

/// A site most of whose rays first meet a dead side is buried in an object.
pub(crate) const BURIED: f32 = 0.5;

impl Field {
    /// Whether the slot has a value that its surroundings may be interpolated from.
    pub fn usable(&self, slot: usize) -> bool {
        self.sources.usable(slot)
    }

    /// Remembers that `vertex` was put in the middle of the edge between `ends`.
    pub fn put_between(&mut self, vertex: VertexId, ends: [VertexId; 2]) {
        self.parents.insert(vertex, ends);
    }

    /// From a value at each site to a value at each slot.
    pub fn spread(&self, e: &[Rgb]) -> Vec<Rgb> {
        self.sources.spread(e)
    }

    /// Estimated variance of a slot's value (mean of the channels) from the rays that were gathered, lx².
    pub fn variance(&self, slot: usize) -> f32 {
        match &self.sources.0[slot] {
            Source::Nothing => 0.0,
            Source::Site(i) => self.sites[*i as usize].variance,
            Source::Near(sites, weights) => {
                sites.iter().zip(weights).map(|(&i, w)| w * w * self.sites[i as usize].variance).sum()
            }
            Source::Between(a, b) => 0.25 * (self.variance(*a as usize) + self.variance(*b as usize)),
        }
    }

    /// The site that a slot draws on most.
    pub fn loudest(&self, slot: usize) -> Option<u32> {
        match &self.sources.0[slot] {
            Source::Nothing => None,
            Source::Site(i) => Some(*i),
            Source::Near(sites, weights) => {
                let best = (0..4).max_by(|&a, &b| weights[a].total_cmp(&weights[b]).then(b.cmp(&a)))?;
                Some(sites[best])
            }
            Source::Between(a, _) => self.loudest(*a as usize),
        }
    }

    /// Largest difference (mean of the channels) among the sites that a slot is interpolated from; 0 for one of its own.
    pub fn spread_around(&self, slot: usize, e: &[Rgb]) -> f32 {
        let Source::Near(sites, weights) = &self.sources.0[slot] else { return 0.0 };
        let around =
            || sites.iter().zip(weights).filter(|(_, w)| **w > 0.0).map(|(&i, _)| e[i as usize].mean());
        around().fold(0.0, f32::max) - around().fold(f32::INFINITY, f32::min).min(f32::MAX)
    }

    /// Finds for every slot where its value comes from, after sites were added or the mesh was refined.
    ///
    /// `radius` is the reach of a site ([`crate::element::cluster`]), the same each time: where no site came within it,
    /// nothing changes.
    pub fn connect(&mut self, world: &World, elements: &Elements, radius: f32) {
        let vertices = &elements.vertices;
        let grids = || [Grid::new(radius), Grid::new(radius)];
        let (mut all, mut new) = (grids(), grids());
        // Where a new site may be near, on each side.
        let mut touched = [HashSet::new(), HashSet::new()];
        let mut site_of = vec![u32::MAX; 2 * vertices.len()];
        for (i, site) in self.sites.iter().enumerate() {
            site_of[slot(site.vertex, site.side)] = i as u32;
            if site.row.dead <= BURIED {
                all[site.side.index()].insert(vertices, site.vertex);
                if i >= self.connected {
                    new[site.side.index()].insert(vertices, site.vertex);
                    let at = vertices[site.vertex as usize].position;
                    touched[site.side.index()].extend(all[0].cells_around(at));
                }
            }
        }
        self.connected = self.sites.len();
        let known = |s: usize| self.reach.get(s).map(|&reach| (self.sources.0[s], reach));
        let of = |s: usize| {
            let (v, side) = ((s / 2) as VertexId, Side::BOTH[s % 2]);
            match site_of[s] {
                u32::MAX if self.parents.contains_key(&v) => (Source::Nothing, 0.0), // see below
                u32::MAX => {
                    let at = &vertices[s / 2];
                    let nearer = |reach: f32| {
                        touched[s % 2].contains(&all[0].cell(at.position))
                            && new[s % 2].near(vertices, at).any(|n| n.1 <= reach)
                    };
                    match known(s) {
                        Some((source, reach)) if !nearer(reach) => (source, reach),
                        _ => near(world, vertices, &all[s % 2], &site_of, v, side),
                    }
                }
                i if self.sites[i as usize].row.dead > BURIED => (Source::Nothing, 0.0),
                i => (Source::Site(i), 0.0),
            }
        };
        let (sources, reach) = (0..site_of.len()).into_par_iter().map(of).unzip();
        self.reach = reach;
        self.sources = Sources(sources);
        for (s, &site) in site_of.iter().enumerate() {
            let Some(ends) = self.parents.get(&((s / 2) as VertexId)) else { continue };
            if site == u32::MAX {
                let [a, b] = ends.map(|v| 2 * v + (s % 2) as u32);
                self.sources.0[s] = match (self.usable(a as usize), self.usable(b as usize)) {
                    (true, true) => Source::Between(a, b),
                    (true, false) => Source::Between(a, a),
                    (false, true) => Source::Between(b, b),
                    (false, false) => Source::Nothing,
                };
            }
        }
    }
}

/// Up to four of the sites near `v`, those that it can see, by inverse distance (Franke and Little's weights, which
/// fall to zero at the edge of the search so that the choice of four leaves no jump); and the edge of the search, squared.
fn near(
    world: &World,
    vertices: &[Vertex],
    grid: &Grid,
    site_of: &[u32],
    v: VertexId,
    side: Side,
) -> (Source, f32) {
    let at = &vertices[v as usize];
    let mut best = [(f32::INFINITY, VertexId::MAX); 5];
    for (other, d2) in grid.near(vertices, at) {
        if (d2, other) < best[4] {
            best[4] = (d2, other);
            best.sort_by(|a, b| a.partial_cmp(b).expect("distances are numbers"));
        }
    }
    let reach = best[4].0.min(1.0);
    let edge = reach.sqrt();
    let (mut sites, mut weights) = ([0; 4], [0.0; 4]);
    for (k, &(d2, other)) in best[..4].iter().enumerate() {
        if other == VertexId::MAX || !sees(world, at, &vertices[other as usize], side) {
            continue;
        }
        let d = d2.sqrt().max(1e-4);
        sites[k] = site_of[slot(other, side)];
        weights[k] = ((edge * 1.0001 - d).max(1e-6 * edge) / (edge * d)).powi(2);
    }
    let sum: f32 = weights.iter().sum();
    if sum <= 0.0 {
        return (Source::Nothing, reach);
    }
    (Source::Near(sites, weights.map(|w| w / sum)), reach)
}

/// Whether nothing stands between two vertices. The line is lifted by some of its length, more where the surface is
/// curved, for there the chord runs through the solid.
fn sees(world: &World, a: &Vertex, b: &Vertex, side: Side) -> bool {
    let lift =
        |v: &Vertex, d: f32| offset_origin(v.position, v.normal * side.sign()) + v.normal * (side.sign() * d);
    let lifted = LIFT + LIFT_OF_ARCS * a.normal.distance(b.normal);
    let d = (lifted * a.position.distance(b.position)).max(1e-4 * world.scale);
    let (from, to) = (lift(a, d), lift(b, d));
    let length = from.distance(to);
    if length <= 0.0 {
        return true;
    }
    let ray = Ray { t_max: length, ..Ray::new(from, (to - from) / length) };
    !world.bvh.occluded(&ray)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::{Material, MaterialId, Mesh, Scene, Vec3};

    /// Squares around the z axis, facing along it: half their sides and their heights, m.
    fn squares(all: &[(f32, f32)]) -> World {
        let mut mesh = Mesh::default();
        for &(r, z) in all {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend([(-r, -r), (r, -r), (r, r), (-r, r)].map(|(x, y)| Vec3::new(x, y, z)));
            mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
        mesh.normals = vec![Vec3::Z; mesh.positions.len()];
        mesh.materials = vec![MaterialId(0); mesh.triangles.len()];
        World::new(Scene { mesh, materials: vec![Material::default()], ..Scene::default() })
    }

    #[test]
    fn a_wall_does_not_hear_of_the_light_before_a_picture_on_it() {
        let world = squares(&[(1.0, 0.0), (0.3, 0.02)]);
        let at =
            |x: f32, z: f32| Vertex { position: Vec3::new(x, 0.0, z), normal: Vec3::Z, piece: 0, face: 0 };
        let sees = |a: Vertex, b: Vertex| sees(&world, &a, &b, Side::Front);
        assert!(!sees(at(0.25, 0.0), at(0.15, 0.02)), "through the picture");
        assert!(sees(at(0.4, 0.0), at(0.6, 0.0)), "along the wall");
        assert!(sees(at(0.1, 0.02), at(0.25, 0.02)), "along the picture");
    }

    #[test]
    fn collecting_is_the_transpose_of_spreading() {
        let sources = Sources(vec![
            Source::Site(1),
            Source::Nothing,
            Source::Near([0, 2, 0, 0], [0.25, 0.75, 0.0, 0.0]),
            Source::Site(0),
            Source::Between(0, 2),
            Source::Between(4, 3),
        ]);
        let (e, shares) = ([1.0, 10.0, 100.0], [1.0, 2.0, 3.0, 5.0, 7.0, 11.0f64]);
        let spread = sources.spread(&e.map(Rgb::splat));
        let there: f64 = spread.iter().zip(shares).map(|(v, share)| f64::from(v.g) * share).sum();
        let back: f64 = sources.collect(shares.into(), 3).iter().zip(e).map(|(s, e)| s * f64::from(e)).sum();
        assert!((there - back).abs() < 1e-4 * there, "{there} {back}");
    }
}
