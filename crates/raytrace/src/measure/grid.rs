//! A rectangle of points in the air, and which of them are in the room.

use super::Sensor;
use geometry::math::to_world;
use geometry::sampling::Lattice2;
use geometry::{Ray, Vec2, Vec3, World};
use rayon::prelude::*;

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

    /// The work plane `height` m over the lowest point of the scene, over all its width but for a `margin` in m; seen
    /// from above with x to the right and z down.
    pub fn work_plane(world: &World, height: f32, spacing: f32, margin: f32) -> Result<Grid, GridError> {
        let (lo, hi) = world.bounds;
        let size = hi - lo - Vec3::splat(2.0 * margin);
        if size.x <= 0.0 || size.z <= 0.0 {
            return Err(GridError::Empty);
        }
        let corner = Vec3::new(lo.x + margin, lo.y + height, hi.z - margin);
        Grid::new(corner, Vec3::X * size.x, Vec3::NEG_Z * size.z, spacing)
    }

    /// Unit; the rectangle is seen from where it points to.
    pub fn normal(&self) -> Vec3 {
        self.across.cross(self.up).normalize_or_zero()
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
        assert!(matches!(Grid::new(Vec3::ZERO, Vec3::X, Vec3::Y, 1e-6), Err(GridError::TooFine(_))));
    }
}
