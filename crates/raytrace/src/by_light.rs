//! The picture as a sum of pictures, one for each group of lamps: to be dimmed and tinted afterwards, in any program.

use crate::film::{Film, Pixel};
use crate::pixel::View;
use crate::render::{Integrator, Outcome, Progress, Report, Settings, facts, render};
use crate::verify::Probes;
use geometry::light_groups::NO_GROUP;
use geometry::{Camera, LightGroups, Rgb, Scene, World};
use radiosity::Solution;
use std::collections::BTreeMap;
use std::time::Instant;

/// Name of the layer of what shows without lighting anything, as KHR_materials_unlit does.
pub const UNLIT: &str = "unlit";

/// A group that makes the share s of the light may be rougher by itself by the factor s^-this. 1/2 would do if it made that
/// share of every pixel's, 0 if every pixel had a lamp of its own.
const LOCAL: f32 = 0.25;

/// Renders what each group of lamps adds, one after the other, and the sum of it all, which is about as exact as asked. In
/// the end the world shines as before.
///
/// - `solution`: made with [`Settings::by_light`]; not needed for paths.
pub fn render_by_light(
    world: &mut World,
    camera: &Camera,
    solution: Option<&Solution>,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Outcome, radiosity::Error> {
    let groups = match solution.and_then(Solution::light_groups) {
        Some(groups) => groups.clone(),
        None => LightGroups::new(world),
    };
    let mut names = groups.names.clone();
    let shows = |(&group, emission): (&u16, Rgb)| group == NO_GROUP && !emission.is_black();
    let emissions = world.scene.emissions();
    if world.scene.materials.iter().any(|m| m.unlit) || groups.of_emissions().iter().zip(emissions).any(shows)
    {
        names.push(UNLIT.into());
    }
    let as_it_was = world.scene.lights_and_materials();
    let before = world.bvh.rays_cast();
    let mut sum: Option<Film> = None;
    let (mut by_light, mut finished) = (Vec::new(), true);
    let mut stages: BTreeMap<&'static str, f64> = BTreeMap::new();
    for (i, name) in names.iter().enumerate() {
        leave(&mut world.scene, &groups, i);
        world.relight();
        // It was solved for these very lamps, so that it can be had for some of them.
        let lit = solution.map(|s| s.relit(world).expect("the solution keeps the lamps of this world apart"));
        let left = (names.len() - i) as u32;
        let share = |end: Instant| Instant::now() + end.saturating_duration_since(Instant::now()) / left;
        let part = lit.as_ref().zip(solution).map_or(1.0, |(lit, all)| lit.level() / all.level().max(1e-30));
        let settings = Settings {
            verify: false,
            error: (settings.error * part.max(1e-6).powf(-LOCAL)).min(0.5),
            deadline: settings.deadline.map(share),
            ..settings.clone()
        };
        let outcome = render(world, camera, lit.as_ref(), &settings, &Unseen(progress));
        world.scene.restore(&as_it_was);
        world.relight();
        let outcome = outcome?;
        finished &= outcome.finished;
        for (stage, seconds) in outcome.report.stages {
            *stages.entry(stage).or_default() += seconds;
        }
        by_light.push((name.clone(), outcome.film.beauty()));
        sum = Some(match sum {
            Some(film) => added(film, &outcome.film),
            None => outcome.film,
        });
    }
    // Without any light the picture is black, but it is one.
    let film = match sum {
        Some(film) => film,
        None => render(world, camera, solution, settings, progress)?.film,
    };
    let mut report = Report {
        stages: stages.into_iter().collect(),
        texts: solution.map_or_else(Vec::new, |s| facts(&s.report)),
        radiosity: solution.map(|s| s.report.clone()),
        verdict: None,
    };
    if finished && settings.verify && settings.integrator == Integrator::Hybrid {
        let clock = Instant::now();
        let view = View { camera, width: settings.width, height: settings.height };
        let took = world.bvh.rays_cast() - before;
        let probes = Probes::trace(world, &view, &film, settings.error, settings.seed, took, progress);
        report.verdict = probes.map(|probes| probes.judge(&film, settings.error));
        report.stages.push(("verify", clock.elapsed().as_secs_f64()));
    }
    if let Some(verdict) = report.verdict {
        report.texts.push(("error measured".into(), verdict.to_string()));
    }
    Ok(Outcome { film, by_light, finished, report })
}

/// Shows no pictures: each would be of one group alone.
struct Unseen<'a>(&'a dyn Progress);

impl Progress for Unseen<'_> {
    fn stage(&self, name: &'static str, total: u64) {
        self.0.stage(name, total);
    }
    fn advance(&self, n: u64) {
        self.0.advance(n);
    }
    fn stopped(&self) -> bool {
        self.0.stopped()
    }
}

/// Leaves of all that shines or shows by itself one group, or with a number beyond the groups what is in none.
fn leave(scene: &mut Scene, groups: &LightGroups, number: usize) {
    let rest = number >= groups.len();
    scene.leave_lights(|i| match groups.of_emissions().get(i) {
        Some(&NO_GROUP) => rest,
        Some(&group) => group as usize == number,
        None => false,
    });
    for material in scene.materials.iter_mut().filter(|m| m.unlit && !rest) {
        material.base_color = Rgb::BLACK;
    }
}

/// Light of both; what the eye met is the same for both.
fn added(mut film: Film, other: &Film) -> Film {
    for (a, b) in film.pixels.iter_mut().zip(&other.pixels) {
        *a = Pixel {
            direct: a.direct + b.direct,
            indirect: a.indirect + b.indirect,
            specular: a.specular + b.specular,
            emission: a.emission + b.emission,
            irradiance: a.irradiance + b.irradiance,
            variance: a.variance + b.variance,
            samples: a.samples.max(b.samples),
            ..*a
        };
    }
    film.repaired += other.repaired;
    film
}
