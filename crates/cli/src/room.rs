//! A scene that can be worked in: read, lit, and made ready for rays.

use crate::args::{LightArgs, WhichArgs};
use crate::job::AskedWrongly;
use crate::load;
use crate::progress::Bars;
use anyhow::{Context, Result};
use geometry::gltf::Loaded;
use geometry::{Camera, MaterialId, Scene, World};
use raytrace::Progress;
use std::path::Path;
use std::time::Instant;

/// A scene, loaded and built.
#[derive(Debug)]
pub struct Room {
    /// The scene and what answers questions about it.
    pub world: World,
    /// The file's cameras.
    pub cameras: Vec<Camera>,
    /// What was odd about the file.
    pub warnings: Vec<String>,
    /// Seconds of each stage.
    pub stages: Vec<(&'static str, f64)>,
}

impl Room {
    /// Reads `path`, lights it as asked, builds the tree; says on stderr what is odd.
    pub fn open(path: &Path, which: &WhichArgs, light: &LightArgs, bars: &Bars) -> Result<Room> {
        let mut clock = Instant::now();
        bars.stage("load", 0);
        let loaded = load_lit(path, which, light)?;
        for warning in &loaded.warnings {
            bars.note(&format!("warning: {warning}"));
        }
        if !is_lit(&loaded.scene) {
            bars.note("warning: nothing in the file shines, all will be black: try --sky 1000 (cd/m2)");
        }
        let mut stages = vec![("load", lap(&mut clock))];
        bars.stage("build", 0);
        let world = World::new(loaded.scene);
        stages.push(("build", lap(&mut clock)));
        Ok(Room { world, cameras: loaded.cameras, warnings: loaded.warnings, stages })
    }

    /// Reads `path` again at another time; returns whether anything but cameras is different there.
    pub fn go_to(&mut self, path: &Path, which: &WhichArgs, light: &LightArgs) -> Result<bool> {
        let loaded = load_lit(path, which, light)?;
        self.cameras = loaded.cameras;
        let (before, now) = (&self.world.scene, &loaded.scene);
        if before.fingerprint() == now.fingerprint() && before.emissions() == now.emissions() {
            return Ok(false);
        }
        self.world = World::new(loaded.scene);
        Ok(true)
    }
}

/// The scene of `path` as it is to shine.
fn load_lit(path: &Path, which: &WhichArgs, light: &LightArgs) -> Result<Loaded> {
    let mut loaded = load::scene(path, which, &light.webs)?;
    if let Some(value) = &light.sky {
        loaded.scene.sky = Some(load::sky(value, light.sky_strength)?);
    }
    let names = loaded.scene.light_names();
    for (name, factor) in &light.lights {
        if !names.contains(name) {
            let known = if names.is_empty() { "none".into() } else { names.join(", ") };
            let message = format!("there is no light {name:?}; the file has {known}");
            return Err(AskedWrongly(message).into());
        }
        loaded.scene.scale_lights(name, *factor);
    }
    Ok(loaded)
}

/// Starts `threads` threads, or one for each processor.
pub fn start_threads(threads: Option<u32>) -> Result<()> {
    let Some(n) = threads else { return Ok(()) };
    rayon::ThreadPoolBuilder::new().num_threads(n as usize).build_global().context("cannot start threads")
}

/// Seconds since `clock` was last asked.
pub fn lap(clock: &mut Instant) -> f64 {
    let now = Instant::now();
    now.duration_since(std::mem::replace(clock, now)).as_secs_f64()
}

/// Whether anything shines.
fn is_lit(scene: &Scene) -> bool {
    let used =
        |m: &MaterialId| scene.materials.get(m.0 as usize).is_some_and(|m| m.unlit || !m.emissive.is_black());
    scene.sky.is_some() || !scene.lights.is_empty() || scene.mesh.materials.iter().any(used)
}
