//! Diffuse light: the Lambertian base under its cover, what comes through it from behind, and what wide microfacets
//! scatter all about.

use super::albedo;
use super::over::{self, Over};
use super::shading::Film;
use crate::Rgb;
use std::f32::consts::FRAC_1_PI;
use std::sync::Arc;

/// f = ρ/π · (1 − E(θo)) (1 − E(θi)) / (1 − E̅), with E the directional albedo of what lies above, E̅ its mean.
///
/// C. Kelemen and L. Szirmay-Kalos, "A Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling",
/// Eurographics 2001. Reciprocal; under uniform light it sends ρ (1 − E(θo)), just what the cover has left. Light from
/// behind has the same form, and so has, with an E of its own, what wide microfacets lose (see `multiple`).
#[derive(Clone, Debug)]
pub struct Diffuse {
    base: Rgb,
    behind: Rgb,
    facets: Rgb,
    cover: Cover,
    /// 1 − E̅.
    mean_passed: f32,
    /// The same of the facets.
    mean_lost: f32,
}

/// What keeps light off the base.
#[derive(Clone, Debug)]
pub struct Cover {
    /// Width of the coat.
    pub alpha: f32,
    /// Its strength.
    pub specular: f32,
    /// Its F0.
    pub f0: Rgb,
    /// Share of the light lost between facets that the coat gives back itself.
    pub regained: f32,
    /// A film on it.
    pub film: Option<Film>,
    /// What lies over the coat.
    pub over: Option<Arc<Over>>,
}

impl Diffuse {
    /// - `base`, `behind`: reflectance and transmittance under the cover, [0, 1], metal and glass taken off.
    /// - `facets`: share of the light lost between facets that comes out, [0, 1]; black where they are narrow.
    pub fn new(base: Rgb, behind: Rgb, facets: Rgb, cover: Cover) -> Diffuse {
        let mut out = Diffuse { base, behind, facets, cover, mean_passed: 1.0, mean_lost: 1.0 };
        let cover = &out.cover;
        if cover.film.is_some() || cover.over.is_some() {
            out.mean_passed = over::mean(|cos| out.passed(cos));
        } else if cover.specular > 0.0 {
            out.mean_passed = 1.0 - cover.specular * cover.of(albedo::hemispherical(cover.alpha));
        }
        // A cover that lets nothing in hides its base, and would divide by zero.
        if out.mean_passed <= 1e-4 {
            (out.base, out.behind) = (Rgb::BLACK, Rgb::BLACK);
        }
        if !facets.is_black() {
            out.mean_lost = match &out.cover.over {
                Some(_) => over::mean(|cos| out.lost(cos)).max(1e-5),
                None => 1.0 - albedo::hemispherical(out.cover.alpha).all,
            };
        }
        out
    }

    /// Whether any light is reflected diffusely.
    pub fn is_present(&self) -> bool {
        !self.base.is_black() || !self.facets.is_black()
    }

    /// Whether any light comes through diffusely.
    pub fn is_translucent(&self) -> bool {
        !self.behind.is_black()
    }

    /// f, 1/sr, for two positive cosines on one side.
    pub fn eval(&self, cos_o: f32, cos_i: f32) -> Rgb {
        let mut f = Rgb::BLACK;
        if !self.base.is_black() {
            f += self.base * (FRAC_1_PI * self.passed(cos_o) * self.passed(cos_i) / self.mean_passed);
        }
        if !self.facets.is_black() {
            f += self.facets * (FRAC_1_PI * self.lost(cos_o) * self.lost(cos_i) / self.mean_lost);
        }
        f
    }

    /// f, 1/sr, for light that comes from behind with `cos_i` > 0 to the normal there.
    pub fn eval_behind(&self, cos_o: f32, cos_i: f32) -> Rgb {
        if self.behind.is_black() {
            return Rgb::BLACK;
        }
        self.behind * (FRAC_1_PI * self.passed(cos_o) * self.passed(cos_i) / self.mean_passed)
    }

    /// Share of uniform light that is sent to `cos_o` on its own side.
    pub fn albedo(&self, cos_o: f32) -> Rgb {
        let mut albedo = Rgb::BLACK;
        if cos_o > 0.0 && !self.base.is_black() {
            albedo += self.base * self.passed(cos_o);
        }
        if cos_o > 0.0 && !self.facets.is_black() {
            albedo += self.facets * self.lost(cos_o);
        }
        albedo
    }

    /// Share of uniform light behind that is sent to `cos_o`.
    pub fn albedo_behind(&self, cos_o: f32) -> Rgb {
        if cos_o > 0.0 && self.is_translucent() { self.behind * self.passed(cos_o) } else { Rgb::BLACK }
    }

    /// Share of uniform light that is reflected to anywhere.
    pub fn reflectance(&self) -> Rgb {
        self.base * self.mean_passed + self.facets * self.mean_lost
    }

    /// The lobe through the surface alone, as reflection: what the other side does with its light for this one.
    pub fn turned(&self) -> Diffuse {
        Diffuse { base: self.behind, behind: Rgb::BLACK, facets: Rgb::BLACK, ..self.clone() }
    }

    /// 1 − E: share of light along a direction that gets past the cover.
    fn passed(&self, cos: f32) -> f32 {
        let c = &self.cover;
        let mut passed = 1.0;
        if c.specular > 0.0 {
            passed = (1.0 - c.specular * c.of(albedo::directional(c.alpha, cos))).max(0.0);
        }
        match &c.over {
            Some(over) => passed * over.passed(cos),
            None => passed,
        }
    }

    /// Share of light along a direction that single scattering loses.
    fn lost(&self, cos: f32) -> f32 {
        let lost = (1.0 - albedo::directional(self.cover.alpha, cos).all).max(0.0);
        match &self.cover.over {
            Some(over) => lost * over.passed(cos),
            None => lost,
        }
    }
}

impl Cover {
    /// Share of light that the coat keeps off.
    fn of(&self, e: albedo::Directional) -> f32 {
        let reflected = match &self.film {
            None => e.with_f0(self.f0.max_channel()),
            film => e.under(self.f0, film.as_ref()).max_channel(),
        };
        reflected + self.regained * (1.0 - e.all)
    }
}
