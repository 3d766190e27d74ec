//! The pictures that are asked for: cameras of the file, frames of its animation, a circle, a walk.

use crate::args::ViewArgs;
use crate::job::AskedWrongly;
use crate::values::Places;
use anyhow::Result;
use geometry::math::Mat4;
use geometry::{Camera, Vec3, World};
use std::ops::Range;

/// Frames of a second where none are asked for, as in film.
const USUAL_FPS: f32 = 24.0;
/// Pictures on a walk between two of its points, where no number is asked for.
const USUAL_STEPS: u32 = 24;

/// Frames of one command at most: half a day of film.
const MOST_FRAMES: usize = 1_000_000;

/// How the views follow from one another.
#[derive(Clone, Debug, PartialEq)]
pub enum Views {
    /// Each camera that was asked for, once.
    Cameras,
    /// The file's animation.
    Animation {
        /// Which frames.
        frames: Range<u32>,
        /// Frames in a second.
        fps: f32,
    },
    /// Around what the camera looks at.
    Orbit {
        /// Which of the views.
        frames: Range<u32>,
        /// Views of the whole circle.
        of: u32,
    },
    /// Along a line.
    Walk {
        /// Which of the views.
        frames: Range<u32>,
        /// Views of the whole way.
        of: u32,
        /// Places that it passes, m.
        points: Vec<Vec3>,
    },
}

impl Views {
    /// What `args` ask for.
    pub fn new(args: &ViewArgs) -> Result<Views> {
        let some_of = |of: u32| -> Result<Range<u32>> {
            let frames = args.frames.clone().unwrap_or(0..of);
            match frames.end <= of {
                true => few(frames),
                false => {
                    let message = format!("--frames {}..{}: there are {of}", frames.start, frames.end);
                    Err(AskedWrongly(message).into())
                }
            }
        };
        Ok(match (&args.orbit, &args.walk, &args.frames) {
            (Some(of), ..) => Views::Orbit { frames: some_of(*of)?, of: *of },
            (_, Some(Places(points)), _) => {
                let of = args.steps.unwrap_or(USUAL_STEPS * (points.len() as u32 - 1));
                Views::Walk { frames: some_of(of)?, of, points: points.clone() }
            }
            (.., Some(frames)) => {
                Views::Animation { frames: few(frames.clone())?, fps: args.fps.unwrap_or(USUAL_FPS) }
            }
            _ => Views::Cameras,
        })
    }

    /// Their numbers; `None` where each camera has one view.
    pub fn frames(&self) -> Option<Range<u32>> {
        match self {
            Views::Cameras => None,
            Views::Animation { frames, .. } | Views::Orbit { frames, .. } | Views::Walk { frames, .. } => {
                Some(frames.clone())
            }
        }
    }

    /// Time of a frame in the file's animation, s; `None` where nothing but the camera moves.
    pub fn time(&self, frame: u32) -> Option<f32> {
        match self {
            Views::Animation { fps, .. } => Some(frame as f32 / fps),
            _ => None,
        }
    }

    /// The camera for a frame, from the one that was chosen.
    pub fn camera(&self, frame: u32, chosen: &Camera, world: &World) -> Camera {
        match self {
            Views::Cameras | Views::Animation { .. } => chosen.clone(),
            Views::Orbit { of, .. } => orbit(chosen, world, frame as f32 / *of as f32),
            Views::Walk { of, points, .. } => {
                walk(chosen, points, frame as f32 / (*of as f32 - 1.0).max(1.0))
            }
        }
    }
}

/// The frames, unless they are more than anyone renders.
fn few(frames: Range<u32>) -> Result<Range<u32>> {
    match frames.len() <= MOST_FRAMES {
        true => Ok(frames),
        false => Err(AskedWrongly(format!("{} frames are more than {MOST_FRAMES}", frames.len())).into()),
    }
}

/// `camera` turned by the share `turn` of a circle about the upright line through what its middle ray meets, counter-clockwise
/// as seen from above.
fn orbit(camera: &Camera, world: &World, turn: f32) -> Camera {
    let ray = camera.ray(0.5, 0.5, 1.0);
    let middle = 0.5 * (world.bounds.0 + world.bounds.1);
    let centre = world.closest(&ray).map_or(middle, |hit| ray.origin + ray.direction * hit.t);
    let about = Mat4::from_translation(centre)
        * Mat4::from_rotation_y(turn * std::f32::consts::TAU)
        * Mat4::from_translation(-centre);
    Camera { to_world: about * camera.to_world, ..camera.clone() }
}

/// `camera` at the share `along` of the curve through `points`, looking ahead; level, as one walks.
fn walk(camera: &Camera, points: &[Vec3], along: f32) -> Camera {
    let at = along.clamp(0.0, 1.0) * (points.len() - 1) as f32;
    let k = (at as usize).min(points.len() - 2);
    let place = curve(points, k, at - k as f32);
    // What lies a little ahead; at the very end a little behind.
    let step = 1e-2;
    let (t0, t1) = ((at - k as f32 - step).max(0.0), (at - k as f32 + step).min(1.0));
    let ahead = curve(points, k, t1) - curve(points, k, t0);
    let level = Vec3::new(ahead.x, 0.0, ahead.z);
    // Straight up or down there is no ahead: the camera keeps its own.
    let Some(back) = (-level).try_normalize() else {
        let mut to_world = camera.to_world;
        to_world.w_axis = place.extend(1.0);
        return Camera { to_world, ..camera.clone() };
    };
    let right = Vec3::Y.cross(back);
    let columns = (right.extend(0.0), Vec3::Y.extend(0.0), back.extend(0.0), place.extend(1.0));
    Camera { to_world: Mat4::from_cols(columns.0, columns.1, columns.2, columns.3), ..camera.clone() }
}

/// The point at `t` in [0, 1] between the points `k` and `k + 1`: Catmull and Rom's cubic ("A class of local interpolating
/// splines", 1974), which passes all points without a corner.
fn curve(points: &[Vec3], k: usize, t: f32) -> Vec3 {
    let (b, c) = (points[k], points[k + 1]);
    // Beyond the ends the way goes straight on.
    let a = if k > 0 { points[k - 1] } else { b + b - c };
    let d = points.get(k + 2).copied().unwrap_or(c + c - b);
    0.5 * (2.0 * b
        + (c - a) * t
        + (2.0 * a - 5.0 * b + 4.0 * c - d) * (t * t)
        + (3.0 * b - a - 3.0 * c + d) * (t * t * t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Scene;

    fn empty() -> World {
        World::new(Scene::default())
    }

    fn camera() -> Camera {
        Camera::framing(Vec3::NEG_ONE, Vec3::ONE)
    }

    #[test]
    fn an_orbit_keeps_its_distance_and_its_eye_on_the_middle() {
        let world = empty();
        let eye = |c: &Camera| c.to_world.transform_point3(Vec3::ZERO);
        let start = eye(&camera());
        for k in 0..8 {
            let turned = orbit(&camera(), &world, k as f32 / 8.0);
            let ray = turned.ray(0.5, 0.5, 1.0);
            assert!((eye(&turned).length() - start.length()).abs() < 1e-4);
            assert!((eye(&turned).y - start.y).abs() < 1e-5);
            assert!(ray.direction.dot(-eye(&turned).normalize()) > 1.0 - 1e-5, "{k}");
        }
        assert!(eye(&orbit(&camera(), &world, 1.0)).distance(start) < 1e-4);
    }

    #[test]
    fn a_walk_passes_its_points_and_looks_ahead() {
        let points = [Vec3::new(0.0, 1.6, 0.0), Vec3::new(2.0, 1.6, 0.0), Vec3::new(2.0, 1.6, 3.0)];
        for (k, &p) in points.iter().enumerate() {
            let there = walk(&camera(), &points, k as f32 / 2.0);
            assert!(there.to_world.transform_point3(Vec3::ZERO).distance(p) < 1e-5);
            assert!(there.ray(0.5, 0.5, 1.0).direction.y.abs() < 1e-6, "level");
        }
        let first = walk(&camera(), &points, 0.0).ray(0.5, 0.5, 1.0).direction;
        assert!(first.x > 0.9, "{first}");
        assert!(walk(&camera(), &points, 0.3).to_world.is_finite());
        // Straight up: nothing lies ahead.
        assert!(walk(&camera(), &[Vec3::ZERO, Vec3::Y], 0.5).to_world.is_finite());
    }
}
