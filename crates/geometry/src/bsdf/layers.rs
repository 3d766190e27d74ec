//! How strong each lobe of a material is: metal, coat, diffuse base, transmission.

use super::albedo::{self, Directional};
use super::diffuse::{Cover, Diffuse};
use super::film;
use super::ggx::{Ggx, SMOOTH_ROUGHNESS};
use super::glass::{self, Spread};
use super::multiple;
use super::over::Over;
use super::shading::{Film, Shading, is_index_matched};
use crate::Rgb;
use crate::optics::{f0_from_ior, fresnel_dielectric, schlick};
use std::sync::Arc;

/// What glass loses between its facets on the average where it is too little for a lobe of its own.
const FAINT: f32 = 0.004;

/// The lobes of one side of a surface: how much each carries, by the cosine to the microfacet's normal.
#[derive(Clone, Debug)]
pub struct Layers {
    /// The diffuse light under the coat.
    pub(super) diffuse: Diffuse,
    /// What lies over everything else; elsewhere in memory, for few materials have it (inside, it cost the others 3 %
    /// of their time).
    pub(super) over: Option<Arc<Over>>,
    /// What rough glass scatters more than once.
    pub(super) spread: Option<Spread>,
    /// The microfacets; meaningless for perfect lobes.
    pub(super) ggx: Ggx,
    /// Their width all round; 0 for perfect lobes.
    alpha: f32,
    base_color: Rgb,
    metal: f32,
    /// Share of dielectric with Schlick's coat: all of it but solid glass.
    coat: f32,
    /// F0 of that coat.
    f0: Rgb,
    /// Strength of the coat and of the glass's reflection.
    specular: f32,
    specular_color: Rgb,
    thin: f32,
    solid: f32,
    /// n on wo's side over n on the other; 1 for a thin wall.
    eta: f32,
    /// What the lobes of metal and coat get back of the light lost between narrow facets; black for none.
    regained: [Rgb; 2],
    film: Option<Film>,
}

impl Layers {
    /// `front`: whether the path came from the outside.
    pub fn new(shading: &Shading, front: bool) -> Layers {
        let s = shading;
        let matched = is_index_matched(s.ior);
        let dielectric = 1.0 - s.metallic;
        // No index at all (KHR_materials_ior's 0) means that everything is reflected, so nothing gets in.
        let transmission = if s.ior > 0.0 { s.transmission } else { 0.0 };
        let solid = if s.solid { dielectric * transmission } else { 0.0 };
        let thin = if s.solid { 0.0 } else { dielectric * transmission };
        let smooth = s.roughness < SMOOTH_ROUGHNESS || (solid > 0.0 && matched);
        let (ggx, alpha) = if smooth { (Ggx::round(1.0), 0.0) } else { widths(s) };
        let eta = if solid == 0.0 || matched {
            1.0
        } else if front {
            1.0 / s.ior
        } else {
            s.ior
        };
        // Without a step of the index there is no interface to reflect; Schlick's formula would, at grazing angles.
        let specular = if s.ior == 1.0 { 0.0 } else { s.specular };
        let f0 = (s.specular_color * f0_from_ior(s.ior)).min(Rgb::WHITE);
        let coat = dielectric - solid;
        let of_metal = if s.metallic > 0.0 { multiple::regained(alpha, s.base_color) } else { Rgb::BLACK };
        let of_coat = if coat * specular > 0.0 { multiple::regained(alpha, f0) } else { Rgb::BLACK };
        let (mut facets, mut regained) = (Rgb::BLACK, [of_metal, of_coat]);
        if (s.metallic > 0.0 || !of_coat.is_black()) && multiple::is_wide(alpha) {
            facets = of_metal * s.metallic + of_coat * (coat * specular);
            regained = [Rgb::BLACK; 2];
        }
        let through = if alpha > 0.0 && thin + solid > 0.0 {
            let spread = Spread::new(alpha, eta, solid == 0.0);
            (spread.mean_lost() > FAINT).then_some(spread)
        } else {
            None
        };
        // Varnish on a solid is on its outside.
        let over = if solid > 0.0 && !front { None } else { Over::new(s).map(Arc::new) };
        let base = s.base_color * (dielectric * (1.0 - transmission));
        let film = s.film.filter(|f| f.share > 0.0);
        let cover = Cover { alpha, specular, f0, regained: of_coat.max_channel(), film, over: over.clone() };
        let (share, color) = s.translucency.map_or((0.0, Rgb::BLACK), |t| (t.share, t.color));
        let behind = color * (share * dielectric * (1.0 - transmission));
        let diffuse = Diffuse::new(base * (1.0 - share), behind, facets, cover);
        Layers {
            diffuse,
            over,
            spread: through,
            ggx,
            alpha,
            base_color: s.base_color,
            metal: s.metallic,
            coat,
            f0,
            specular,
            specular_color: s.specular_color,
            thin,
            solid,
            eta,
            regained,
            film,
        }
    }

    /// Refracts by another index, `eta` = n on wo's side over n on the other, where it refracts at all.
    pub fn refract_by(&mut self, eta: f32) {
        if self.solid > 0.0 && self.eta != 1.0 {
            self.eta = eta;
            self.spread = self.spread.map(|_| Spread::new(self.alpha, eta, false));
        }
    }

    /// GGX width; 0 for perfect lobes.
    pub fn alpha(&self) -> f32 {
        self.alpha
    }

    /// n on wo's side over n on the other; 1 when light does not bend.
    pub fn eta(&self) -> f32 {
        self.eta
    }

    /// Whether transmitted light is refracted (a volume) rather than passed by a thin wall.
    pub fn refracts(&self) -> bool {
        self.solid > 0.0
    }

    /// Whether reflection and transmission of what lies below clearcoat and fuzz are perfect.
    pub fn is_delta(&self) -> bool {
        self.alpha == 0.0
    }

    /// Whether there is any lobe other than diffuse below clearcoat and fuzz.
    pub fn has_specular(&self) -> bool {
        // Schlick's term reaches 1 at grazing angles whatever F0, so only the strength decides.
        self.metal > 0.0 || self.specular * self.coat > 0.0 || self.thin + self.solid > 0.0
    }

    /// Share of the light on a microfacet that it reflects, [0, 1]; `cos`: from its normal to either direction.
    pub fn reflection(&self, cos: f32) -> Rgb {
        let mut sum = self.schlick(self.base_color, cos) * self.metal;
        sum += self.schlick(self.f0, cos) * (self.coat * self.specular);
        if self.solid > 0.0 {
            sum += self.glass(cos) * self.solid;
        }
        sum
    }

    /// What [`Layers::reflection`] at a facet that makes `cos` with both directions gains by light that bounces between
    /// facets, where the lobe is narrow enough to be made stronger by it.
    pub fn regained(&self, cos: f32, cos_o: f32, cos_i: f32) -> Rgb {
        if self.regained[0].is_black() && self.regained[1].is_black() {
            return Rgb::BLACK;
        }
        let mut sum = self.schlick(self.base_color, cos) * self.regained[0] * self.metal;
        sum += self.schlick(self.f0, cos) * self.regained[1] * (self.coat * self.specular);
        sum * multiple::strengthening(self.alpha, cos_o, cos_i)
    }

    /// Share of the light on a microfacet that it lets through, tinted, [0, 1]; without the η² of radiance.
    pub fn transmission(&self, cos: f32) -> Rgb {
        if self.solid > 0.0 {
            self.base_color * self.left(self.glass(cos)) * self.solid
        } else if self.thin > 0.0 {
            self.base_color * self.left(self.schlick(self.f0, cos) * self.specular) * self.thin
        } else {
            Rgb::BLACK
        }
    }

    /// Share of light that a perfect lobe lets through at `cos`, all layers passed.
    pub fn straight(&self, cos: f32) -> Rgb {
        self.transmission(cos) * self.over.as_ref().map_or(1.0, |over| over.passed(cos))
    }

    /// Share of the light lost between the facets of glass that comes back, and that goes through.
    pub fn spread_colors(&self) -> [Rgb; 2] {
        let share = self.thin + self.solid;
        [Rgb::splat(share), self.base_color * share]
    }

    /// Share of light from everywhere that reflection and transmission together send to `cos_o`, as if nothing lay over
    /// them.
    pub fn specular_albedo(&self, cos_o: f32) -> Rgb {
        if cos_o <= 0.0 || !self.has_specular() {
            return Rgb::BLACK;
        }
        let scattered = albedo::directional(self.alpha, cos_o);
        let narrow = 1.0 / scattered.all.max(0.5) - 1.0;
        let again = |regained: Rgb| Rgb::WHITE + regained * narrow;
        let under = |f0: Rgb| scattered.under(f0, self.film.as_ref());
        let mut sum = under(self.base_color) * again(self.regained[0]) * self.metal;
        sum += under(self.f0) * again(self.regained[1]) * (self.coat * self.specular);
        if self.thin > 0.0 {
            let passed = self.left(under(self.f0) * self.specular) - Rgb::splat(1.0 - scattered.all);
            sum += self.base_color * passed * self.thin;
        }
        if self.solid > 0.0 {
            sum += if self.is_delta() {
                self.glass(cos_o) * self.solid + self.transmission(cos_o)
            } else {
                let once = glass::once(self.alpha, self.eta, cos_o);
                let tint = (self.specular_color * self.specular).min(Rgb::WHITE);
                let reflected = tint * once.reflected;
                let passed = once.passed + once.reflected * (1.0 - tint.max_channel());
                (reflected + self.base_color * passed) * self.solid
            };
        }
        if let Some(spread) = &self.spread {
            let [back, through] = self.spread_colors();
            sum += (back * spread.back + through * (1.0 - spread.back)) * spread.lost(cos_o, false);
        }
        sum
    }

    /// What a facet that reflects `reflected` lets in. A tinted coat keeps off what its strongest channel says
    /// (KHR_materials_specular); the colours of a film are each other's complement.
    fn left(&self, reflected: Rgb) -> Rgb {
        match self.film {
            None => Rgb::splat(1.0 - reflected.max_channel()),
            Some(_) => Rgb::WHITE - reflected,
        }
    }

    /// Schlick's term, or that of the film for its share of the surface.
    fn schlick(&self, f0: Rgb, cos: f32) -> Rgb {
        match &self.film {
            None => schlick(f0, cos),
            Some(f) => schlick(f0, cos).lerp(film::reflectance(f, f0, cos), f.share),
        }
    }

    /// Fresnel reflectance of solid glass; the specular factors dim and tint it except where all is reflected.
    fn glass(&self, cos: f32) -> Rgb {
        let f = fresnel_dielectric(cos, self.eta);
        if f >= 1.0 {
            return Rgb::WHITE;
        }
        let plain = (self.specular_color * f).min(Rgb::WHITE) * self.specular;
        let Some(film) = &self.film else { return plain };
        // From within, the film is met as from without at the angle that light leaves by.
        let sin2 = (1.0 - cos * cos) * self.eta * self.eta;
        let outside = if self.eta > 1.0 { (1.0 - sin2).max(0.0).sqrt() } else { cos };
        plain.lerp(film::reflectance(film, self.f0, outside) * self.specular, film.share)
    }
}

/// Widths along tangent and bitangent, and the mean (KHR_materials_anisotropy, "Anisotropy Direction and Strength").
fn widths(s: &Shading) -> (Ggx, f32) {
    let alpha = s.roughness * s.roughness;
    match s.anisotropy {
        None => (Ggx::round(alpha), alpha),
        Some((strength, _)) => {
            let x = alpha + (1.0 - alpha) * strength * strength;
            // The round lobe of this width loses between its facets as much as this one, to 3 % of the light.
            (Ggx { x, y: alpha }, (0.5 * (x * x + alpha * alpha)).sqrt())
        }
    }
}

impl Directional {
    /// Albedo of facets of reflectance `f0` at normal incidence, with the film's colours where there is one.
    pub(super) fn under(self, f0: Rgb, film: Option<&Film>) -> Rgb {
        let plain = f0.map(|f0| self.with_f0(f0));
        let Some(film) = film else { return plain };
        // Facets are met at this cosine, by the mean of Schlick's (1 − cos)⁵ over them.
        let cos = 1.0 - (self.grazing / self.all.max(1e-6)).clamp(0.0, 1.0).powf(0.2);
        plain.lerp(film::reflectance(film, f0, cos) * self.all, film.share)
    }
}
