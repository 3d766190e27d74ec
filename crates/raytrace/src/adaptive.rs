//! The picture of the two-pass method: one ray through every pixel, then more where they bring most.

use crate::effort::{self, Budget, Noise};
use crate::film::Film;
use crate::integrator::hybrid::Hybrid;
use crate::pixel::{Effort, Shot, View, meets_another, over_pixels, shade};
use radiosity::Progress;

/// Every pixel's first effort.
const FIRST: Effort = Effort { camera: 1, shadow: 4 };
/// The next effort of a pixel in which another ray meets another surface.
const EDGE: Effort = Effort { camera: 4, shadow: 4 };
/// Rounds of refinement at most.
const MOST_ROUNDS: u32 = 6;

/// The picture, as far as it is done.
pub(crate) struct Adaptive<'a> {
    hybrid: &'a Hybrid<'a>,
    view: &'a View<'a>,
    seed: u64,
    shots: Vec<Option<Shot>>,
    /// Whether slivers were looked for.
    searched: bool,
}

impl<'a> Adaptive<'a> {
    /// A picture of which nothing is done yet.
    pub fn new(hybrid: &'a Hybrid<'a>, view: &'a View<'a>, seed: u64) -> Adaptive<'a> {
        Adaptive { hybrid, view, seed, shots: Vec::new(), searched: false }
    }

    /// One ray through every pixel; whether all were reached.
    pub fn start(&mut self, progress: &dyn Progress) -> bool {
        let pixels = self.view.width * self.view.height;
        progress.stage("image", u64::from(pixels));
        let everywhere: Vec<u32> = (0..pixels).collect();
        self.shots = over_pixels(&everywhere, progress, |i| self.shade(i, FIRST));
        self.show(progress);
        self.shots.iter().all(Option::is_some)
    }

    /// Does those pixels again that need it, until the noise is within `budget`; whether it came to that.
    pub fn refine(&mut self, budget: &Budget, progress: &dyn Progress) -> bool {
        if !self.searched && budget.most_camera >= EDGE.camera && !self.find_slivers(progress) {
            return false;
        }
        for _ in 0..MOST_ROUNDS {
            let noise = effort::noise(&self.shots, self.view);
            let wanted = effort::next(&self.shots, &noise, budget);
            if wanted.is_empty() {
                return true;
            }
            if !self.redo(&wanted, progress) {
                return false;
            }
        }
        true
    }

    /// Sends one more ray through every pixel, and does those again where it meets another surface than the first: a rod
    /// thinner than a pixel may pass between the middles of a whole row of them. Whether all were reached.
    fn find_slivers(&mut self, progress: &dyn Progress) -> bool {
        let pixels: Vec<u32> = (0..self.shots.len() as u32).collect();
        let parted = over_pixels(&pixels, progress, |i| {
            let shot = self.shots[i as usize].as_ref()?;
            let (x, y) = (i % self.view.width, i / self.view.width);
            meets_another(self.hybrid.world, self.view, x, y, shot).then_some((i, EDGE))
        });
        self.searched = parted.iter().all(Option::is_some);
        let wanted: Vec<(u32, Effort)> = parted.into_iter().flatten().flatten().collect();
        self.redo(&wanted, progress) && self.searched
    }

    /// Does the pixels `wanted` again; whether all were reached.
    fn redo(&mut self, wanted: &[(u32, Effort)], progress: &dyn Progress) -> bool {
        progress.stage("refining", wanted.len() as u64);
        let which: Vec<u32> = (0..wanted.len() as u32).collect();
        let again = over_pixels(&which, progress, |k| {
            let (i, effort) = wanted[k as usize];
            self.shade(i, effort)
        });
        let finished = again.iter().all(Option::is_some);
        for (&(i, _), shot) in wanted.iter().zip(again) {
            if shot.is_some() {
                self.shots[i as usize] = shot;
            }
        }
        self.show(progress);
        finished
    }

    fn show(&self, progress: &dyn Progress) {
        progress.picture(self.view.width, self.view.height, &|| self.film().0.beauty());
    }

    fn shade(&self, i: u32, effort: Effort) -> Shot {
        let before = self.shots.get(i as usize).and_then(Option::as_ref);
        let (x, y) = (i % self.view.width, i / self.view.width);
        let mut shot = shade(self.hybrid, self.view, x, y, effort, before, self.seed);
        // Edges are better off with one grid; what chance finds in a gloss is not thrown away.
        if let Some(before) = before.filter(|b| b.specular && shot.specular && b.effort.camera > 1) {
            shot.join(before);
        }
        shot
    }

    /// The picture, with the noise that is estimated for each pixel, and the error that this amounts to.
    pub fn film(&self) -> (Film, f32) {
        let noise = effort::noise(&self.shots, self.view);
        let (error, _) = effort::relative(&self.shots, &noise);
        let pixel = |(shot, noise): (&Option<Shot>, &Noise)| {
            let mut pixel = shot.as_ref().map(|s| s.pixel).unwrap_or_default();
            pixel.variance += noise.camera + noise.light;
            pixel
        };
        let pixels = self.shots.iter().zip(&noise).map(pixel).collect();
        (Film::from_pixels(self.view.width, self.view.height, pixels), error)
    }
}
