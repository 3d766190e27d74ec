//! `twolight inspect`: what is in a scene.

use super::print;
use crate::args::InspectArgs;
use crate::contents::{Contents, contents};
use crate::{cameras, load, solutions};
use anyhow::Result;
use geometry::World;
use geometry::gltf::Loaded;
use raytrace::pixel::View;
use raytrace::plan::Plan;
use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};
use std::process::ExitCode;

/// Runs the command.
pub fn run(args: &InspectArgs) -> Result<ExitCode> {
    if solutions::is_one(&args.scene) {
        print(&solutions::described(&args.scene, args.json)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let loaded = load::scene(&args.scene, &args.which, &[])?;
    if args.plan {
        return plan(args, loaded);
    }
    let contents = contents(&args.scene, &loaded);
    print(&match args.json {
        true => serde_json::to_string_pretty(&contents)?,
        false => contents.to_string(),
    })?;
    Ok(ExitCode::SUCCESS)
}

/// What light each camera sees, and how it will be found.
fn plan(args: &InspectArgs, loaded: Loaded) -> Result<ExitCode> {
    let cameras = cameras::choose(Some("all"), &loaded.cameras, &loaded.scene)?.cameras;
    let world = World::new(loaded.scene);
    let mut plans = BTreeMap::new();
    for camera in &cameras {
        let aspect = camera.aspect.filter(|a| a.is_finite() && *a > 0.0).unwrap_or(1.0);
        let view = View { camera, width: (512.0 * aspect) as u32 + 1, height: 512 };
        plans.insert(&camera.name, Plan::new(&world, &view, args.error, 1));
    }
    if args.json {
        let lines = |plan: &Plan| plan.to_string().lines().map(String::from).collect::<Vec<_>>();
        let plans: BTreeMap<_, _> = plans.iter().map(|(name, plan)| (name, lines(plan))).collect();
        print(&serde_json::to_string_pretty(&plans)?)?;
    } else {
        for (name, plan) in &plans {
            print(&format!("Camera {name:?}, {} % asked:\n{plan}\n", 100.0 * args.error))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

impl Display for Contents {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.scene.display())?;
        for (what, who) in [("by", &self.generator), ("copyright", &self.copyright)] {
            if let Some(who) = who {
                writeln!(f, "{what} {who}")?;
            }
        }
        write!(f, "{} triangles, {} vertices, {} parts", self.triangles, self.vertices, self.parts)?;
        if let Some([lo, hi]) = self.bounds {
            let size = [0, 1, 2].map(|i| hi[i] - lo[i]);
            write!(f, "; {} x {} x {} m", short(size[0]), short(size[1]), short(size[2]))?;
            write!(f, " from ({})", lo.map(short).join(", "))?;
        }
        for (what, names) in [("scenes", &self.scenes), ("variants", &self.variants)] {
            if names.len() > 1 || (what == "variants" && !names.is_empty()) {
                write!(f, "\n{what}: {}", names.join(", "))?;
            }
        }
        writeln!(f, "\n\nMaterials: {}", self.materials.len())?;
        for m in &self.materials {
            let [lo, hi] = m.base_color;
            let range = if hi - lo < 5e-4 { format!("{lo:.3}") } else { format!("{lo:.3} to {hi:.3}") };
            let verb = if m.kind.ends_with("glass") { "passes" } else { "reflects" };
            write!(f, "  {:<24} {:<14} {verb} {range}", m.name, m.kind)?;
            writeln!(f, ", {} triangles", m.triangles)?;
        }
        if !self.textures.is_empty() {
            writeln!(f, "\nTextures: {}", self.textures.len())?;
            for t in &self.textures {
                writeln!(f, "  {:<24} {}x{}", t.name, t.width, t.height)?;
            }
        }
        writeln!(f, "\nLights: {}", self.lights.len())?;
        for l in &self.lights {
            write!(f, "  {:<24} {:<14} {} {}", l.name, l.kind, short(l.intensity), l.unit)?;
            if let Some(lumens) = l.lumens {
                write!(f, ", {} lm", short(lumens))?;
            }
            if let Some(area) = l.area {
                write!(f, ", {} m2", short(area))?;
            }
            writeln!(f)?;
        }
        if self.lights.is_empty() {
            writeln!(f, "  none: a render needs --sky")?;
        }
        writeln!(f, "\nCameras: {}", self.cameras.len())?;
        for (i, c) in self.cameras.iter().enumerate() {
            let [x, y, z] = c.position.map(short);
            writeln!(f, "  {i} {:<22} {:<14} at ({x}, {y}, {z}) m, {}", c.name, c.kind, c.view)?;
        }
        if self.cameras.is_empty() {
            writeln!(f, "  none: a render frames the whole scene")?;
        }
        for (what, names) in [("used", &self.extensions_used), ("required", &self.extensions_required)] {
            if !names.is_empty() {
                writeln!(f, "\nExtensions {what}: {}", names.join(", "))?;
            }
        }
        if !self.warnings.is_empty() {
            writeln!(f, "\nWarnings: {}", self.warnings.len())?;
            for w in &self.warnings {
                writeln!(f, "  {w}")?;
            }
        }
        if !self.findings.is_empty() {
            writeln!(f, "\nFindings: {}", self.findings.len())?;
            for d in &self.findings {
                writeln!(f, "  {}: {}\n    to do: {}", d.place, d.problem, d.remedy)?;
            }
        }
        Ok(())
    }
}

/// Four digits, without a tail of zeros.
fn short(v: f32) -> String {
    let v = f64::from(v);
    if v == 0.0 {
        return "0".into();
    }
    let digits = 3 - v.abs().log10().floor() as i32;
    if !(-3..=8).contains(&digits) {
        return format!("{v:.3e}");
    }
    let scale = 10f64.powi(digits);
    format!("{}", (v * scale).round() / scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (v, text) in
            [(0.0, "0"), (1.0, "1"), (5.486543, "5.487"), (-0.01234567, "-0.01235"), (12345.6, "12350")]
        {
            assert_eq!(short(v), text);
        }
        assert_eq!(short(3e20), "3.000e20");
    }
}
