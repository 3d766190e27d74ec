//! What a picture needs: which kinds of light are in it, what share each carries, and how each will be found.
//!
//! A pilot of a few thousand paths tells the shares as the camera sees them; what comes by way of mirrors and glass to
//! diffuse surfaces, which paths find too seldom, is told by a pilot of particles from the lamps.

use crate::integrator::path;
use crate::pixel::View;
use crate::render::{MOST_SAMPLES, noise_goal};
use geometry::emitter::EmitterKind;
use geometry::sampling::{Lattice2, Rng};
use geometry::{Material, World};
use radiosity::Config;
use radiosity::caustic::Caustics;
use radiosity::gather::ROUGH;
use rayon::prelude::*;

/// Paths of the pilot.
const PATHS: u32 = 4096;
/// Particles of the pilot.
const PARTICLES: usize = 65_536;

/// A kind of light, in Heckbert's letters from light to eye.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// What it is called.
    pub name: &'static str,
    /// Its paths.
    pub paths: &'static str,
    /// Its share of all light in the picture, in [0, 1]; of caustics, the share of the lamps' light that becomes one.
    pub share: f64,
    /// Standard error of that.
    pub doubt: f64,
    /// How it is found.
    pub how: String,
}

/// What is in a picture, and what will be done about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Every kind of light that there may be.
    pub parts: Vec<Part>,
    /// What the picture will lack.
    pub left_out: Vec<String>,
}

impl Plan {
    /// Looks at `world` by the eyes of `view`, for a picture of relative error `error`.
    pub fn new(world: &World, view: &View, error: f32, seed: u64) -> Plan {
        let [emission, direct, indirect, specular] = shares(world, view, seed);
        let config = Config::for_error(error);
        let (sampled, many) = (world.emitters.lights().len(), world.emitters.lights().len() > 32);
        let exact = world.emitters.lights().iter().any(|l| matches!(l, EmitterKind::Polygon(_)));
        let lamps = match (sampled, many) {
            (0, _) => "no lamps".to_string(),
            (n, true) => format!("of {n} lamps, up to 32 groups for each point"),
            (n, false) => format!("each of {n} lamps"),
        };
        let exactly = if exact { ", polygons in closed form but for their shadows" } else { "" };
        let mut parts = vec![
            part("lamps and sky", "LE", emission, "as they are".to_string()),
            part(
                "direct light",
                "LDE",
                direct,
                format!("4 to {MOST_SAMPLES} shadow rays for each pixel and surface; {lamps}{exactly}"),
            ),
            part(
                "interreflection",
                "L(D|S)*DDE",
                indirect,
                format!(
                    "{} rays and more from each vertex of a mesh of {:.2} to {:.3} m",
                    config.rays,
                    config.h0 * world.scale,
                    config.h_min * world.scale
                ),
            ),
        ];
        let kinds = specular_kinds(world);
        let mut left_out = Vec::new();
        if !kinds.is_empty() {
            parts.push(part("specular", "L(D|S)*SE", specular, format!("rays: {}", kinds.join(", "))));
            let (share, how) = caustics(world, &config, seed);
            parts.push(part("caustics", "LS+DE", (share, 0.0), how));
        }
        if uses(world, |m| m.normal_texture.is_some()) {
            left_out.push("normal maps in interreflection".to_string());
        }
        let goal = 100.0 * noise_goal(error);
        parts.push(part(
            "noise",
            "",
            (0.0, 0.0),
            format!("up to {goal:.2} % from samples, the rest for the mesh"),
        ));
        Plan { parts, left_out }
    }
}

impl std::fmt::Display for Plan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (i, p) in self.parts.iter().enumerate() {
            let separator = if i > 0 { "\n" } else { "" };
            let share = match p.paths {
                "" => String::new(),
                "LS+DE" => format!("{:5.2} %", 100.0 * p.share),
                _ => format!("{:5.1} ± {:.1} %", 100.0 * p.share, 100.0 * p.doubt),
            };
            write!(f, "{separator}{:<16} {:<11} {share:<15} {}", p.name, p.paths, p.how)?;
        }
        if !self.left_out.is_empty() {
            write!(f, "\nleft out: {}", self.left_out.join(", "))?;
        }
        Ok(())
    }
}

fn part(name: &'static str, paths: &'static str, (share, doubt): (f64, f64), how: String) -> Part {
    Part { name, paths, share, doubt, how }
}

/// Shares of the picture's light in emission, direct, indirect and specular, with their standard errors.
fn shares(world: &World, view: &View, seed: u64) -> [(f64, f64); 4] {
    let pattern = Lattice2::new(PATHS);
    let found: Vec<[f64; 4]> = (0..PATHS)
        .into_par_iter()
        .map(|i| {
            let mut rng = Rng::new(seed ^ 0x706c_616e, u64::from(i));
            let at = pattern.point(i, geometry::math::Vec2::ZERO);
            let ray = view.ray(at.x * view.width as f32, at.y * view.height as f32);
            let light = path::radiance(world, ray, &mut rng).0;
            [light.emission, light.direct, light.indirect, light.specular].map(|c| f64::from(c.luminance()))
        })
        .collect();
    let all: f64 = found.iter().flatten().sum::<f64>().max(f64::MIN_POSITIVE);
    std::array::from_fn(|k| {
        let sum: f64 = found.iter().map(|f| f[k]).sum();
        let square: f64 = found.iter().map(|f| f[k] * f[k]).sum();
        (sum / all, (square - sum * sum / f64::from(PATHS)).max(0.0).sqrt() / all)
    })
}

/// Share of the lamps' light that comes to diffuse surfaces by way of mirrors and glass alone, and how it is found.
fn caustics(world: &World, config: &Config, seed: u64) -> (f64, String) {
    let pilot = Caustics::trace(world, PARTICLES, seed);
    let power: f32 = world.emitters.power().iter().map(|p| p.luminance()).sum();
    let share = f64::from(pilot.flux().luminance()) / f64::from(power).max(f64::MIN_POSITIVE);
    match pilot.is_empty() {
        true => (0.0, "none found".to_string()),
        false => (share, format!("up to {} particles from the lamps", config.photons)),
    }
}

/// The kinds of materials that reflect or refract.
fn specular_kinds(world: &World) -> Vec<&'static str> {
    let smooth = |m: &Material| m.roughness * m.roughness < 1e-3;
    let of = |m: &Material| -> Option<&'static str> {
        match m {
            m if m.unlit || !m.has_specular(1e-3) => None,
            m if m.may_transmit() && m.volume.is_some() => Some("glass"),
            m if m.may_transmit() => Some("thin glass"),
            m if m.metallic > 0.5 && smooth(m) => Some("mirrors"),
            m if m.metallic > 0.5 => Some("metal"),
            m if smooth(m) => Some("varnish"),
            m if m.roughness * m.roughness < ROUGH => Some("gloss"),
            _ => Some("faint gloss"),
        }
    };
    let mut kinds: Vec<&str> = used(world).into_iter().filter_map(of).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds
}

/// Materials that some triangle has.
fn used(world: &World) -> Vec<&Material> {
    let mut of = vec![false; world.scene.materials.len()];
    world.scene.mesh.materials.iter().for_each(|m| of[m.0 as usize] = true);
    world.scene.materials.iter().zip(of).filter(|(_, used)| *used).map(|(m, _)| m).collect()
}

fn uses(world: &World, ask: impl Fn(&Material) -> bool) -> bool {
    used(world).into_iter().any(ask)
}
