//! Lamps that stay live after the solve: E is linear in what they send out, so each group's part can be scaled by itself.

use crate::solution::{AtSites, Report, Solution};
use geometry::light_groups::NO_GROUP;
use geometry::{LightGroups, Rgb, World};
use thiserror::Error;

/// The light of each group of lamps by itself, on one mesh and one set of rows.
#[derive(Clone, Debug)]
pub(crate) struct Lights {
    /// The groups.
    pub groups: LightGroups,
    /// What each thing that shines sent out when this was solved ([`geometry::Scene::emissions`]).
    pub emissions: Vec<Rgb>,
    /// For each group the indirect irradiance at the sites, lx.
    pub indirect: Vec<Vec<Rgb>>,
    /// The same of the direct one.
    pub direct: Vec<Vec<Rgb>>,
}

/// Why a solution cannot serve a world whose lamps were changed.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum RelightError {
    /// It was solved for all lamps together.
    #[error("the light of its lamps is not kept apart")]
    Together,
    /// The scene has others.
    #[error("it was solved with {then} things that may shine, and the scene has {now}")]
    Count {
        /// When it was solved.
        then: usize,
        /// Now.
        now: usize,
    },
    /// A lamp shone not at all, in some channel.
    #[error(
        "{name:?} did not shine (in one of red, green, blue) when it was solved, and does now: solve again"
    )]
    Dark {
        /// Its group.
        name: String,
    },
    /// Lamps that are one group changed differently.
    #[error("the lamps of {name:?} changed by different factors, and are only kept together: solve again")]
    Apart {
        /// Their group.
        name: String,
    },
}

/// Factors of lamps in one group may differ by this share: rounding of colour times intensity in a file.
const ALIKE: f32 = 1e-4;

impl Lights {
    /// By what factor each group shines brighter in `world` than when this was solved; `None` when none changed.
    fn factors(&self, world: &World) -> Result<Option<Vec<Rgb>>, RelightError> {
        let now = world.scene.emissions();
        if now == self.emissions {
            return Ok(None);
        }
        if now.len() != self.emissions.len() {
            return Err(RelightError::Count { then: self.emissions.len(), now: now.len() });
        }
        let mut factors: Vec<Option<Rgb>> = vec![None; self.groups.len()];
        let names = world.scene.emission_names();
        let groups = self.groups.of_emissions().iter().zip(names);
        for ((&then, &now), (&group, name)) in self.emissions.iter().zip(&now).zip(groups) {
            let name = || name.to_string();
            if now == then || (group == NO_GROUP && now.is_black()) {
                if group != NO_GROUP && !then.is_black() && factors[group as usize].is_none() {
                    factors[group as usize] = Some(Rgb::WHITE);
                }
                continue;
            }
            if group == NO_GROUP {
                return Err(RelightError::Dark { name: name() });
            }
            let ratio = |then: f32, now: f32| match (then > 0.0, now > 0.0) {
                (true, _) => Some(now / then),
                (false, true) => None,
                (false, false) => Some(f32::NAN), // any factor will do
            };
            let [r, g, b] = [(then.r, now.r), (then.g, now.g), (then.b, now.b)].map(|(t, n)| ratio(t, n));
            let (Some(r), Some(g), Some(b)) = (r, g, b) else {
                return Err(RelightError::Dark { name: name() });
            };
            let factor = Rgb::new(r, g, b);
            let merged = match factors[group as usize] {
                None => factor,
                Some(known) => {
                    let merge = |a: f32, b: f32| match (a.is_nan(), b.is_nan()) {
                        (true, _) => Some(b),
                        (_, true) => Some(a),
                        _ => ((a - b).abs() <= ALIKE * a.max(b)).then_some(a),
                    };
                    let all = (merge(known.r, r), merge(known.g, g), merge(known.b, b));
                    let (Some(r), Some(g), Some(b)) = all else {
                        return Err(RelightError::Apart { name: name() });
                    };
                    Rgb::new(r, g, b)
                }
            };
            factors[group as usize] = Some(merged);
        }
        let known = |f: Option<Rgb>| f.unwrap_or(Rgb::WHITE).map(|c| if c.is_nan() { 1.0 } else { c });
        Ok(Some(factors.into_iter().map(known).collect()))
    }
}

/// Σ factor · part over the groups.
fn mixed(parts: &[Vec<Rgb>], factors: &[Rgb]) -> Vec<Rgb> {
    let mut sum = vec![Rgb::BLACK; parts.first().map_or(0, Vec::len)];
    for (part, &factor) in parts.iter().zip(factors) {
        sum.iter_mut().zip(part).for_each(|(sum, &value)| *sum += value * factor);
    }
    sum
}

impl Solution {
    /// The solution for `world` as its lamps shine now, where they shone otherwise when it was solved; in other respects
    /// the world must be the same ([`geometry::Scene::fingerprint`]).
    pub fn relit(&self, world: &World) -> Result<Solution, RelightError> {
        let (at_sites, lights) = self.kept_apart()?;
        Ok(match lights.factors(world)? {
            Some(factors) => self.scaled(at_sites, lights, &factors),
            None => self.clone(),
        })
    }

    /// The same, of a solution that nobody else needs.
    pub(crate) fn into_relit(self, world: &World) -> Result<Solution, RelightError> {
        let (at_sites, lights) = self.kept_apart()?;
        Ok(match lights.factors(world)? {
            Some(factors) => self.scaled(at_sites, lights, &factors),
            None => self,
        })
    }

    /// What each group of lamps does at the sites, where that is known.
    pub(crate) fn kept_apart(&self) -> Result<(&AtSites, &Lights), RelightError> {
        let at_sites = self.at_sites.as_ref().ok_or(RelightError::Together)?;
        Ok((at_sites, at_sites.lights.as_ref().ok_or(RelightError::Together)?))
    }

    fn scaled(&self, at_sites: &AtSites, lights: &Lights, factors: &[Rgb]) -> Solution {
        let indirect = mixed(&lights.indirect, factors);
        // Of other light the same share is in doubt.
        let brighter = |(now, then): (&Rgb, &Rgb)| match then.mean() {
            0.0 => 1.0,
            then => (now.mean() / then).powi(2).min(1e12),
        };
        let brighter = indirect.iter().zip(&at_sites.indirect).map(brighter);
        let at_sites = AtSites {
            doubts: at_sites.doubts.iter().zip(brighter).map(|(&doubt, by)| doubt * by).collect(),
            indirect,
            direct: mixed(&lights.direct, factors),
            ..at_sites.clone()
        };
        let caustics = self.caustics.scaled(factors);
        let report = Report {
            mean: crate::settle::mean(&at_sites.indirect),
            caustic_flux: caustics.flux(),
            ..self.report.clone()
        };
        Solution::of_sites(self.elements.clone(), self.flags.clone(), at_sites, caustics, report)
    }

    /// Mean irradiance over the places where it was gathered, direct and indirect, lx: how much light there is in all.
    pub fn level(&self) -> f32 {
        let means = self
            .at_sites
            .as_ref()
            .map(|s| [&s.direct, &s.indirect].map(|e| crate::settle::mean(e).luminance()));
        means.map_or(0.0, |[direct, indirect]| direct + indirect)
    }

    /// The groups of lamps whose light is kept apart, if it is.
    pub fn light_groups(&self) -> Option<&LightGroups> {
        self.kept_apart().ok().map(|(_, lights)| &lights.groups)
    }

    /// Names of the groups of lamps whose light is kept apart.
    pub fn light_names(&self) -> &[String] {
        self.kept_apart().map_or(&[], |(_, lights)| &lights.groups.names)
    }
}
