//! Finer where E bends: gather at the midpoint of an edge, compare with what its ends predict, go on where it differs.
//!
//! Two kinds of vertices are tested alike. The midpoint of a long edge is new; in finely tessellated surface, where
//! one site speaks for many vertices, the one furthest from its site is. A tested vertex stays a site in either case.

use crate::element::cluster::{self, distance2};
use crate::element::{EdgeMarks, Elements, Side, VertexId, slot};
use crate::field::{Field, Site};
use crate::flags::{Flags, visible_weights};
use crate::gather::{self, Origin};
use crate::reach::Reach;
use crate::solve::{Config, Progress};
use crate::solver::{self, Convergence, Gain};
use crate::transport::{Landing, Row, Transport};
use geometry::math::offset_origin;
use geometry::sampling::Lattice2;
use geometry::{Ray, Rgb, World, triangle};
use rayon::prelude::*;
use std::collections::HashMap;

/// A midpoint this far (relative) from its prediction, at the finest mesh, marks its surroundings for a gather of
/// their own in pass 2.
const ROUGH: f32 = 0.15;
/// Origins that one vertex's rays are shared among, at most.
const FACETS: usize = 16;
/// A gather ray starts this share of the way from its vertex into a facet: a vertex in the corner of a room lies on
/// the walls, and a ray from there may start on the wrong side of one.
const INWARD: f32 = 0.02;

/// The element mesh with everything gathered on it.
pub(crate) struct Refiner<'a> {
    world: &'a World,
    config: &'a Config,
    progress: &'a dyn Progress,
    pub(crate) elements: Elements,
    pub(crate) reach: Reach,
    pub(crate) field: Field,
    /// E at the sites, lx.
    pub(crate) e: Vec<Rgb>,
    /// For each piece, whether any of it reflects diffusely: mirrors and glass need no irradiance.
    diffuse: Vec<bool>,
    /// Vertices whose surroundings the mesh does not resolve.
    pub(crate) unresolved: Vec<VertexId>,
    /// Longest edge of the first mesh, m.
    h0: f32,
    /// Shortest edge worth splitting to, m.
    h_min: f32,
    /// Reach of a site in finely tessellated surface, m.
    radius: f32,
}

/// A vertex gathered to be compared with a prediction.
struct Test {
    vertex: VertexId,
    /// What predicted it: vertices and their weights.
    from: Vec<(VertexId, f32)>,
    /// Length of surface that the prediction stands for, m.
    length: f32,
    /// Something stands between the predictors.
    parted: bool,
}

impl<'a> Refiner<'a> {
    /// The first mesh: no edge longer than h0, sites where clusters of vertices need them, all gathered.
    pub(crate) fn start(world: &'a World, config: &'a Config, progress: &'a dyn Progress) -> Refiner<'a> {
        let scale = world.diagonal;
        let (h0, h_min, radius) = (config.h0 * scale, config.h_min * scale, config.cluster_radius * scale);
        let mut elements = Elements::new(&world.scene.mesh);
        let most = config.most_vertices.max(2 * elements.vertices.len());
        elements.split_longer_than(h0, most);
        let reach = Reach::explore(world, &elements, config.seed);
        let mut diffuse = vec![false; elements.pieces as usize];
        for (t, material) in world.scene.mesh.materials.iter().enumerate() {
            if let Some(piece) = elements.piece(t as u32) {
                diffuse[piece as usize] |= world.scene.materials[material.0 as usize].may_be_diffuse();
            }
        }
        let mut refiner = Refiner {
            diffuse,
            world,
            config,
            progress,
            elements,
            reach,
            field: Field::default(),
            e: Vec::new(),
            unresolved: Vec::new(),
            h0,
            h_min,
            radius,
        };
        let used = refiner.used();
        let chosen = cluster::spread_out(
            &refiner.elements.vertices,
            (0..used.len() as VertexId).filter(|&v| used[v as usize]),
            radius,
        );
        refiner.gather(&chosen);
        refiner
    }

    /// Tests and refines until the tolerance, the finest edge, the sites, the rounds or the time run out.
    pub(crate) fn refine(&mut self) {
        self.settle();
        let mut edges = self.edges_longer_than(self.radius.max(2.0 * self.h_min), |_| true);
        let mut clusters = Clusters::new(self);
        let mut open: Vec<usize> = (0..clusters.members.len()).collect();
        // Vertices far from their prediction around which nothing finer was tested.
        let mut rough = vec![false; self.elements.vertices.len()];
        for round in 0..self.config.rounds {
            if self.progress.stopped() {
                break;
            }
            let left = self.config.most_sites.saturating_sub(self.field.sites.len());
            // The first rounds may not use up what later ones need to go deep.
            let room = if round + 1 < self.config.rounds { left / 2 } else { left };
            let (chosen, kept, members) = self.choose(&edges, clusters.furthest(self, &open), room);
            if chosen.is_empty() && members.is_empty() {
                break;
            }
            for &(a, b) in &chosen {
                (rough[a as usize], rough[b as usize]) = (false, false);
            }
            let mut tests = self.split(&chosen);
            tests.extend(members.iter().map(|&(c, vertex, length)| Test {
                vertex,
                from: vec![(clusters.members[c].0, 1.0)],
                length,
                parted: false,
            }));
            self.gather(&tests.iter().map(|t| t.vertex).collect::<Vec<_>>());
            self.settle();
            let values = self.field.spread(&self.e);
            let floor = 0.1 * mean(&self.e).mean();
            let errors: Vec<f32> = tests.iter().map(|t| self.error(t, &values, floor)).collect();
            rough.resize(self.elements.vertices.len(), false);
            let mut failed = vec![false; self.elements.vertices.len()];
            for (test, &error) in tests.iter().zip(&errors) {
                let weighed = error * test.length / self.h0;
                // What stands on an edge is worth a quarter of the tolerance: the light may be even all the same.
                failed[test.vertex as usize] =
                    weighed > self.config.tolerance * if test.parted { 0.25 } else { 1.0 };
                rough[test.vertex as usize] = error > ROUGH;
            }
            edges = self.edges_longer_than(2.0 * self.h_min, |v| failed[v as usize]);
            edges.extend(kept);
            edges.sort_unstable();
            edges.dedup();
            open = clusters.divide(self, &members, &failed);
        }
        self.unresolved = (0..rough.len() as VertexId).filter(|&v| rough[v as usize]).collect();
    }

    /// Of the edges and the clusters' furthest members, at most `room` that promise most: those along which E changes,
    /// the longer the more. Also the promising edges for which there is no room.
    #[allow(clippy::type_complexity)]
    fn choose(
        &self,
        edges: &[(VertexId, VertexId)],
        members: Vec<Member>,
        room: usize,
    ) -> (Vec<(VertexId, VertexId)>, Vec<(VertexId, VertexId)>, Vec<Member>) {
        // Two ends that agree may still hide a bend between them: a tenth of what is there, and of what is elsewhere. So
        // a panel whose corners lie dark behind a frame is looked at too.
        const HIDDEN: f32 = 0.1;
        let values = self.field.spread(&self.e);
        let floor = 0.1 * mean(&self.e).mean();
        let everywhere = mean(&self.e).mean();
        let promise = |difference: f32, level: f32| {
            (difference + HIDDEN * (level + everywhere)) / (level + floor).max(1e-30)
        };
        let change = |a: VertexId, b: VertexId| {
            let of = |side: Side| {
                let (sa, sb) = (slot(a, side), slot(b, side));
                match (self.field.usable(sa), self.field.usable(sb)) {
                    (true, true) => {
                        let (va, vb) = (values[sa], values[sb]);
                        promise((va - vb).map(f32::abs).mean(), 0.5 * (va + vb).mean())
                    }
                    // A buried end says nothing of the rest.
                    _ => 1.0,
                }
            };
            let piece = self.elements.vertices[a as usize].piece;
            let lit = |side: &&Side| self.reach.alive(piece, **side);
            Side::BOTH.iter().filter(lit).map(|&side| of(side)).fold(0.0, f32::max)
        };
        let around = |v: VertexId| {
            let of = |&side: &Side| {
                let s = slot(v, side);
                promise(self.field.spread_around(s, &self.e), values[s].mean())
            };
            Side::BOTH.iter().filter(|&&side| self.field.usable(slot(v, side))).map(of).fold(0.0, f32::max)
        };
        let position = |v: VertexId| self.elements.vertices[v as usize].position;
        let score = |promise: f32, length: f32| promise * length / self.h0;
        let mut all: Vec<(f32, usize)> = edges
            .par_iter()
            .map(|&(a, b)| score(change(a, b), position(a).distance(position(b))))
            .chain(members.par_iter().map(|&(_, v, length)| score(around(v), length)))
            .enumerate()
            .map(|(i, s)| (s, i))
            .filter(|&(s, _)| s > self.config.tolerance)
            .collect();
        all.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let kept = all.split_off(room.min(all.len()));
        let edge = |&(_, i): &(f32, usize)| edges.get(i).copied();
        let member = |&(_, i): &(f32, usize)| i.checked_sub(edges.len()).map(|m| members[m]);
        (
            all.iter().filter_map(edge).collect(),
            kept.iter().filter_map(edge).collect(),
            all.iter().filter_map(member).collect(),
        )
    }

    /// Relative difference of what was gathered from what was predicted, the worse side.
    fn error(&self, test: &Test, values: &[Rgb], floor: f32) -> f32 {
        Side::BOTH
            .iter()
            .filter(|&&side| self.field.usable(slot(test.vertex, side)))
            .map(|&side| {
                let got = values[slot(test.vertex, side)];
                let known = test.from.iter().filter(|(v, _)| self.field.usable(slot(*v, side)));
                let (sum, weight, known_variance) =
                    known.fold((Rgb::BLACK, 0.0, 0.0), |(s, w, n), &(v, k)| {
                        let slot = slot(v, side);
                        (s + values[slot] * k, w + k, n + k * k * self.field.variance(slot))
                    });
                if weight <= 0.0 {
                    return 1.0; // nothing around it speaks for it
                }
                let predicted = sum / weight;
                let difference = (got - predicted).map(f32::abs).mean();
                // What the rays' own noise explains is no bend of the light.
                let noise = known_variance / (weight * weight) + self.field.variance(slot(test.vertex, side));
                let bend = (difference * difference - noise).max(0.0).sqrt();
                bend / (0.5 * (got + predicted).mean() + floor).max(1e-30)
            })
            .fold(0.0, f32::max)
    }

    /// Splits the edges; each midpoint is a test.
    fn split(&mut self, edges: &[(VertexId, VertexId)]) -> Vec<Test> {
        let mut marks = EdgeMarks::default();
        let room = self.config.most_vertices.saturating_sub(self.elements.vertices.len());
        for &(a, b) in edges.iter().take(room) {
            marks.mark(a, b);
        }
        self.elements.split(&mut marks);
        let midpoints = marks.split_edges();
        let test = |&(a, b, m): &(VertexId, VertexId, VertexId)| Test {
            vertex: m,
            from: vec![(a, 0.5), (b, 0.5)],
            length: self.elements.vertices[a as usize]
                .position
                .distance(self.elements.vertices[b as usize].position),
            parted: self.parted(a, b),
        };
        midpoints.par_iter().map(test).collect()
    }

    /// Whether something stands on the edge from `a` to `b`, on a side that light reaches.
    fn parted(&self, a: VertexId, b: VertexId) -> bool {
        let (a, b) = (&self.elements.vertices[a as usize], &self.elements.vertices[b as usize]);
        Side::BOTH.iter().filter(|&&side| self.reach.alive(a.piece, side)).any(|&side| {
            let lift = 1e-4 * self.world.diagonal * side.sign();
            let (from, to) = (a.position + a.normal * lift, b.position + b.normal * lift);
            let length = from.distance(to);
            // The ends often lie in a wall's plane: leave them out.
            let ray =
                Ray { t_min: 0.01 * length, t_max: 0.99 * length, ..Ray::new(from, (to - from) / length) };
            length > 0.0 && self.world.bvh.occluded(&ray)
        })
    }

    /// Which vertices a leaf that reflects diffusely uses.
    fn used(&self) -> Vec<bool> {
        let mut used = vec![false; self.elements.vertices.len()];
        for leaf in self.elements.leaves().filter(|&leaf| self.diffuse[self.elements.piece_of(leaf)]) {
            for v in self.elements.nodes[leaf as usize].vertices {
                used[v as usize] = true;
            }
        }
        used
    }

    /// Edges of leaves that are longer than `length` and have an end that `wanted` names; each once, in order.
    fn edges_longer_than(&self, length: f32, wanted: impl Fn(VertexId) -> bool) -> Vec<(VertexId, VertexId)> {
        let mut edges = Vec::new();
        for leaf in self.elements.leaves() {
            let node = &self.elements.nodes[leaf as usize];
            let corners = self.elements.corners(leaf);
            let piece = self.elements.vertices[node.vertices[0] as usize].piece;
            let lit = Side::BOTH.iter().any(|&side| self.reach.alive(piece, side));
            if !lit || !self.diffuse[piece as usize] {
                continue;
            }
            for e in 0..3 {
                let (a, b) = (node.vertices[e], node.vertices[(e + 1) % 3]);
                if (wanted(a) || wanted(b)) && corners[e].distance(corners[(e + 1) % 3]) > length {
                    edges.push((a.min(b), a.max(b)));
                }
            }
        }
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Gathers at both sides, as far as light reaches them, of `vertices`; connects the field anew.
    fn gather(&mut self, vertices: &[VertexId]) {
        let origins = self.origins(vertices);
        let jobs: Vec<(VertexId, Side)> = vertices
            .iter()
            .flat_map(|&v| Side::BOTH.map(|side| (v, side)))
            .filter(|&(v, side)| self.reach.alive(self.elements.vertices[v as usize].piece, side))
            .filter(|(v, _)| origins.contains_key(v))
            .collect();
        let mut rays = self.config.rays;
        let mut rows = self.gather_rows(&jobs, &origins, rays);
        // Where few rays find the light (a sunny patch, a lamp behind a shade) it takes more of them.
        for _ in 0..2 {
            rays *= 4;
            let all = self.field.sites.iter().map(|s| &s.row).chain(&rows).map(|r| r.direct);
            let floor = 0.1 * mean(&all.collect::<Vec<_>>()).mean();
            let noisy = |r: &Row| r.variance.sqrt() > self.config.noise * (r.direct.mean() + floor);
            let which: Vec<usize> = (0..rows.len()).filter(|&i| noisy(&rows[i])).collect();
            if which.is_empty() || self.progress.stopped() {
                break;
            }
            let again: Vec<(VertexId, Side)> = which.iter().map(|&i| jobs[i]).collect();
            for (i, row) in which.into_iter().zip(self.gather_rows(&again, &origins, rays)) {
                rows[i] = row;
            }
        }
        self.e.extend(rows.iter().map(|row| row.direct));
        let sites = jobs.into_iter().zip(rows).map(|((vertex, side), row)| Site { vertex, side, row });
        self.field.sites.extend(sites);
        self.field.connect(self.world, &self.elements, self.radius);
    }

    /// Rows of `rays` rays each, fewer where landings would take more memory than they may.
    fn gather_rows(
        &self,
        jobs: &[(VertexId, Side)],
        origins: &HashMap<VertexId, Vec<Origin>>,
        rays: u32,
    ) -> Vec<Row> {
        let held: usize = self.field.sites.iter().map(|s| s.row.landings.len()).sum();
        let room = self.config.most_landings.saturating_sub(held) / jobs.len().max(1);
        let pattern = Lattice2::new(rays.min(room as u32).max(16));
        self.progress.stage("gathering", jobs.len() as u64);
        let dead =
            |t: u32, side: Side| self.elements.piece(t).is_none_or(|piece| !self.reach.alive(piece, side));
        jobs.par_iter()
            .map(|&(vertex, side)| {
                let turned = turned(&origins[&vertex], side);
                let normal = self.elements.vertices[vertex as usize].normal * side.sign();
                // Another number of rays draws other numbers: a row that is done again shares nothing with the first.
                let stream = (u64::from(rays) << 40) ^ slot(vertex, side) as u64;
                let row = gather::row(self.world, &turned, normal, &pattern, self.config.seed, stream, dead);
                self.progress.advance(1);
                row
            })
            .collect()
    }

    /// For each of `vertices`, points just inside the facets around it.
    fn origins(&self, vertices: &[VertexId]) -> HashMap<VertexId, Vec<Origin>> {
        let mut wanted = vec![false; self.elements.vertices.len()];
        for &v in vertices {
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

    /// Solves on what there is, roughly: for predictions, not for pictures.
    fn settle(&mut self) {
        let tolerance = 0.02 * mean(&self.e).mean();
        self.e = self.solved(tolerance, 12, &[], &Flags::default()).0;
    }

    /// Solves E = D + K (E + extra) to `tolerance` lx from the present E, in at most `most` steps; also ‖K‖∞.
    pub(crate) fn solved(
        &self,
        tolerance: f32,
        most: u32,
        extra: &[Rgb],
        flags: &Flags,
    ) -> (Vec<Rgb>, Convergence, f32) {
        let usable = |s: usize| self.field.usable(s);
        let transport = Transport::locate(&self.elements, &self.field, |node, side, w| {
            visible_weights(self.world, &self.elements, flags, usable, node, side, w)
        });
        let norm = transport.norm();
        // While the mesh is being refined a rough bound will do.
        let gain = match flags.is_empty() {
            true => Gain::of_norm(norm.min(0.9)),
            false => solver::gain(self.e.len(), |e| transport.reflect(e, &[])),
        };
        let (e, convergence) =
            solver::solve(self.e.clone(), gain, tolerance, most, |e| transport.apply(e, extra));
        (e, convergence, norm)
    }

    /// Where pass 2 should gather for itself.
    pub(crate) fn flags(&self) -> Flags {
        let mut unresolved = vec![false; self.elements.vertices.len()];
        for &v in &self.unresolved {
            unresolved[v as usize] = true;
        }
        Flags::collect(&self.elements, |n, side| {
            let corners = self.elements.nodes[n as usize].vertices;
            if !self.reach.alive(self.elements.vertices[corners[0] as usize].piece, side) {
                return (false, false);
            }
            let coarse = corners.iter().any(|&v| unresolved[v as usize]);
            (self.pierced(n, side), coarse)
        })
    }

    /// Whether something stands across a leaf: a segment along an edge, just inside and just above, meets it.
    fn pierced(&self, node: u32, side: Side) -> bool {
        let corners = self.elements.corners(node);
        let normal = triangle::normal(corners[0], corners[1], corners[2]) * side.sign();
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let inside = corners
            .map(|p| offset_origin(p.lerp(middle, INWARD), normal) + normal * (1e-4 * self.world.diagonal));
        (0..3).any(|e| {
            let (from, to) = (inside[e], inside[(e + 1) % 3]);
            let length = from.distance(to);
            length > self.h_min
                && self.world.bvh.occluded(&Ray { t_max: length, ..Ray::new(from, (to - from) / length) })
        })
    }

    /// Direct irradiance at every slot, lx: `samples` light samples at each site.
    pub(crate) fn direct(&self, samples: u32) -> Vec<Rgb> {
        let vertices: Vec<VertexId> = self.field.sites.iter().map(|s| s.vertex).collect();
        let origins = self.origins(&vertices);
        let at_sites: Vec<Rgb> = self
            .field
            .sites
            .par_iter()
            .map(|site| {
                let v = &self.elements.vertices[site.vertex as usize];
                let Some(origins) = origins.get(&site.vertex) else { return Rgb::BLACK };
                let turned = turned(origins, site.side);
                let stream = slot(site.vertex, site.side) as u64;
                gather::direct(
                    self.world,
                    &turned,
                    v.normal * site.side.sign(),
                    samples,
                    self.config.seed,
                    stream,
                )
            })
            .collect();
        self.field.spread(&at_sites)
    }

    /// Reflected shares that landed in all, for the report.
    pub(crate) fn landings(&self) -> usize {
        self.field.sites.iter().map(|s| s.row.landings.len()).sum::<usize>()
    }

    /// Bytes held by rows.
    pub(crate) fn row_bytes(&self) -> usize {
        self.landings() * size_of::<Landing>()
    }
}

/// The origins seen from `side`.
fn turned(origins: &[Origin], side: Side) -> Vec<Origin> {
    origins.iter().map(|o| Origin { ng: o.ng * side.sign(), ..*o }).collect()
}

/// Mean over sites, lx.
pub(crate) fn mean(e: &[Rgb]) -> Rgb {
    let sum = e
        .iter()
        .fold([0f64; 3], |s, e| [s[0] + f64::from(e.r), s[1] + f64::from(e.g), s[2] + f64::from(e.b)]);
    Rgb::from(sum.map(|s| (s / e.len().max(1) as f64) as f32))
}

/// A cluster, its member furthest from the site, and the length of surface that the site stands for, m.
type Member = (usize, VertexId, f32);

/// Vertices without a site of their own, by the site that speaks for them.
struct Clusters {
    /// The vertex of the site, and those that it speaks for.
    members: Vec<(VertexId, Vec<VertexId>)>,
}

impl Clusters {
    fn new(refiner: &Refiner) -> Clusters {
        let vertices = &refiner.elements.vertices;
        let used = refiner.used();
        let mut cluster_of = vec![usize::MAX; vertices.len()];
        let mut members: Vec<(VertexId, Vec<VertexId>)> = Vec::new();
        let mut grid = cluster::Grid::new(refiner.radius);
        for site in &refiner.field.sites {
            if cluster_of[site.vertex as usize] == usize::MAX {
                cluster_of[site.vertex as usize] = members.len();
                members.push((site.vertex, Vec::new()));
                grid.insert(vertices, site.vertex);
            }
        }
        let owners: Vec<Option<VertexId>> = (0..vertices.len())
            .into_par_iter()
            .map(|v| {
                let open = used[v] && cluster_of[v] == usize::MAX;
                open.then(|| {
                    grid.near(vertices, &vertices[v]).min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
                })
                .flatten()
                .map(|(owner, _)| owner)
            })
            .collect();
        for (v, owner) in owners.into_iter().enumerate() {
            if let Some(owner) = owner {
                members[cluster_of[owner as usize]].1.push(v as VertexId);
            }
        }
        Clusters { members }
    }

    /// From each of the clusters `which`, the member furthest from the site, unless it is too near to matter.
    fn furthest(&self, refiner: &Refiner, which: &[usize]) -> Vec<Member> {
        let vertices = &refiner.elements.vertices;
        let least = 2.0 * refiner.h_min / refiner.radius;
        which
            .par_iter()
            .filter_map(|&c| {
                let (site, members) = &self.members[c];
                let far = |&v: &VertexId| {
                    (v, distance2(&vertices[v as usize], &vertices[*site as usize], refiner.radius))
                };
                let (v, d2) =
                    members.iter().map(far).max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))?;
                (d2.sqrt() > least).then_some((c, v, 2.0 * d2.sqrt() * refiner.radius))
            })
            .collect()
    }

    /// Gives every tested vertex a cluster of its own with the members nearer to it; returns the clusters whose test failed.
    fn divide(&mut self, refiner: &Refiner, tested: &[Member], failed: &[bool]) -> Vec<usize> {
        let vertices = &refiner.elements.vertices;
        let mut open = Vec::new();
        for &(c, t, _) in tested {
            let site = self.members[c].0;
            let all = std::mem::take(&mut self.members[c].1);
            let from = |v: VertexId, w: VertexId| {
                distance2(&vertices[v as usize], &vertices[w as usize], refiner.radius)
            };
            let (taken, kept): (Vec<_>, Vec<_>) =
                all.into_iter().filter(|&v| v != t).partition(|&v| from(v, t) < from(v, site));
            self.members[c].1 = kept;
            self.members.push((t, taken));
            if failed[t as usize] {
                open.extend([c, self.members.len() - 1]);
            }
        }
        open
    }
}
