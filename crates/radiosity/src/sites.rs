//! Gathering at the vertices of the element mesh: where the rays start, and how many they are.

use crate::element::{Side, VertexId, slot};
use crate::field::{BURIED, Site};
use crate::gather::{self, Origin};
use crate::noise::{Witness, hearsay};
use crate::refine::{INWARD, Refiner};
use crate::solve::lock;
use crate::transport::Row;
use geometry::sampling::Lattice2;
use geometry::{LightGroups, Rgb, triangle};
use rayon::prelude::*;
use std::collections::HashMap;

/// Origins that one vertex's rays are shared among, at most.
const FACETS: usize = 16;
/// Light samples that tell how bright a site is besides what it gathers.
const GLANCES: u32 = 16;
/// Times the rays of all that a site may get where there is noise.
const MOST_RAYS: u32 = 16;
/// Rows in one record of a journal: what is lost when a solve is cut off.
const RECORD: usize = 256;

impl Refiner<'_> {
    /// Gathers at those sides of the vertices that are named, as far as light reaches them; connects the field anew.
    pub(crate) fn gather(&mut self, wanted: &[(VertexId, [bool; 2])]) {
        let origins = self.origins(wanted.iter().map(|w| w.0));
        let jobs: Vec<(VertexId, Side)> = wanted
            .iter()
            .flat_map(|&(v, sides)| Side::BOTH.map(|side| (v, side, sides[side.index()])))
            .filter(|&(.., wanted)| wanted)
            .map(|(v, side, _)| (v, side))
            .filter(|&(v, side)| self.reach.alive(self.elements.vertices[v as usize].face, side))
            .filter(|(v, _)| origins.contains_key(v))
            .collect();
        let lit = self.glance(&jobs, &origins);
        let mut rows = self.gather_rows(&jobs, &origins, |i| self.rays_for(slot(jobs[i].0, jobs[i].1)));
        for _ in 0..2 {
            let wanted = self.rays_wanted(&jobs, &rows, &lit);
            let which: Vec<usize> = (0..rows.len()).filter(|&i| wanted[i] > rows[i].rays).collect();
            if which.is_empty() || self.progress.stopped() {
                break;
            }
            let again: Vec<(VertexId, Side)> = which.iter().map(|&i| jobs[i]).collect();
            let new = self.gather_rows(&again, &origins, |i| wanted[which[i]]);
            for (i, row) in which.into_iter().zip(new) {
                rows[i] = row;
            }
        }
        self.lit.extend(lit);
        self.e.extend(rows.iter().map(|row| row.direct));
        let sites = jobs.into_iter().zip(rows).map(|((vertex, side), row)| Site {
            vertex,
            side,
            variance: row.variance,
            row,
        });
        self.field.sites.extend(sites);
        self.field.connect(self.world, &self.elements, self.radius);
    }

    /// About the direct irradiance at `jobs`, lx: see [`Refiner::lit`].
    fn glance(&self, jobs: &[(VertexId, Side)], origins: &HashMap<VertexId, Vec<Origin>>) -> Vec<Rgb> {
        if self.importance.is_none() {
            return vec![Rgb::BLACK; jobs.len()];
        }
        let at = |&(vertex, side): &(VertexId, Side)| {
            let turned = turned(&origins[&vertex], side);
            let normal = self.elements.vertices[vertex as usize].normal * side.sign();
            let stream = slot(vertex, side) as u64;
            gather::direct(self.world, &turned, normal, GLANCES, !self.config.seed, stream, |_, _| ())
        };
        jobs.par_iter().map(at).collect()
    }

    /// Rays that each of `jobs` should have by what is known after `rows`: as many as it has, or up to [`MOST_RAYS`] times as
    /// many as all get where the neighbours' are noisy.
    fn rays_wanted(&self, jobs: &[(VertexId, Side)], rows: &[Row], lit: &[Rgb]) -> Vec<u32> {
        let new = || jobs.iter().zip(rows).map(|(&(v, side), row)| (v, side, row));
        let before = || self.field.sites.iter().map(|s| (s.vertex, s.side, &s.row));
        let around = self.levels(before().chain(new()).map(|(v, side, row)| (v, side, row.direct.mean())));
        // What is buried sees no light, and tells nothing of it.
        let mut number = vec![usize::MAX; jobs.len()];
        let mut witnesses = Vec::new();
        for (i, (v, side, row)) in new().chain(before()).enumerate() {
            if row.dead > BURIED {
                continue;
            }
            if let Some(number) = number.get_mut(i) {
                *number = witnesses.len();
            }
            let vertex = &self.elements.vertices[v as usize];
            witnesses.push(Witness {
                position: vertex.position,
                normal: vertex.normal * side.sign(),
                direct: row.direct,
                variance: row.variance,
                rays: row.rays,
            });
        }
        let heard = hearsay(&witnesses, self.world.scale);
        let wanted = |i: usize| {
            let (mut rays, (v, side)) = (rows[i].rays, jobs[i]);
            let Some(heard) = heard.get(number[i]) else { return rays };
            let s = slot(v, side);
            let allowed =
                self.config.noise * (heard.direct + lit[i].mean() + 0.1 * around[self.face_slot(s)]);
            let noisy = |rays| self.weight(s) * heard.variance(rays).sqrt() > allowed;
            while rays < MOST_RAYS * self.config.rays && noisy(rays) {
                rays *= 2;
            }
            rays
        };
        (0..jobs.len()).map(wanted).collect()
    }

    /// Rays that a slot gets at first. What nobody sees is averaged over many sites before it shows.
    fn rays_for(&self, slot: usize) -> u32 {
        const LEAST: u32 = 32;
        let all = self.config.rays;
        ((all as f32 * self.weight(slot).min(1.0)) as u32).next_multiple_of(16).max(LEAST.min(all))
    }

    /// Rows of as many rays as `rays` says for the job of each number, fewer where landings would take more memory than they may.
    fn gather_rows(
        &self,
        jobs: &[(VertexId, Side)],
        origins: &HashMap<VertexId, Vec<Origin>>,
        rays: impl Fn(usize) -> u32 + Sync,
    ) -> Vec<Row> {
        let held: usize = self.field.sites.iter().map(|s| s.row.landings.len()).sum();
        let room = self.config.most_landings.saturating_sub(held) / jobs.len().max(1);
        let room = u32::try_from(room).unwrap_or(u32::MAX);
        let rays: Vec<u32> = (0..jobs.len()).map(|i| rays(i).min(room).max(16)).collect();
        let mut patterns: HashMap<u32, Lattice2> = HashMap::new();
        for &n in &rays {
            patterns.entry(n).or_insert_with(|| Lattice2::new(n));
        }
        self.progress.stage("gathering", jobs.len() as u64);
        let dead =
            |t: u32, side: Side| self.elements.face(t).is_none_or(|face| !self.reach.alive(face, side));
        let gather = |(&(vertex, side), &rays): (&(VertexId, Side), &u32)| {
            let turned = turned(&origins[&vertex], side);
            let normal = self.elements.vertices[vertex as usize].normal * side.sign();
            // Another number of rays draws other numbers: a row that is done again shares nothing with the first.
            let stream = (u64::from(rays) << 40) ^ slot(vertex, side) as u64;
            let (pattern, seed) = (&patterns[&rays], self.config.seed);
            let row =
                gather::row(self.world, &turned, normal, pattern, seed, stream, dead, self.groups.as_ref());
            self.progress.advance(1);
            row
        };
        let Some(journal) = self.journal else { return jobs.par_iter().zip(&rays).map(gather).collect() };
        let mut rows = Vec::with_capacity(jobs.len());
        for (jobs, rays) in jobs.chunks(RECORD).zip(rays.chunks(RECORD)) {
            let known = lock(journal).recall(jobs.len());
            rows.extend(known.unwrap_or_else(|| {
                let new: Vec<Row> = jobs.par_iter().zip(rays).map(gather).collect();
                lock(journal).keep(&new);
                new
            }));
        }
        rows
    }

    /// For each of `vertices`, points just inside the facets around it.
    fn origins(&self, vertices: impl Iterator<Item = VertexId>) -> HashMap<VertexId, Vec<Origin>> {
        let mut wanted = vec![false; self.elements.vertices.len()];
        for v in vertices {
            wanted[v as usize] = true;
        }
        let mut origins: HashMap<VertexId, Vec<Origin>> = HashMap::new();
        for leaf in self.elements.leaves() {
            let corners = self.elements.corners(leaf);
            for (k, v) in self.elements.nodes[leaf as usize].vertices.into_iter().enumerate() {
                if !wanted[v as usize] {
                    continue;
                }
                let around = origins.entry(v).or_default();
                if around.len() < FACETS {
                    let [a, b, c] = [corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]];
                    let position = a + ((b - a) + (c - a)) * INWARD;
                    around.push(Origin { position, ng: triangle::normal(a, b, c) });
                }
            }
        }
        origins
    }

    /// Whether the middle of a leaf is lit quite otherwise than its corners say: a panel whose edges all lie behind a
    /// frame looks dark to tests along its edges. A few rays, for coarse differences only.
    pub(crate) fn surprises(&self, leaf: u32, values: &[Rgb], floor: f32, pattern: &Lattice2) -> bool {
        let corners = self.elements.corners(leaf);
        let vertices = self.elements.nodes[leaf as usize].vertices;
        let ng = triangle::normal(corners[0], corners[1], corners[2]);
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let normals = vertices.map(|v| self.elements.vertices[v as usize].normal);
        let smooth = (normals[0] + normals[1] + normals[2]).normalize_or(ng);
        let dead =
            |t: u32, side: Side| self.elements.face(t).is_none_or(|face| !self.reach.alive(face, side));
        Side::BOTH.iter().filter(|&&side| self.reach.alive(self.elements.face_of(leaf), side)).any(|&side| {
            let origins = [Origin { position: middle, ng: ng * side.sign() }];
            let stream = (1 << 62) | slot(leaf, side) as u64;
            let normal = smooth * side.sign();
            let row =
                gather::row(self.world, &origins, normal, pattern, self.config.seed, stream, dead, None);
            if row.dead > 0.5 {
                return false; // the middle is buried
            }
            let mut got = row.direct;
            for landing in row.landings.iter() {
                let (node, side, w) = landing.locate(&self.elements);
                let corners = self.elements.nodes[node as usize].vertices;
                got += landing.weight() * (0..3).map(|i| values[slot(corners[i], side)] * w[i]).sum::<Rgb>();
            }
            let known = vertices.map(|v| slot(v, side)).into_iter().filter(|&s| self.field.usable(s));
            let (sum, count) = known.fold((Rgb::BLACK, 0.0), |(s, n), slot| (s + values[slot], n + 1.0));
            if count == 0.0 {
                return true; // no corner knows anything of it
            }
            let predicted = sum.mean() / count;
            let off = (got.mean() - predicted).abs();
            // Twice as bright or half as dark, and beyond two standard errors of so few rays.
            off > 0.5 * (predicted + floor) && off * off > 4.0 * row.variance
        })
    }

    /// Direct irradiance at every site, lx, by `samples` light samples; and the parts of each group of lights, where these
    /// are kept apart.
    pub(crate) fn direct(&self, samples: u32) -> (Vec<Rgb>, Vec<Vec<Rgb>>) {
        let origins = self.origins(self.field.sites.iter().map(|s| s.vertex));
        let groups = self.groups.as_ref();
        let count = groups.map_or(0, LightGroups::len);
        let at_sites: Vec<(Rgb, Vec<Rgb>)> = self
            .field
            .sites
            .par_iter()
            .map(|site| {
                let mut parts = vec![Rgb::BLACK; count];
                let v = &self.elements.vertices[site.vertex as usize];
                let Some(origins) = origins.get(&site.vertex) else { return (Rgb::BLACK, parts) };
                let turned = turned(origins, site.side);
                let (normal, stream) = (v.normal * site.side.sign(), slot(site.vertex, site.side) as u64);
                let lit = |light, brought| {
                    if let Some(groups) = groups {
                        parts[groups.of_light(light)] += brought;
                    }
                };
                let all = gather::direct(self.world, &turned, normal, samples, self.config.seed, stream, lit);
                (all, parts)
            })
            .collect();
        let parts = (0..count).map(|g| at_sites.iter().map(|s| s.1[g]).collect()).collect();
        (at_sites.iter().map(|s| s.0).collect(), parts)
    }
}

/// The origins seen from `side`.
fn turned(origins: &[Origin], side: Side) -> Vec<Origin> {
    origins.iter().map(|o| Origin { ng: o.ng * side.sign(), ..*o }).collect()
}
