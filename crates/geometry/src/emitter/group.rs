//! Many lights as few groups, as one point sees them: each can be given samples of its own.
//!
//! Walter et al., "Lightcuts: A Scalable Approach to Illumination", SIGGRAPH 2005, cut a tree of lights anew for each
//! point; here each node of the cut is sampled, not stood for by one of its lights, so nothing is lost.

use super::{EmitterKind, Emitters, LightSample};
use crate::Scene;
use crate::math::Vec3;

/// Lights that are sampled together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// One light, by its number.
    Light(u32),
    /// All lights below a node of the light tree.
    Branch(u32),
}

impl Emitters {
    /// All lights that may shine on `p` with unit normal `n`, each in one group, and about the irradiance (mean of the
    /// channels, lx) that each group throws there if nothing stands between. Each light is a group where there are at
    /// most `most` of them, four at least; else those that are many and far, or weak, stay together.
    pub fn groups(&self, p: Vec3, n: Vec3, most: usize) -> Vec<(Group, f32)> {
        let one = |light: u32| (Group::Light(light), self.importance(light, p, n));
        if self.lights.len() <= most {
            return (0..self.lights.len() as u32).map(one).collect();
        }
        let placed = self.tree.cut(p, n, most).into_iter().map(|part| match part.light() {
            Ok(light) => one(light),
            Err(node) => (Group::Branch(node), part.importance),
        });
        placed.chain((self.tree_lights..self.lights.len() as u32).map(one)).collect()
    }

    /// A way from `p` to one light of a group, the pdf without the probability of choosing the group; `u` in [0, 1)².
    /// `None` where it sends no light.
    pub fn sample_group(
        &self,
        scene: &Scene,
        group: Group,
        p: Vec3,
        n: Vec3,
        u: [f32; 2],
    ) -> Option<LightSample> {
        match group {
            Group::Light(light) => self.sample_light(scene, light, p, n, u),
            Group::Branch(node) => {
                let (light, probability, rest) = self.tree.choose_below(node, p, n, u[0])?;
                let s = self.sample_light(scene, light, p, n, [rest, u[1]])?;
                Some(LightSample { pdf: s.pdf * probability, ..s })
            }
        }
    }

    /// Whether a light is in a group.
    pub fn is_in_group(&self, group: Group, light: u32) -> bool {
        match group {
            Group::Light(l) => l == light,
            Group::Branch(node) => self.tree.is_below(node, light),
        }
    }

    /// The density (1/sr) with which [`Emitters::sample_group`] draws `point` on an emissive `triangle`; 0 for a
    /// triangle of no light in the group.
    pub fn pdf_in_group(&self, group: Group, p: Vec3, n: Vec3, triangle: u32, point: Vec3) -> f32 {
        let Some(light) = self.light_of_triangle(triangle) else { return 0.0 };
        let chosen = match group {
            Group::Light(l) => f32::from(l == light),
            Group::Branch(node) => self.tree.probability_below(node, light, p, n),
        };
        match &self.lights[light as usize] {
            EmitterKind::Polygon(shape) | EmitterKind::Textured(shape) if chosen > 0.0 => {
                chosen * shape.pdf(p, point)
            }
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;
    use crate::emitter::testing::*;
    use crate::polygon::polygon_irradiance;
    use std::f32::consts::PI;

    /// However the lamps are grouped, the groups together bring what the lamps do, by the density that is told.
    #[test]
    fn groups_add_up_to_all_lamps() {
        let mut mesh = Mesh::default();
        let (p, n) = (Vec3::new(0.3, 0.0, -0.2), Vec3::Y);
        let mut exact = 0.0;
        for i in 0..200 {
            let at = Vec3::new((i % 20) as f32 * 0.5 - 4.5, 1.0 + (i % 3) as f32, (i / 20) as f32 - 4.5);
            exact += PI * polygon_irradiance(p, n, &append_quad(&mut mesh, at, 0.1));
        }
        let scene = scene_of(mesh, 1.0);
        let emitters = Emitters::build(&scene);
        for most in [4, 7, 16, 1000] {
            let groups = emitters.groups(p, n, most);
            assert!(groups.len() <= most || most == 1000);
            let mut sum = 0f64;
            for &(group, _) in &groups {
                let k = 40_000 / groups.len() as u32;
                for u in points(k) {
                    let Some(s) = emitters.sample_group(&scene, group, p, n, [u[0], u[1]]) else { continue };
                    let EmitterKind::Polygon(shape) = &emitters.lights()[s.light as usize] else {
                        panic!("even")
                    };
                    let told = emitters.pdf_in_group(group, p, n, shape.triangles[0], p + s.wi * s.distance);
                    assert!((told / s.pdf - 1.0).abs() < 1e-3, "{group:?}");
                    sum += f64::from(s.radiance.g * s.wi.dot(n).max(0.0) / s.pdf) / f64::from(k);
                }
            }
            assert!((sum as f32 / exact - 1.0).abs() < 0.03, "{most}: {sum} {exact}");
        }
    }

    #[test]
    fn each_light_is_in_one_group() {
        let mut mesh = Mesh::default();
        for i in 0..100 {
            append_quad(&mut mesh, Vec3::new((i % 10) as f32, 2.0, (i / 10) as f32), 0.1);
        }
        let scene = scene_of(mesh, 1.0);
        let emitters = Emitters::build(&scene);
        let (p, n) = (Vec3::new(4.0, 0.0, 4.0), Vec3::Y);
        let groups = emitters.groups(p, n, 8);
        assert!(groups.len() > 1 && groups.len() <= 8, "{groups:?}");
        for light in 0..100 {
            let EmitterKind::Polygon(shape) = &emitters.lights()[light] else { panic!("even") };
            let within = |g: &&(Group, f32)| {
                emitters.pdf_in_group(g.0, p, n, shape.triangles[0], shape.point([0.4, 0.3])) > 0.0
            };
            assert_eq!(groups.iter().filter(within).count(), 1, "light {light}");
        }
    }
}
