//! Finer where E bends: gather at the midpoint of an edge, compare with what its ends predict, go on where it differs.
//!
//! Two kinds of vertices are tested alike. The midpoint of a long edge is new; in finely tessellated surface, where
//! one site speaks for many vertices, the one furthest from its site is. A tested vertex stays a site in either case.

use crate::clusters::{Clusters, Member};
use crate::element::cluster;
use crate::element::{EdgeMarks, Elements, Side, VertexId, slot};
use crate::field::Field;
use crate::first_mesh::first_mesh;
use crate::flags::Flags;
use crate::importance::{Care, Importance};
use crate::journal::Journal;
use crate::reach::Reach;
use crate::settle::mean;
use crate::solve::{Config, Progress};
use crate::transport::Landing;
use geometry::math::offset_origin;
use geometry::sampling::Lattice2;
use geometry::{LightGroups, Ray, Rgb, World, triangle};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Mutex;

/// A midpoint this far (relative) from its prediction, at the finest mesh, marks its surroundings for a gather of
/// their own in pass 2.
const ROUGH: f32 = 0.15;
/// Times the variance of the noise that such a difference is to exceed: two standard deviations. With one, the gallery's
/// pixels gathered for themselves wherever 80 rays a site happened to differ.
const STANDS_OUT: f32 = 4.0;
/// A round for fewer new sites than one in so many is not worth its while.
const HARDLY: usize = 20;
/// Rays that probe the middle of a leaf.
const PROBE: u32 = 32;
/// A gather ray starts this share of the way from its vertex into a facet: a vertex in the corner of a room lies on
/// the walls, and a ray from there may start on the wrong side of one.
pub(crate) const INWARD: f32 = 0.02;

/// The element mesh with everything gathered on it.
pub(crate) struct Refiner<'a> {
    pub(crate) world: &'a World,
    pub(crate) config: &'a Config,
    pub(crate) importance: Option<&'a Importance>,
    /// Rows that were gathered before, and where they are kept.
    pub(crate) journal: Option<&'a Mutex<Journal>>,
    pub(crate) progress: &'a dyn Progress,
    pub(crate) elements: Elements,
    pub(crate) reach: Reach,
    pub(crate) field: Field,
    /// E at the sites, lx.
    pub(crate) e: Vec<Rgb>,
    /// About the irradiance straight from the emitters at the sites, lx: an error of E is seen beside it. Black where
    /// nobody looks yet: who measures the indirect light alone, or puts lamps out, may be next.
    pub(crate) lit: Vec<Rgb>,
    /// For each piece, whether any of it reflects diffusely: mirrors and glass need no irradiance.
    diffuse: Vec<bool>,
    /// Lights whose parts are kept apart.
    pub(crate) groups: Option<LightGroups>,
    /// Vertices whose surroundings the mesh does not resolve.
    pub(crate) unresolved: Vec<VertexId>,
    /// What an error matters at each slot; empty where all matters alike.
    care: Vec<Care>,
    /// What an error at each slot matters for all the light there is: see [`crate::influence`].
    pub(crate) influence: Vec<f32>,
    /// Longest edge of the first mesh, m.
    h0: f32,
    /// Shortest edge worth splitting to, m.
    pub(crate) h_min: f32,
    /// Reach of a site in finely tessellated surface, m.
    pub(crate) radius: f32,
    /// What a residual brings at all later bounces, in units of itself, as found on the first mesh.
    pub(crate) gain: Option<f32>,
    /// Sites there were when [`Refiner::influence`] was worked out.
    pub(crate) influential: usize,
}

/// A vertex gathered to be compared with a prediction.
struct Test {
    vertex: VertexId,
    /// On which sides it is gathered: those where the light promises to change.
    sides: [bool; 2],
    /// What predicted it: vertices and their weights.
    from: Vec<(VertexId, f32)>,
    /// Length of surface that the prediction stands for, m.
    length: f32,
    /// Something stands between the predictors.
    parted: bool,
}

impl<'a> Refiner<'a> {
    /// The first mesh: no edge longer than h0, sites where clusters of vertices need them, all gathered.
    pub(crate) fn start(
        world: &'a World,
        config: &'a Config,
        importance: Option<&'a Importance>,
        journal: Option<&'a Mutex<Journal>>,
        progress: &'a dyn Progress,
    ) -> Refiner<'a> {
        let scale = world.scale;
        let (h_min, mut radius) = (config.h_min * scale, config.cluster_radius * scale);
        let most = config.most_vertices.max(2 * world.scene.mesh.positions.len());
        let (elements, h0) = first_mesh(world, config.h0 * scale, most);
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
            importance,
            journal,
            progress,
            elements,
            reach,
            field: Field::default(),
            e: Vec::new(),
            lit: Vec::new(),
            groups: config.by_light.then(|| LightGroups::new(world)),
            unresolved: Vec::new(),
            care: Vec::new(),
            influence: Vec::new(),
            h0,
            h_min,
            radius,
            gain: None,
            influential: 0,
        };
        refiner.weigh();
        let used = refiner.used();
        let choose = |radius: f32| {
            let candidates = (0..used.len() as VertexId).filter(|&v| used[v as usize]);
            cluster::spread_out(&refiner.elements.vertices, candidates, radius)
        };
        let mut chosen = choose(radius);
        // Finely modelled scenes: half of the sites at most go to the first mesh, each reaching further if need be.
        for _ in 0..8 {
            if chosen.len() <= config.most_sites / 2 {
                break;
            }
            radius *= 1.5;
            chosen = choose(radius);
        }
        refiner.radius = radius;
        refiner.gather(&chosen.into_iter().map(|v| (v, [true; 2])).collect::<Vec<_>>());
        refiner
    }

    /// Finds anew what matters, after the mesh was refined.
    pub(crate) fn weigh(&mut self) {
        if let Some(importance) = self.importance {
            self.care = importance.care(&self.elements);
        }
    }

    /// What an error at a slot matters: 1 where it is seen, less elsewhere, more where much of the light hangs on it.
    pub(crate) fn weight(&self, slot: usize) -> f32 {
        self.care(slot).weight.max(self.influence.get(slot).copied().unwrap_or(0.0))
    }

    fn care(&self, slot: usize) -> Care {
        self.care.get(slot).copied().unwrap_or(Care::FULL)
    }

    /// Share of what an error at a slot matters in all that it matters on `length` (m) of surface.
    fn extent(&self, slot: usize, length: f32) -> f32 {
        (length / self.h0.min(self.care(slot).span)).min(1.0)
    }

    /// How much closer than a whole room a slot is looked at, (0, 1]: all lengths that the mesh keeps to shrink by so much.
    pub(crate) fn closeness(&self, v: VertexId) -> f32 {
        let span = Side::BOTH.map(|side| self.care(slot(v, side)).span);
        (span[0].min(span[1]) / self.h0).min(1.0)
    }

    /// Tests and refines until the tolerance, the finest edge, the sites, the rounds or the time run out.
    pub(crate) fn refine(&mut self) {
        self.adopt();
        self.settle(true);
        let mut edges = self.edges_longer_than(self.radius.max(2.0 * self.h_min), |_| true);
        let mut clusters = Clusters::new(self);
        let mut open: Vec<usize> = (0..clusters.members.len()).collect();
        // Vertices far from their prediction around which nothing finer was tested.
        let mut rough = vec![false; self.elements.vertices.len()];
        let mut probed = 0;
        for round in 0..self.config.rounds {
            if self.progress.stopped() {
                break;
            }
            edges.extend(self.surprising(&mut probed));
            edges.sort_unstable();
            edges.dedup();
            let left = self.config.most_sites.saturating_sub(self.field.sites.len());
            // Too few to change anything, and a round costs as much as any.
            if round > 0 && left * HARDLY < self.field.sites.len() {
                break;
            }
            // The first rounds may not use up what later ones need to go deep.
            let room = if round + 1 < self.config.rounds { left / 2 } else { left };
            let (mut chosen, kept, members) = self.choose(&edges, clusters.furthest(self, &open), room);
            // What may be looked for where nothing is known to be comes last.
            let room = room.saturating_sub(chosen.len() + members.len());
            if room > 0 {
                let mut crowded = self.crowded();
                crowded.retain(|edge| edges.binary_search(edge).is_err());
                chosen.extend(self.choose(&crowded, Vec::new(), room).0);
            }
            if chosen.is_empty() && members.is_empty() {
                break;
            }
            for &((a, b), _) in &chosen {
                (rough[a as usize], rough[b as usize]) = (false, false);
            }
            let mut tests = self.split(&chosen);
            tests.extend(members.iter().map(|&(c, vertex, length)| Test {
                vertex,
                sides: [true; 2],
                from: vec![(clusters.members[c].0, 1.0)],
                length,
                parted: false,
            }));
            self.gather(&tests.iter().map(|t| (t.vertex, t.sides)).collect::<Vec<_>>());
            self.settle(round + 1 < self.config.rounds);
            let values = self.field.spread(&self.e);
            let around =
                self.levels(self.field.sites.iter().zip(&self.e).map(|(s, e)| (s.vertex, s.side, e.mean())));
            let lit = self.field.spread(&self.lit);
            let errors: Vec<[f32; 2]> = tests.iter().map(|t| self.error(t, &values, &lit, &around)).collect();
            rough.resize(self.elements.vertices.len(), false);
            let mut failed = vec![false; self.elements.vertices.len()];
            for (test, &[error, rough_error]) in tests.iter().zip(&errors) {
                // What stands on an edge is worth a quarter of the tolerance: the light may be even all the same.
                failed[test.vertex as usize] =
                    error > self.config.tolerance * if test.parted { 0.25 } else { 1.0 };
                rough[test.vertex as usize] = rough_error > ROUGH;
            }
            edges = self.edges_longer_than(2.0 * self.h_min, |v| failed[v as usize]);
            edges.extend(kept);
            edges.sort_unstable();
            edges.dedup();
            open = clusters.divide(self, &members, &failed);
        }
        self.adopt();
        self.reveal();
        self.unresolved = (0..rough.len() as VertexId).filter(|&v| rough[v as usize]).collect();
    }

    /// Edges of the leaves, from number `probed` on, whose middle is lit quite otherwise than their corners say.
    fn surprising(&self, probed: &mut u32) -> Vec<(VertexId, VertexId)> {
        let values = self.field.spread(&self.e);
        let floor = 0.2 * mean(&self.e).mean();
        let pattern = Lattice2::new(PROBE);
        let large = |&leaf: &u32| {
            let [a, b, c] = self.elements.corners(leaf);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            leaf >= *probed && longest > 2.0 * self.radius && self.diffuse[self.elements.piece_of(leaf)]
        };
        let leaves: Vec<u32> = self.elements.leaves().filter(large).collect();
        *probed = self.elements.nodes.len() as u32;
        let surprising =
            leaves.into_par_iter().filter(|&leaf| self.surprises(leaf, &values, floor, &pattern));
        let edges = surprising.flat_map_iter(|leaf| self.elements.edges(leaf));
        let all: Vec<_> = edges.collect();
        all.into_iter().filter(|&(a, b)| self.splittable(a, b)).collect()
    }

    /// Whether the edge is long enough to be split.
    pub(crate) fn splittable(&self, a: VertexId, b: VertexId) -> bool {
        self.longer(a, b, 2.0 * self.h_min)
    }

    /// Whether an edge is longer than `length` (m), less where one looks closely.
    fn longer(&self, a: VertexId, b: VertexId, length: f32) -> bool {
        self.length(a, b) > length * self.closeness(a).min(self.closeness(b))
    }

    /// Distance of two vertices, m.
    fn length(&self, a: VertexId, b: VertexId) -> f32 {
        self.elements.vertices[a as usize].position.distance(self.elements.vertices[b as usize].position)
    }

    /// Of the edges and the clusters' furthest members, at most `room` that promise most: those along which E changes,
    /// the longer the more. Beside each edge the sides on which it does. Also the promising edges for which there is no
    /// room.
    #[allow(clippy::type_complexity)]
    fn choose(
        &self,
        edges: &[(VertexId, VertexId)],
        members: Vec<Member>,
        room: usize,
    ) -> (Vec<((VertexId, VertexId), [bool; 2])>, Vec<(VertexId, VertexId)>, Vec<Member>) {
        // Two ends that agree may still hide a bend between them: a tenth of what is there, and of what is elsewhere on
        // this side of the face. So a panel of which most corners lie dark behind a frame is looked at too.
        const HIDDEN: f32 = 0.1;
        let values = self.field.spread(&self.e);
        let around =
            self.levels(self.field.sites.iter().zip(&self.e).map(|(s, e)| (s.vertex, s.side, e.mean())));
        let elsewhere = self.means_of_faces();
        let lit = self.field.spread(&self.lit);
        let promise = |difference: f32, level: f32, lit: f32, slot: usize| match level
            + elsewhere[self.face_slot(slot)]
        {
            // Without indirect light there may be the direct one, for those who take it from the vertices.
            0.0 => {
                if self.reach.shone_on(self.elements.vertices[slot / 2].face, Side::BOTH[slot % 2]) {
                    HIDDEN
                } else {
                    0.0
                }
            }
            near => (difference + HIDDEN * near) / (level + lit + 0.1 * around[self.face_slot(slot)]),
        };
        let change = |a: VertexId, b: VertexId| {
            let face = self.elements.vertices[a as usize].face;
            let length = self.length(a, b);
            Side::BOTH.map(|side| {
                if !self.reach.alive(face, side) {
                    return 0.0;
                }
                let (sa, sb) = (slot(a, side), slot(b, side));
                let matters = self.weight(sa).max(self.weight(sb))
                    * self.extent(sa, length).max(self.extent(sb, length));
                matters
                    * match (self.field.usable(sa), self.field.usable(sb)) {
                        (true, true) => {
                            let (va, vb) = (values[sa], values[sb]);
                            let lit = lit[sa].mean().min(lit[sb].mean());
                            // What the rays' own noise explains promises nothing.
                            let noise = self.field.variance(sa) + self.field.variance(sb);
                            let difference = (va - vb).map(f32::abs).mean();
                            let beyond = (difference * difference - noise).max(0.0).sqrt();
                            promise(beyond, 0.5 * (va + vb).mean(), lit, sa)
                        }
                        // A buried end says nothing of the rest.
                        _ => 1.0,
                    }
            })
        };
        let around = |v: VertexId, length: f32| {
            let of = |&side: &Side| {
                let s = slot(v, side);
                self.weight(s)
                    * self.extent(s, length)
                    * promise(self.field.spread_around(s, &self.e), values[s].mean(), lit[s].mean(), s)
            };
            Side::BOTH.iter().filter(|&&side| self.field.usable(slot(v, side))).map(of).fold(0.0, f32::max)
        };
        let promises = |s: [f32; 2]| s.map(|s| s > self.config.tolerance);
        let mut all: Vec<([f32; 2], usize)> = edges
            .par_iter()
            .map(|&(a, b)| change(a, b))
            .chain(members.par_iter().map(|&(_, v, length)| [around(v, length); 2]))
            .enumerate()
            .map(|(i, s)| (s, i))
            .filter(|&(s, _)| promises(s).contains(&true))
            .collect();
        let better = |s: [f32; 2]| s[0].max(s[1]);
        all.sort_unstable_by(|a, b| better(b.0).total_cmp(&better(a.0)).then(a.1.cmp(&b.1)));
        let kept = all.split_off(room.min(all.len()));
        let edge = |&(s, i): &([f32; 2], usize)| edges.get(i).map(|&edge| (edge, promises(s)));
        let member = |&(_, i): &([f32; 2], usize)| i.checked_sub(edges.len()).map(|m| members[m]);
        (
            all.iter().filter_map(edge).collect(),
            kept.iter().filter_map(edge).map(|(edge, _)| edge).collect(),
            all.iter().filter_map(member).collect(),
        )
    }

    /// Relative difference of what was gathered from what was predicted, the worse side: by what it matters, and as such
    /// where it stands out of the rays' noise (the two of [`ROUGH`]).
    fn error(&self, test: &Test, values: &[Rgb], lit: &[Rgb], around: &[f32]) -> [f32; 2] {
        let here_lit = |side| lit[slot(test.vertex, side)].mean();
        Side::BOTH
            .iter()
            .filter(|side| test.sides[side.index()] && self.field.usable(slot(test.vertex, **side)))
            .map(|&side| {
                let got = values[slot(test.vertex, side)];
                let known = test.from.iter().filter(|(v, _)| self.field.usable(slot(*v, side)));
                let (sum, weight, known_variance) =
                    known.fold((Rgb::BLACK, 0.0, 0.0), |(s, w, n), &(v, k)| {
                        let slot = slot(v, side);
                        (s + values[slot] * k, w + k, n + k * k * self.field.variance(slot))
                    });
                if weight <= 0.0 {
                    // Nothing around it speaks for it.
                    return [self.extent(slot(test.vertex, side), test.length), 1.0];
                }
                let predicted = sum / weight;
                let difference = (got - predicted).map(f32::abs).mean();
                // What the rays' own noise explains is no bend of the light.
                let noise = known_variance / (weight * weight) + self.field.variance(slot(test.vertex, side));
                let floor = 0.1 * around[self.face_slot(slot(test.vertex, side))];
                // The least that shines on any of them: one in the shadow is seen by its indirect light alone.
                let lit = test.from.iter().map(|(v, _)| lit[slot(*v, side)].mean());
                let lit = lit.fold(here_lit(side), f32::min);
                let level = (0.5 * (got + predicted).mean() + lit + floor).max(1e-30);
                let beyond = |noise: f32| (difference * difference - noise).max(0.0).sqrt() / level;
                let s = slot(test.vertex, side);
                [self.weight(s) * self.extent(s, test.length) * beyond(noise), beyond(STANDS_OUT * noise)]
            })
            .fold([0.0; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])])
    }

    /// Splits the edges; each midpoint is a test on the sides named.
    fn split(&mut self, edges: &[((VertexId, VertexId), [bool; 2])]) -> Vec<Test> {
        let mut marks = EdgeMarks::default();
        let room = self.config.most_vertices.saturating_sub(self.elements.vertices.len());
        let sides: HashMap<(VertexId, VertexId), [bool; 2]> = edges.iter().take(room).copied().collect();
        for &(a, b) in sides.keys() {
            marks.mark(a, b);
        }
        self.elements.split(&mut marks);
        self.weigh();
        let midpoints = marks.split_edges();
        for &(a, b, m) in &midpoints {
            self.field.put_between(m, [a, b]);
            for side in Side::BOTH {
                let ends = [a, b].map(|v| self.influence.get(slot(v, side)).copied().unwrap_or(0.0));
                self.influence.resize(slot(m, side), 0.0);
                self.influence.push(ends[0].max(ends[1]));
            }
        }
        let test = |&(a, b, m): &(VertexId, VertexId, VertexId)| Test {
            vertex: m,
            sides: sides.get(&(a, b)).copied().unwrap_or([true; 2]),
            from: vec![(a, 0.5), (b, 0.5)],
            length: self.length(a, b),
            parted: self.parted(a, b),
        };
        midpoints.par_iter().map(test).collect()
    }

    /// Whether something stands on the edge from `a` to `b`, on a side that light reaches.
    fn parted(&self, a: VertexId, b: VertexId) -> bool {
        let (a, b) = (&self.elements.vertices[a as usize], &self.elements.vertices[b as usize]);
        Side::BOTH.iter().filter(|&&side| self.reach.alive(a.face, side)).any(|&side| {
            let lift = 1e-4 * self.world.scale * side.sign();
            let (from, to) = (a.position + a.normal * lift, b.position + b.normal * lift);
            let length = from.distance(to);
            // The ends often lie in a wall's plane: leave them out.
            let ray =
                Ray { t_min: 0.01 * length, t_max: 0.99 * length, ..Ray::new(from, (to - from) / length) };
            length > 0.0 && self.world.bvh.occluded(&ray)
        })
    }

    /// Which vertices a leaf that reflects diffusely uses.
    pub(crate) fn used(&self) -> Vec<bool> {
        let mut used = vec![false; self.elements.vertices.len()];
        for leaf in self.elements.leaves().filter(|&leaf| self.diffuse[self.elements.piece_of(leaf)]) {
            for v in self.elements.nodes[leaf as usize].vertices {
                used[v as usize] = true;
            }
        }
        used
    }

    /// Edges of leaves that are longer than `length`, less where one looks closely, and have an end that `wanted` names; each
    /// once, in order.
    fn edges_longer_than(&self, length: f32, wanted: impl Fn(VertexId) -> bool) -> Vec<(VertexId, VertexId)> {
        let mut edges = Vec::new();
        for leaf in self.elements.leaves() {
            let node = &self.elements.nodes[leaf as usize];
            let piece = self.elements.vertices[node.vertices[0] as usize].piece;
            let lit = Side::BOTH.iter().any(|&side| self.reach.alive(self.elements.face_of(leaf), side));
            if !lit || !self.diffuse[piece as usize] {
                continue;
            }
            let wanted =
                |&(a, b): &(VertexId, VertexId)| (wanted(a) || wanted(b)) && self.longer(a, b, length);
            edges.extend(self.elements.edges(leaf).into_iter().filter(wanted));
        }
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Where pass 2 should gather for itself.
    pub(crate) fn flags(&self) -> Flags {
        let mut unresolved = vec![false; self.elements.vertices.len()];
        for &v in &self.unresolved {
            unresolved[v as usize] = true;
        }
        Flags::collect(&self.elements, |n, side| {
            let corners = self.elements.nodes[n as usize].vertices;
            if !self.reach.alive(self.elements.vertices[corners[0] as usize].face, side) {
                return (false, false);
            }
            // Of a leaf with all corners in other things (a shelf between books) the mesh knows nothing.
            let buried = corners.iter().any(|&v| !self.field.usable(slot(v, side)));
            let coarse = buried || corners.iter().any(|&v| unresolved[v as usize]);
            (self.pierced(n, side), coarse)
        })
    }

    /// Whether something stands across a leaf: a segment along an edge, just inside and just above, meets it.
    fn pierced(&self, node: u32, side: Side) -> bool {
        let corners = self.elements.corners(node);
        let normal = triangle::normal(corners[0], corners[1], corners[2]) * side.sign();
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let inside = corners
            .map(|p| offset_origin(p.lerp(middle, INWARD), normal) + normal * (1e-4 * self.world.scale));
        (0..3).any(|e| {
            let (from, to) = (inside[e], inside[(e + 1) % 3]);
            let length = from.distance(to);
            length > self.h_min
                && self.world.bvh.occluded(&Ray { t_max: length, ..Ray::new(from, (to - from) / length) })
        })
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
