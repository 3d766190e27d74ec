//! Which vertices of finely tessellated surface a site speaks for, and where such a cluster is to be tested.

use crate::element::VertexId;
use crate::element::cluster::{Grid, distance2};
use crate::refine::Refiner;
use rayon::prelude::*;

/// A cluster, its member furthest from the site, and the length of surface that the site stands for, m.
pub(crate) type Member = (usize, VertexId, f32);

/// Vertices without a site of their own, by the site that speaks for them.
pub(crate) struct Clusters {
    /// The vertex of the site, and those that it speaks for.
    pub(crate) members: Vec<(VertexId, Vec<VertexId>)>,
}

impl Clusters {
    pub(crate) fn new(refiner: &Refiner) -> Clusters {
        let vertices = &refiner.elements.vertices;
        let used = refiner.used();
        let mut cluster_of = vec![usize::MAX; vertices.len()];
        let mut members: Vec<(VertexId, Vec<VertexId>)> = Vec::new();
        let mut grid = Grid::new(refiner.radius);
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
    pub(crate) fn furthest(&self, refiner: &Refiner, which: &[usize]) -> Vec<Member> {
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
                (d2.sqrt() > least * refiner.closeness(v)).then_some((c, v, 2.0 * d2.sqrt() * refiner.radius))
            })
            .collect()
    }

    /// Gives every tested vertex a cluster of its own with the members nearer to it; returns the clusters whose test failed.
    pub(crate) fn divide(&mut self, refiner: &Refiner, tested: &[Member], failed: &[bool]) -> Vec<usize> {
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
