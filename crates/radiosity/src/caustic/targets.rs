//! Where photons are sent: spheres around all that reflects or refracts sharply.
//!
//! Between one sphere around everything, most of which is air, and one around each triangle, too many to weigh for each
//! particle, lies the division whose spheres present the least area to the light.

use crate::gather::ROUGH;
use geometry::emitter::Target;
use geometry::{Vec3, World};

/// Spheres at most: each particle weighs all of them.
const MOST: usize = 128;

/// A sphere is left whole where it presents so much of the area that those within it do together: a ball of glass. Many small
/// ones are better than one large of the same area, for a pilot finds those that light reaches.
const WHOLE: f32 = 0.5;
/// So many particles say as much of a target as all others together.
const FEW: f64 = 8.0;
/// A target gets so much of the density of the others at least, whatever the pilot says.
const LEAST: f32 = 0.1;

/// Some of the sharp surface.
struct Cluster {
    triangles: Vec<u32>,
    centre: Vec3,
    radius: f32,
    /// The two that it was divided into.
    halves: Option<[usize; 2]>,
}

/// Spheres that hold every triangle which reflects or refracts sharply; none where nothing does.
pub fn targets(world: &World) -> Vec<Target> {
    let mesh = &world.scene.mesh;
    let sharp = |t: &u32| {
        let material = &world.scene.materials[mesh.materials[*t as usize].0 as usize];
        material.sharpest_roughness().powi(2) < ROUGH && material.has_specular(0.02)
    };
    let all: Vec<u32> = (0..mesh.triangles.len() as u32).filter(sharp).collect();
    if all.is_empty() {
        return Vec::new();
    }
    let mut clusters = vec![Cluster::around(world, all)];
    let mut whole = vec![0];
    while whole.len() < MOST {
        // The largest that can be divided, the first of equals.
        let divisible = |&(_, &c): &(usize, &usize)| clusters[c].triangles.len() > 1;
        let size = |&(k, &c): &(usize, &usize)| (clusters[c].radius, std::cmp::Reverse(k));
        let order = |a: &(usize, &usize), b: &(usize, &usize)| {
            let (a, b) = (size(a), size(b));
            a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
        };
        let Some((k, &c)) = whole.iter().enumerate().filter(divisible).max_by(order) else { break };
        let [left, right] = divide(world, std::mem::take(&mut clusters[c].triangles));
        let n = clusters.len();
        clusters.push(Cluster::around(world, left));
        clusters.push(Cluster::around(world, right));
        clusters[c].halves = Some([n, n + 1]);
        whole[k] = n;
        whole.push(n + 1);
    }
    // From the last to the first, for halves come after their whole: together again where that presents less area.
    let mut area = vec![0f32; clusters.len()];
    for c in (0..clusters.len()).rev() {
        let own = clusters[c].radius.powi(2);
        let parts = clusters[c].halves.map(|halves| halves.map(|h| area[h]).iter().sum::<f32>());
        if parts.is_none_or(|parts| own <= WHOLE * parts) {
            clusters[c].halves = None;
        }
        area[c] = if clusters[c].halves.is_some() { parts.unwrap_or(own) } else { own };
    }
    let (mut spheres, mut stack) = (Vec::new(), vec![0]);
    while let Some(c) = stack.pop() {
        match clusters[c].halves {
            Some([left, right]) => stack.extend([right, left]),
            None => {
                let Cluster { centre, radius, .. } = clusters[c];
                spheres.push(Target { centre, radius, weight: 1.0 });
            }
        }
    }
    spheres
}

impl Cluster {
    fn around(world: &World, triangles: Vec<u32>) -> Cluster {
        let corners = || triangles.iter().flat_map(|&t| world.scene.mesh.corners(t));
        let far = Vec3::splat(f32::INFINITY);
        let (lo, hi) = corners().fold((far, -far), |(lo, hi), p| (lo.min(p), hi.max(p)));
        let centre = 0.5 * (lo + hi);
        let radius = corners().map(|p| p.distance_squared(centre)).fold(0.0, f32::max).sqrt();
        // A hair wider, lest rounding puts a corner outside.
        Cluster { centre, radius: radius * 1.0001 + 1e-6 * world.scale, triangles, halves: None }
    }
}

/// What became of a particle: the target it was sent to, if any, and the flux of it that landed, lm.
pub type Fate = (Option<usize>, f32);

/// Weighs `targets` by what the particles of a pilot brought from them: with f² the mean square of that, most is learnt for
/// density ∝ f (Veach's thesis, 1997, section 2.4).
pub fn weigh(targets: &mut [Target], pilot: &[Fate]) {
    let mut tally = vec![(0f64, 0f64); targets.len()];
    for &(target, landed) in pilot {
        if let Some(k) = target {
            tally[k].0 += 1.0;
            tally[k].1 += f64::from(landed).powi(2);
        }
    }
    let (n, square) = tally.iter().fold((0.0, 0.0), |sum, t| (sum.0 + t.0, sum.1 + t.1));
    if square <= 0.0 {
        return;
    }
    // Of a target that few were sent to, what the others brought is as good a guess.
    let typical = square / n;
    for (target, (n, square)) in targets.iter_mut().zip(tally) {
        let mean = (square + FEW * typical) / (n + FEW);
        target.weight = ((mean / typical).sqrt() as f32).max(LEAST);
    }
}

/// Two halves, by the middle of the longest side of the box around the triangles' centres; by number where these all
/// fall on one side.
fn divide(world: &World, mut triangles: Vec<u32>) -> [Vec<u32>; 2] {
    let centre = |t: &u32| world.scene.mesh.corners(*t).iter().sum::<Vec3>() / 3.0;
    let far = Vec3::splat(f32::INFINITY);
    let (lo, hi) = triangles.iter().map(centre).fold((far, -far), |(lo, hi), p| (lo.min(p), hi.max(p)));
    let axis = (hi - lo).max_position();
    let middle = 0.5 * (lo + hi)[axis];
    let (left, right): (Vec<u32>, Vec<u32>) = triangles.iter().partition(|t| centre(t)[axis] < middle);
    if left.is_empty() || right.is_empty() {
        let right = triangles.split_off(triangles.len() / 2);
        return [triangles, right];
    }
    [left, right]
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::{Material, MaterialId, Mesh, Scene};

    /// A hundred steel plates on a matt table, seven in a row, and a ball of glass of many triangles.
    fn world() -> World {
        let mut mesh = Mesh::default();
        let mut add = |corners: [Vec3; 3], material: u16| {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(corners);
            mesh.triangles.push([first, first + 1, first + 2]);
            mesh.materials.push(MaterialId(material.into()));
        };
        add([Vec3::ZERO, 20.0 * Vec3::X, 20.0 * Vec3::Z], 0);
        for i in 0..100 {
            let at = Vec3::new((i % 7) as f32, 1.0, (i / 7) as f32);
            add([at, at + 0.1 * Vec3::X, at + 0.1 * Vec3::Z], 1);
        }
        let on_ball = |i: u32, j: u32| {
            let (a, b) = (i as f32 * 0.3, j as f32 * 0.3);
            Vec3::new(30.0 + a.sin() * b.cos(), a.cos(), a.sin() * b.sin())
        };
        for (i, j) in (0..11).flat_map(|i| (0..21).map(move |j| (i, j))) {
            add([on_ball(i, j), on_ball(i + 1, j), on_ball(i, j + 1)], 2);
        }
        mesh.normals = vec![Vec3::Y; mesh.positions.len()];
        let matt = Material { roughness: 1.0, metallic: 0.0, specular: 0.0, ..Material::default() };
        let steel = Material { roughness: 0.1, metallic: 1.0, ..Material::default() };
        let glass = Material { roughness: 0.0, metallic: 0.0, transmission: 1.0, ..Material::default() };
        World::new(Scene { mesh, materials: vec![matt, steel, glass], ..Scene::default() })
    }

    #[test]
    fn all_that_is_sharp_lies_in_a_sphere() {
        let world = world();
        let found = targets(&world);
        assert!(found.len() <= MOST);
        let mesh = &world.scene.mesh;
        for t in 0..mesh.triangles.len() as u32 {
            let within = |s: &Target| mesh.corners(t).iter().all(|p| p.distance(s.centre) <= s.radius);
            let inside = found.iter().any(within);
            assert_eq!(inside, mesh.materials[t as usize].0 > 0, "triangle {t}");
        }
        let ball: Vec<&Target> = found.iter().filter(|s| s.centre.x > 20.0).collect();
        assert!(ball.len() == 1 && ball[0].radius < 1.1, "a ball is left whole: {ball:?}");
        let area: f32 = found.iter().filter(|s| s.centre.x < 20.0).map(|s| s.radius.powi(2)).sum();
        assert!(area < 0.1 * 49.0, "the plates stand apart: {area}");
    }

    #[test]
    fn a_pilot_sends_more_where_more_came_back() {
        let mut found = targets(&world());
        let pilot: Vec<Fate> = (0..4000)
            .map(|i| (Some(i % found.len()), if i % found.len() == 3 { 2.0 } else { 0.0 }))
            .collect();
        weigh(&mut found, &pilot);
        assert!(found[3].weight > 5.0 && found[2].weight <= 0.5, "{:?}", &found[..4]);
        let before = found.clone();
        weigh(&mut found, &[(None, 1.0), (Some(2), 0.0)]);
        assert_eq!(before, found, "nothing came, nothing is known");
    }

    #[test]
    fn nothing_sharp_no_target() {
        assert!(targets(&World::new(Scene::default())).is_empty());
    }
}
