//! Vertices that no site speaks for: of all that are near enough none sees them, as on the inner edge of a window's reveal
//! whose frame stands on it. Those that the eye sees are gathered at.

use crate::element::cluster;
use crate::element::{Side, Vertex, VertexId, slot};
use crate::refine::Refiner;

/// Rounds of looking for them: one may see another.
const ROUNDS: u32 = 3;
/// Share of all sites that they may take.
const SHARE: usize = 8;

impl Refiner<'_> {
    /// Gives sites to the orphans that are seen.
    pub(crate) fn adopt(&mut self) {
        let mut room = self.config.most_sites / SHARE;
        for _ in 0..ROUNDS {
            let orphans = self.orphans();
            let candidates = (0..orphans.len() as VertexId).filter(|&v| orphans[v as usize] != [false; 2]);
            let mut chosen = cluster::spread_out(&self.elements.vertices, candidates, self.radius);
            chosen.truncate(room);
            if chosen.is_empty() || self.progress.stopped() {
                break;
            }
            room -= chosen.len();
            let wanted: Vec<(VertexId, [bool; 2])> =
                chosen.into_iter().map(|v| (v, orphans[v as usize])).collect();
            self.gather(&wanted);
        }
    }

    /// For each vertex, the sides of it that are orphans and seen.
    fn orphans(&self) -> Vec<[bool; 2]> {
        let used = self.used();
        let mut asked = vec![false; 2 * self.elements.vertices.len()];
        for site in &self.field.sites {
            asked[slot(site.vertex, site.side)] = true;
        }
        let of = |(v, vertex): (usize, &Vertex)| {
            Side::BOTH.map(|side| {
                let s = slot(v as VertexId, side);
                used[v]
                    && self.reach.alive(vertex.face, side)
                    && !asked[s]
                    && !self.field.usable(s)
                    && self.weight(s) >= 1.0
            })
        };
        self.elements.vertices.iter().enumerate().map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::refine::Refiner;
    use crate::solve::Config;
    use geometry::{Material, MaterialId, Mesh, Rgb, Scene, Sky, Vec3, World};

    /// A floor of small cells, and a fin across it near one end: what lies between fin and end is near to sites that it does
    /// not see.
    #[test]
    fn what_lies_beyond_a_fin_gets_sites_of_its_own() {
        const CELLS: u32 = 20;
        let mut mesh = Mesh::default();
        let across = CELLS + 1;
        for k in 0..across * across {
            mesh.positions.push(Vec3::new((k % across) as f32, (k / across) as f32, 0.0) / CELLS as f32);
        }
        for k in 0..CELLS * CELLS {
            let p = k % CELLS + k / CELLS * across;
            mesh.triangles.extend([[p, p + 1, p + across + 1], [p, p + across + 1, p + across]]);
        }
        let fin = mesh.positions.len() as u32;
        mesh.positions
            .extend([(-1.0, 0.0), (2.0, 0.0), (2.0, 0.3), (-1.0, 0.3)].map(|(y, z)| Vec3::new(0.93, y, z)));
        mesh.normals = vec![Vec3::Z; fin as usize];
        mesh.normals.extend([Vec3::X; 4]);
        mesh.triangles.extend([[fin, fin + 1, fin + 2], [fin, fin + 2, fin + 3]]);
        mesh.materials = vec![MaterialId(0); mesh.triangles.len()];
        let sky = Some(Sky::Constant(Rgb::WHITE));
        let world = World::new(Scene { mesh, materials: vec![Material::default()], sky, ..Scene::default() });
        let config = Config { cluster_radius: 0.15 / world.scale, ..Config::for_error(0.05) };
        let mut refiner = Refiner::start(&world, &config, None, None, &());
        let orphans =
            |refiner: &Refiner| refiner.orphans().iter().flatten().filter(|&&orphan| orphan).count();
        assert!(orphans(&refiner) > 0, "the scene shows nothing");
        refiner.adopt();
        assert_eq!(orphans(&refiner), 0);
    }
}
