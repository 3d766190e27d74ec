//! A rectangle of points in the air, and which of them are in the room.

use super::Sensor;
use geometry::math::to_world;
use geometry::sampling::Lattice2;
use geometry::{Ray, Vec2, Vec3, World};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Rays that look around a point.
const LOOKS: u32 = 64;

/// Sensors of one set at most: a million take hours, and more would have been typed by mistake.
pub const MOST: usize = 1_000_000;

/// Why there is no such grid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// Its edges span no area.
    #[error("the rectangle has no area: name a corner and two edges at right angles, in metres")]
    Empty,
    /// It has too many cells.
    #[error("{0:.0} points are more than {MOST}: take a larger spacing")]
    TooFine(f64),
}

/// Points at the middles of the equal cells of a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Lower left corner of the rectangle, m.
    pub corner: Vec3,
    /// Its lower edge, m.
    pub across: Vec3,
    /// Its left edge, m; at right angles to `across`.
    pub up: Vec3,
    /// Cells along `across`, ≥ 1.
    pub columns: usize,
    /// Cells along `up`, ≥ 1.
    pub rows: usize,
}

impl Grid {
    /// Cells of about `spacing` m on the rectangle at `corner` with the edges `across` and `up`, which it makes
    /// perpendicular.
    pub fn new(corner: Vec3, across: Vec3, up: Vec3, spacing: f32) -> Result<Grid, GridError> {
        let up = up - across * (up.dot(across) / across.length_squared());
        let area = across.cross(up).length();
        if !(area > 0.0 && area.is_finite() && corner.is_finite() && spacing > 0.0) {
            return Err(GridError::Empty);
        }
        let cells = |edge: Vec3| (f64::from(edge.length()) / f64::from(spacing)).round().max(1.0);
        let (columns, rows) = (cells(across), cells(up));
        if columns * rows > MOST as f64 {
            return Err(GridError::TooFine(columns * rows));
        }
        Ok(Grid { corner, across, up, columns: columns as usize, rows: rows as usize })
    }

    /// The level plane at height `y` over all of the scene, seen from above with x to the right and z down.
    pub fn level(world: &World, y: f32, spacing: f32) -> Result<Grid, GridError> {
        let (lo, hi) = world.bounds;
        Grid::new(Vec3::new(lo.x, y, hi.z), Vec3::X * (hi.x - lo.x), Vec3::NEG_Z * (hi.z - lo.z), spacing)
    }

    /// The part of the grid around the cells that hold something, and what these hold.
    pub fn cropped<T: Copy>(&self, held: &[Option<T>]) -> (Grid, Vec<Option<T>>) {
        let cells = || (0..self.len()).filter(|&i| held[i].is_some());
        let ends = |of: &dyn Fn(usize) -> usize| Some((cells().map(of).min()?, cells().map(of).max()? + 1));
        let (Some((left, right)), Some((low, high))) =
            (ends(&|i| i % self.columns), ends(&|i| i / self.columns))
        else {
            return (*self, held.to_vec());
        };
        let (columns, rows) = (right - left, high - low);
        let (u, v) = (self.across / self.columns as f32, self.up / self.rows as f32);
        let grid = Grid {
            corner: self.corner + u * left as f32 + v * low as f32,
            across: u * columns as f32,
            up: v * rows as f32,
            columns,
            rows,
        };
        let of = |i: usize| held[(low + i / columns) * self.columns + left + i % columns];
        (grid, (0..grid.len()).map(of).collect())
    }

    /// Unit; the rectangle is seen from where it points to.
    pub fn normal(&self) -> Vec3 {
        // In f64, or a level plane's normal is 0.999_999_94 long.
        self.across.as_dvec3().cross(self.up.as_dvec3()).normalize_or_zero().as_vec3() + Vec3::ZERO
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// Never: there is at least one cell.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Middle of cell `i`: row by row from the lower left.
    pub fn point(&self, i: usize) -> Vec3 {
        let s = ((i % self.columns) as f32 + 0.5) / self.columns as f32;
        let t = ((i / self.columns) as f32 + 0.5) / self.rows as f32;
        self.corner + self.across * s + self.up * t
    }

    /// A sensor in each cell that `keep` lets stay.
    pub fn sensors(&self, world: &World, keep: impl Fn(&Sensor) -> bool + Sync) -> Vec<Option<Sensor>> {
        let sensor = |i| Some(Sensor::at(world, self.point(i), self.normal())).filter(&keep);
        (0..self.len()).into_par_iter().map(sensor).collect()
    }
}

/// Whether a sensor is in the open, and not in the inside of something (or behind the walls of a room without
/// thickness): what is straight above shows its front, and so do at least half of the surfaces that rays in all
/// directions meet. Materials that are double-sided have no back.
///
/// The ray upward is for furniture that stands flush to a wall: of two faces in one place it is chance which one a ray meets.
pub fn is_free(world: &World, sensor: &Sensor) -> bool {
    let from = lifted(world, sensor);
    if shows_front(world, Ray::new(from, Vec3::Y)) == Some(false) {
        return false;
    }
    let pattern = Lattice2::new(LOOKS);
    let (mut met, mut backs) = (0, 0);
    for i in 0..LOOKS {
        let u = pattern.point(i, Vec2::splat(0.5 / LOOKS as f32));
        let z = 1.0 - 2.0 * u.x;
        let (r, phi) = ((1.0 - z * z).max(0.0).sqrt(), std::f32::consts::TAU * u.y);
        let ray = Ray::new(from, to_world(Vec3::new(r * phi.cos(), r * phi.sin(), z), sensor.normal));
        if let Some(front) = shows_front(world, ray) {
            met += 1;
            backs += u32::from(!front);
        }
    }
    2 * backs <= met
}

/// Whether straight below lies something, front up.
pub fn has_floor(world: &World, sensor: &Sensor) -> bool {
    shows_front(world, Ray::new(lifted(world, sensor), Vec3::NEG_Y)) == Some(true)
}

/// Whether nothing stands within `distance` m of a sensor in the level plane through it: walls, cupboards.
pub fn has_room(world: &World, sensor: &Sensor, distance: f32) -> bool {
    const AROUND: u32 = 32;
    (0..AROUND).all(|k| {
        let (sin, cos) = (std::f32::consts::TAU * k as f32 / AROUND as f32).sin_cos();
        let ray = Ray::new(lifted(world, sensor), Vec3::new(cos, 0.0, sin));
        !world.bvh.occluded(&Ray { t_max: distance, ..ray })
    })
}

/// Height (m) of the floor: the level at which surfaces that face up, and have a room's height above them, have the
/// largest area; where nothing is above anything, the lowest point of the scene.
///
/// Sampled by 16 384 points, levels a hundredth of the headroom apart. The ground below a house is too near to it to
/// count, and the ground around it has nothing above.
pub fn floor_level(world: &World) -> f32 {
    const POINTS: u32 = 16_384;
    /// Under a table there is less.
    const HEADROOM: f32 = 1.5;
    const STEP: f32 = 0.01 * HEADROOM;
    let mesh = &world.scene.mesh;
    let up: Vec<u32> =
        (0..mesh.triangles.len() as u32).filter(|&t| mesh.geometric_normal(t).y.abs() > 0.999).collect();
    let places = super::surface::even(mesh, &up, POINTS);
    let height = |(t, [u, v]): (u32, [f32; 2])| {
        let p = mesh.interpolate(t, u, v, &mesh.positions);
        let sensor = Sensor { position: p, normal: Vec3::Y, on_surface: false };
        let ray = Ray::new(lifted(world, &sensor), Vec3::Y);
        let hit = world.closest(&ray)?;
        (hit.t > HEADROOM && shows_front(world, ray) == Some(true)).then_some(p.y)
    };
    let mut levels: BTreeMap<i64, (u32, f32)> = BTreeMap::new();
    for y in places.into_iter().filter_map(height) {
        let (count, mean) = levels.entry((y / STEP).round() as i64).or_default();
        *count += 1;
        *mean += (y - *mean) / *count as f32;
    }
    // Of two storeys of one size the lower.
    let most = levels.iter().max_by_key(|(level, (count, _))| (*count, std::cmp::Reverse(**level)));
    most.map_or(world.bounds.0.y, |(_, (_, mean))| *mean)
}

fn lifted(world: &World, sensor: &Sensor) -> Vec3 {
    sensor.position + sensor.normal * (1e-4 * world.scale)
}

/// Whether the ray meets a front; `None` where it meets nothing.
fn shows_front(world: &World, ray: Ray) -> Option<bool> {
    let hit = world.closest(&ray)?;
    let mesh = &world.scene.mesh;
    let material = &world.scene.materials[mesh.materials[hit.triangle as usize].0 as usize];
    Some(material.double_sided || mesh.geometric_normal(hit.triangle).dot(ray.direction) <= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_the_middles_of_cells() {
        let grid = Grid::new(Vec3::ZERO, Vec3::X * 2.0, Vec3::NEG_Z, 0.5).unwrap();
        assert_eq!((grid.columns, grid.rows, grid.normal()), (4, 2, Vec3::Y));
        assert_eq!(
            (grid.point(0), grid.point(7)),
            (Vec3::new(0.25, 0.0, -0.25), Vec3::new(1.75, 0.0, -0.75))
        );
        assert_eq!(Grid::new(Vec3::ZERO, Vec3::X, Vec3::X, 0.5), Err(GridError::Empty));
        assert_eq!(Grid::new(Vec3::ZERO, Vec3::ZERO, Vec3::X, 0.5), Err(GridError::Empty));
        assert_eq!(Grid::new(Vec3::ZERO, Vec3::X, Vec3::Y, 9.0).map(|g| g.len()), Ok(1));
        let held: Vec<Option<usize>> = (0..8).map(|i| (i == 5 || i == 6).then_some(i)).collect();
        let (part, held) = grid.cropped(&held);
        assert_eq!((part.columns, part.rows, held), (2, 1, vec![Some(5), Some(6)]));
        assert_eq!((part.point(0), part.point(1)), (grid.point(5), grid.point(6)));
        assert!(matches!(Grid::new(Vec3::ZERO, Vec3::X, Vec3::Y, 1e-6), Err(GridError::TooFine(_))));
    }
}
