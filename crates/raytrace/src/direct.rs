//! Light straight from the emitters at one point: how it is divided among them, and what comes of it.
//!
//! For a polygon of even radiance the unshadowed irradiance is exact (Lambert's contour integral); rays only tell
//! the visible share of it, so a point that sees a whole lamp has no noise at all (Heitz, Hill and McGuire,
//! "Combining Analytic Direct Illumination and Stochastic Shadows", I3D 2018).

use geometry::emitter::{EmitterKind, Group, LightSample, SeenLight};
use geometry::sampling::Rng;
use geometry::{Outlook, Rgb, Surface, Vec3, World};

/// Up to so many lights are looked at one by one; more are put into as many groups at most.
const FEW: usize = 32;
/// A group that brings this share of the unshadowed light gets rays of its own; the smaller ones share some.
const OWN: f32 = 0.04;
/// This share of the chances of those that share rays is the same for all: a lamp of which only a sliver rises over
/// the horizon brings next to nothing, but the one ray that finds the sliver must not count for a thousand (it left
/// white dots in a furnace).
const EVEN: f32 = 0.2;

/// Which strata this pixel takes of the pattern that its neighbours complete, and where its rays start.
#[derive(Clone, Copy, Debug)]
pub struct Spend<'a> {
    /// Place in the 4 × 4 block of pixels, 0 … 15.
    pub phase: u32,
    /// Where shadow rays start from in turn, at least one place: the edge of a shadow may run through the pixel.
    pub places: &'a [Start<'a>],
}

/// A point of the surface that is lit.
#[derive(Clone, Copy, Debug)]
pub struct Start<'a> {
    /// Where.
    pub position: Vec3,
    /// The surface there and the way to the eye, for its gloss: a tube turns its highlight within a pixel. That which is lit
    /// as a whole if absent.
    pub seen: Option<(&'a Surface, Vec3)>,
}

impl Start<'_> {
    /// A point like all others of the surface.
    pub fn at(position: Vec3) -> Start<'static> {
        Start { position, seen: None }
    }
}

/// From one place to the next: no divisor of the numbers of places, which are powers of four and less, so that strata of
/// the lamp and places do not go hand in hand.
const STRIDE: u32 = 7;

/// Which of `places` sample `k` of `times` starts from: in turn, or where there are more of them, one of each of as many
/// parts of their row, which begins at one edge of the pixel and ends at the other.
fn place_of(k: u32, times: u32, turn: u32, places: u32) -> usize {
    if times >= places {
        return ((k * STRIDE + turn) % places) as usize;
    }
    let part = u64::from((k * STRIDE + turn) % times);
    // Not the same place of each part: rows of a pixel are as long as parts may be.
    let within = u64::from(k.wrapping_add(turn).wrapping_mul(0x9e37_79b9));
    let places = u64::from(places);
    ((((part << 32) + within) * places / u64::from(times)) >> 32).min(places - 1) as usize
}

/// Which lights are sampled at a point, how often.
#[derive(Debug, Default)]
pub struct Plan<'a> {
    entries: Vec<Entry>,
    /// The sky, if there is one.
    sky: Option<SeenLight<'a>>,
    /// Samples drawn from the entries that share them.
    pool: u32,
}

/// A light, or several as one.
#[derive(Clone, Copy, Debug)]
struct Entry {
    group: Group,
    samples: u32,
    /// Probability with which it is chosen for each of the samples: 1 where they are its own.
    chance: f32,
    /// About its unshadowed irradiance, mean of the channels, lx.
    irradiance: f32,
}

impl<'a> Plan<'a> {
    /// Divides `samples` among the lights as they would shine on `p` with normal `n` if nothing stood between.
    ///
    /// - `outlook`: through which windows the sky is looked for.
    /// - `samples`: shadow rays for a light that brings all of the light; of these the power of four next below, for their
    ///   strata fill a square.
    pub fn new(world: &'a World, outlook: Option<&'a Outlook>, p: Vec3, n: Vec3, samples: u32) -> Plan<'a> {
        if world.emitters.is_empty() || samples == 0 {
            return Plan::default();
        }
        let samples = 4u32.pow(samples.ilog(4));
        let groups = world.emitters.groups(p, n, FEW);
        let total: f32 = groups.iter().map(|g| g.1).sum();
        if total <= 0.0 {
            return Plan::default();
        }
        let is_small = |w: f32| w > 0.0 && w < OWN * total;
        let (few, small) =
            groups.iter().filter(|g| is_small(g.1)).fold((0.0, 0.0), |(n, sum), g| (n + 1.0, sum + g.1));
        let (few, pool) = if few > 1.0 { (few, (samples / 8).max(1)) } else { (0.0, 0) };
        let entry = |(group, irradiance): (Group, f32)| {
            if pool > 0 && is_small(irradiance) {
                let chance = (1.0 - EVEN) * irradiance / small + EVEN / few;
                return Entry { group, samples: pool, chance, irradiance };
            }
            // The strata come in powers of four; a light that brings a quarter of the light deserves a quarter of
            // the rays for the same noise.
            let share = (samples as f32 * irradiance / total).max(1.0);
            let own = (0..8).map(|k| 4u32.pow(k)).find(|&n| n as f32 >= share);
            Entry { group, samples: own.unwrap_or(samples).min(samples), chance: 1.0, irradiance }
        };
        let entries = groups.into_iter().filter(|g| g.1 > 0.0).map(entry).collect();
        Plan { entries, sky: world.emitters.sky_seen_from(outlook, p, n), pool }
    }

    /// Expected number of samples per solid angle (1/sr) toward `point` on the emissive `triangle`: what multiple
    /// importance sampling weighs a ray that ran into it by.
    pub fn density(&self, world: &World, p: Vec3, n: Vec3, triangle: u32, point: Vec3) -> f32 {
        let Some(light) = world.emitters.light_of_triangle(triangle) else { return 0.0 };
        let entry = self.entries.iter().find(|e| world.emitters.is_in_group(e.group, light));
        entry.map_or(0.0, |e| {
            e.samples as f32 * e.chance * world.emitters.pdf_in_group(e.group, p, n, triangle, point)
        })
    }

    /// As [`Plan::density`], toward the sky.
    pub fn density_sky(&self, wi: Vec3) -> f32 {
        let of = |e: &Entry| Some(e.samples as f32 * e.chance * self.sky_of(e.group)?.pdf_of_sky(wi));
        self.entries.iter().find_map(of).unwrap_or(0.0)
    }

    /// The sky, if `group` is it: drawn by the windows of this plan in all places.
    fn sky_of(&self, group: Group) -> Option<&SeenLight<'a>> {
        self.sky.as_ref().filter(|sky| group == Group::Light(sky.light()))
    }
}

/// Light of the emitters at a point.
#[derive(Clone, Copy, Debug, Default)]
pub struct Direct {
    /// Radiance that the diffuse lobe sends on, cd/m².
    pub diffuse: Rgb,
    /// Radiance that the glossy lobes send on, cd/m², weighed against rays that look for it themselves.
    pub glossy: Rgb,
    /// Irradiance with shadows, lx.
    pub irradiance: Rgb,
    /// Of it, that of lamps without extent that are looked for one by one: their shadows have hard edges.
    pub hard: Rgb,
    /// Estimated variance of the luminance of `diffuse` and `glossy`, (cd/m²)².
    pub variance: f32,
    /// The same of those lamps: other points of the surface make it smaller, more rays do not.
    pub hard_variance: f32,
}

/// What is asked of the glossy lobes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gloss {
    /// Nothing.
    None,
    /// All of the emitters' light through them.
    All,
    /// What rays through the lobes do not find better themselves: one such ray is sent.
    Shared,
}

/// Samples the lights of `plan` from `surface` toward `wo`.
pub fn direct(
    world: &World,
    surface: &Surface,
    wo: Vec3,
    plan: &Plan,
    gloss: Gloss,
    spend: Spend,
    rng: &mut Rng,
) -> Direct {
    let mut out = Direct::default();
    // Which place goes with which stratum of a lamp is drawn anew each time: always the same would count some parts of the
    // lamp from one side of the pixel alone (the worst column of a penumbra was 2.4 % of the full light off, now below 2 %).
    let turn = if spend.places.len() > 1 { rng.below(spend.places.len() as u32) } else { 0 };
    let place = |k: u32, times: u32| spend.places[place_of(k, times, turn, spend.places.len() as u32)];
    let (p, n) = (surface.position, surface.ns);
    for &Entry { group, samples, irradiance, .. } in plan.entries.iter().filter(|e| e.chance == 1.0) {
        let mut part = Part::default();
        let mut add = |part: &mut Part, samples: u32, sample: &dyn Fn([f32; 2]) -> Option<LightSample>| {
            for k in 0..samples {
                let drawn = sample(stratum(k, samples, spend.phase, rng));
                let follow = |s: LightSample| {
                    let from = place(k, samples);
                    (brought(world, surface, wo, &s, from, samples as f32, gloss), s.delta)
                };
                let (sample, delta) = drawn.map(follow).unwrap_or_default();
                part.add(sample, delta);
            }
        };
        match group {
            Group::Light(light) => {
                let kind = &world.emitters.lights()[light as usize];
                if let EmitterKind::Polygon(shape) = kind {
                    part.exact = Some(if shape.looks_small(p, n) {
                        shape.irradiance(p, n)
                    } else {
                        shape.radiance * (irradiance / shape.radiance.mean())
                    });
                }
                let punctual = matches!(kind, EmitterKind::Punctual(_));
                part.hard = punctual;
                let samples = if punctual { spend.places.len() as u32 } else { samples };
                if !punctual {
                    part.spread = Spread::over_grid(samples);
                }
                let sky = plan.sky_of(group).cloned();
                let Some(seen) = sky.or_else(|| world.emitters.seen_from(light, p, n)) else { continue };
                add(&mut part, samples, &|u| seen.sample(&world.scene, u));
            }
            Group::Branch(_) => {
                part.spread = Spread::over_grid(samples);
                add(&mut part, samples, &|u| world.emitters.sample_group(&world.scene, group, p, n, u));
            }
        }
        part.finish(&mut out);
    }
    pooled(world, surface, wo, plan, gloss, spend.phase, &place, rng, &mut out);
    out
}

/// What one sample of a light brings.
#[derive(Clone, Copy, Debug, Default)]
struct Brought {
    /// The irradiance it stands for without and with shadows, lx.
    open: Rgb,
    lit: Rgb,
    /// The radiance sent on by the diffuse lobe and by the glossy ones, cd/m².
    diffuse: Rgb,
    glossy: Rgb,
}

/// Follows sample `s`, one of `times`, from where it starts to the light.
fn brought(
    world: &World,
    surface: &Surface,
    wo: Vec3,
    s: &LightSample,
    from: Start,
    times: f32,
    gloss: Gloss,
) -> Brought {
    let mut out = Brought::default();
    let cos = s.wi.dot(surface.ns);
    let above = cos > 0.0 && s.wi.dot(surface.ng) > 0.0;
    let arriving = if above { s.radiance * (cos / s.pdf) } else { Rgb::BLACK };
    out.open = if cos > 0.0 { s.radiance * (cos / s.pdf) } else { Rgb::BLACK };
    let seen = s.seen_from(surface.position, from.position);
    let (shown, to_eye) = from.seen.unwrap_or((surface, wo));
    let f_glossy = if gloss == Gloss::None { Rgb::BLACK } else { shown.bsdf.eval_glossy(to_eye, seen.wi) };
    if arriving.is_black() && f_glossy.is_black() {
        return out;
    }
    let open = world.transmittance(&seen.shadow_ray(from.position, surface.ng));
    if open.is_black() {
        return out;
    }
    out.lit = arriving * open;
    if above && surface.bsdf.has_diffuse() {
        out.diffuse = surface.bsdf.eval_diffuse(wo, s.wi) * out.lit;
    }
    if !f_glossy.is_black() {
        let weight = match gloss {
            Gloss::Shared if !s.delta => {
                let light = times * s.pdf;
                light / (light + shown.bsdf.pdf_specular(to_eye, seen.wi))
            }
            _ => 1.0,
        };
        let cos = seen.wi.dot(shown.ns).abs();
        out.glossy = f_glossy * open * s.radiance * (cos / s.pdf * weight);
    }
    out
}

/// Samples of one light.
#[derive(Default)]
struct Part {
    sum: Brought,
    spread: Spread,
    /// The light's unshadowed irradiance where it has a closed form, lx.
    exact: Option<Rgb>,
    /// A lamp without extent was among them.
    delta: bool,
    /// All are of one lamp without extent: they differ by where they start.
    hard: bool,
}

impl Part {
    /// - `delta`: whether it is of a lamp without extent.
    fn add(&mut self, sample: Brought, delta: bool) {
        let Brought { open, lit, diffuse, glossy } = sample;
        self.delta |= delta;
        self.sum.open += open;
        self.sum.lit += lit;
        self.sum.diffuse += diffuse;
        self.sum.glossy += glossy;
        // How the diffuse light of these two varies is known better.
        let unknown = if self.exact.is_some() || self.hard { glossy } else { diffuse + glossy };
        self.spread.add(unknown.luminance());
    }

    /// Adds the light's part to `out`; with the `exact` unshadowed irradiance the samples only give ratios.
    fn finish(&self, out: &mut Direct) {
        let Part { sum, exact, .. } = self;
        if self.spread.count == 0 {
            return;
        }
        let n = self.spread.count as f32;
        let estimate = sum.open.luminance() / n;
        // How far the samples' own unshadowed light is off, corrected in the shadowed light too.
        let ratio = match exact {
            Some(e) if estimate > 0.0 => e.luminance() / estimate,
            _ => 1.0,
        };
        let lit = sum.lit * (ratio / n);
        let sent = sum.diffuse * (ratio / n);
        out.irradiance += lit;
        if self.hard {
            out.hard += lit;
        }
        out.diffuse += sent;
        out.glossy += sum.glossy / n;
        let variance = if self.hard { &mut out.hard_variance } else { &mut out.variance };
        if let Some(spread) = self.spread.variance() {
            *variance += spread / n;
        } else if !self.delta {
            // A single sample in a narrow lobe is mostly nothing, and seldom very much: taken for exact it left a lone
            // pixel on the gallery's lamp that alone made 60 % of the picture's squared error. Of the diffuse light it
            // says nothing, and that of a lamp without extent it gives exactly.
            *variance += sum.glossy.luminance().powi(2);
        }
        let known = self.hard && n > 1.0 || exact.is_some() && estimate > 0.0;
        if known {
            // Seen or not seen, as a coin with the visible share v. Where an edge crosses a grid of n strata only those
            // it cuts vary, about √(4 v (1 − v) n) of them by a sixth each: variance ∝ n^-1.5.
            let v = (lit.luminance() / (estimate * ratio).max(1e-30)).clamp(0.0, 1.0);
            let open = sent.luminance() / v.max(0.05);
            *variance += open * open * (v * (1.0 - v)).sqrt() / 3.0 / (n * n.sqrt());
        }
    }
}

/// How much numbers that are added in turn vary, as far as the strata that they are drawn from do not explain it.
#[derive(Debug, Default)]
struct Spread {
    /// Strata along each side of their grid, which the numbers follow row by row; less than two: in no order.
    side: usize,
    count: usize,
    sum: f32,
    /// Of their squares; in a grid of the squared differences in it.
    squares: f32,
    /// The last of each column, and what stood in the column before until this row.
    above: Vec<f32>,
    corner: f32,
}

impl Spread {
    /// Of `n` numbers, one from each stratum of a square grid.
    fn over_grid(n: u32) -> Spread {
        let side = n.isqrt() as usize;
        Spread { side, above: vec![0.0; side], ..Spread::default() }
    }

    fn add(&mut self, x: f32) {
        self.sum += x;
        if self.side < 2 {
            self.squares += x * x;
        } else {
            let (row, column) = (self.count / self.side, self.count % self.side);
            let over = std::mem::replace(&mut self.above[column], x);
            if row > 0 && column > 0 {
                let mixed = x - self.above[column - 1] - over + self.corner;
                self.squares += mixed * mixed;
            }
            self.corner = over;
        }
        self.count += 1;
    }

    /// Variance of one number, that of the mean times how many there are; `None` of a single one.
    ///
    /// In a grid, a quarter of the squared mixed difference of each 2 × 2 strata: of independent numbers it holds the
    /// variance of four, of a slope or an edge along the grid nothing, of an edge across it what the strata vary that it
    /// cuts (for one dimension von Neumann, 1941; Immerkær, CVIU 64(2), 1996, takes the same twice over).
    fn variance(&self) -> Option<f32> {
        let n = self.count as f32;
        if self.side >= 2 {
            let blocks = (self.side - 1) as f32;
            return Some(0.25 * self.squares / (blocks * blocks));
        }
        let mean = self.sum / n;
        (self.count > 1).then(|| (self.squares / n - mean * mean).max(0.0) * n / (n - 1.0))
    }
}

/// The small lights together.
fn pooled<'a>(
    world: &World,
    surface: &Surface,
    wo: Vec3,
    plan: &Plan,
    gloss: Gloss,
    phase: u32,
    place: &dyn Fn(u32, u32) -> Start<'a>,
    rng: &mut Rng,
    out: &mut Direct,
) {
    let small = || plan.entries.iter().filter(|e| e.chance < 1.0);
    let mut part = Part::default();
    for k in 0..plan.pool {
        // Neighbouring pixels choose in turn: the 4 × 4 of them take even shares of the groups.
        let strata = (16 * plan.pool) as f32;
        let mut u = ((16 * k + phase) as f32 + rng.f32()) / strata;
        let chosen = small().find(|e| {
            u -= e.chance;
            u < 0.0
        });
        let Some(&Entry { group, chance, .. }) = chosen.or_else(|| small().next_back()) else { return };
        let u = [rng.f32(), rng.f32()];
        let drawn = match plan.sky_of(group) {
            Some(sky) => sky.sample(&world.scene, u),
            None => world.emitters.sample_group(&world.scene, group, surface.position, surface.ns, u),
        };
        let follow = |s: LightSample| {
            let s = LightSample { pdf: s.pdf * chance, ..s };
            (brought(world, surface, wo, &s, place(k, plan.pool), plan.pool as f32, gloss), s.delta)
        };
        let (sample, delta) = drawn.map(follow).unwrap_or_default();
        part.add(sample, delta);
    }
    part.finish(out);
}

/// Sample `k` of `n` in [0, 1)², n a power of four: each in a stratum of its own. Of an 8 × 8 grid of strata a pixel of
/// 4 or 16 samples takes so many, spread evenly, and the 4 × 4 pixels around it take the others.
fn stratum(k: u32, n: u32, phase: u32, rng: &mut Rng) -> [f32; 2] {
    let (jx, jy) = (rng.f32(), rng.f32());
    if n < 4 {
        return [jx, jy];
    }
    let side = n.isqrt();
    let (block_x, block_y) = (k % side, k / side);
    // Four pixels complete the 16 samples of each, 16 pixels the 4: the high bits of the phase differ between the
    // neighbours in each 2 × 2 of them, all bits within 4 × 4.
    let (inside, px, py) = match side {
        2 => (4, phase % 4, phase / 4),
        4 => (2, phase / 4 % 2, phase / 8),
        _ => (1, 0, 0),
    };
    let strata = (side * inside) as f32;
    let x = ((block_x * inside + px) as f32 + jx) / strata;
    let y = ((block_y * inside + py) as f32 + jy) / strata;
    [x.min(1.0 - f32::EPSILON), y.min(1.0 - f32::EPSILON)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::{Scene, Sky};

    #[test]
    fn places_are_taken_in_turn_or_spread_over_the_pixel() {
        let taken = |times, turn, places| (0..times).map(move |k| place_of(k, times, turn, places));
        let mut all: Vec<usize> = taken(64, 5, 16).collect();
        all.sort_unstable();
        assert!((0..64).all(|k| all[k] == k / 4), "each of 16 by 4 of 64");
        for turn in [0, 1, 37, 4000] {
            // 64 of a grid of 64 × 64: one in each row, in all quarters of it.
            let mut rows = [0; 64];
            let mut quarters = [0; 4];
            for i in taken(64, turn, 4096) {
                rows[i / 64] += 1;
                quarters[i % 64 / 16] += 1;
            }
            assert_eq!(rows, [1; 64]);
            assert!(quarters.iter().all(|&n| (12..=20).contains(&n)), "{quarters:?}");
        }
    }

    /// Eight in a grid of two columns would stand in four rows, two of them beyond its edge.
    #[test]
    fn samples_fill_a_square() {
        let scene = Scene { sky: Some(Sky::Constant(Rgb::WHITE)), ..Scene::default() };
        let world = World::new(scene);
        for (asked, taken) in [(1, 1), (3, 1), (4, 4), (8, 4), (16, 16), (1000, 256)] {
            let plan = Plan::new(&world, None, Vec3::ZERO, Vec3::Y, asked);
            assert_eq!(plan.entries.iter().map(|e| e.samples).collect::<Vec<_>>(), [taken]);
        }
    }

    #[test]
    fn a_grid_tells_noise_from_what_its_strata_explain() {
        let of = |x: &dyn Fn(usize, usize) -> f32| {
            let mut spread = Spread::over_grid(64);
            (0..64).for_each(|k| spread.add(x(k / 8, k % 8)));
            spread.variance().expect("64 of them")
        };
        // Slopes and edges along the grid.
        let even = of(&|row, column| (row * row) as f32 + if column > 4 { 100.0 } else { 0.0 });
        assert!(even < 1e-6, "{even}");
        let noise: Vec<f32> = (0..2000 * 64)
            .map({
                let mut rng = Rng::new(1, 2);
                move |_| rng.f32()
            })
            .collect();
        let told: f32 = noise.chunks(64).map(|grid| of(&|row, column| grid[8 * row + column])).sum();
        // A uniform number has a variance of 1/12; the overlap of the blocks leaves of their 98 000 squares some 8000.
        assert!((told / 2000.0 * 12.0 - 1.0).abs() < 0.05, "{told}");
        assert!(Spread::default().variance().is_none());
    }

    /// A lamp behind a round hole: the variance that is told, beside that of the means.
    #[test]
    fn a_grid_of_shadow_rays_tells_how_far_its_mean_is_off() {
        let mut rng = Rng::new(5, 6);
        for (n, independent) in [(64, 1.0), (256, 3.0), (1024, 6.0)] {
            let (mut told, mut mean, mut square) = (0.0, 0.0, 0.0);
            let times = 4000;
            for _ in 0..times {
                let mut spread = Spread::over_grid(n);
                for k in 0..n {
                    let [x, y] = stratum(k, n, 0, &mut rng);
                    spread.add(if (x - 0.43).hypot(y - 0.55) < 0.3 { 1.0 } else { 0.0 });
                }
                let m = f64::from(spread.sum) / f64::from(n);
                told += f64::from(spread.variance().expect("many")) / f64::from(n * times);
                mean += m / f64::from(times);
                square += m * m / f64::from(times);
            }
            let true_variance = square - mean * mean;
            let v = mean * (1.0 - mean) / f64::from(n);
            // An edge across the grid is told as up to twice what it is; see [`Spread::variance`].
            assert!((0.8..2.0).contains(&(told / true_variance)), "{n}: {told} {true_variance}");
            assert!(v > independent * told, "{n}: independent rays would leave {v}, not {told}");
        }
    }

    #[test]
    fn sixteen_pixels_of_four_samples_cover_all_strata() {
        let mut seen = [false; 64];
        let mut rng = Rng::new(1, 1);
        for phase in 0..16 {
            for k in 0..4 {
                let [x, y] = stratum(k, 4, phase, &mut rng);
                seen[(x * 8.0) as usize + 8 * (y * 8.0) as usize] = true;
            }
        }
        assert!(seen.iter().all(|&s| s));
    }
}
