//! Which points no other beats, and how many seconds each method needs for a given error.

use crate::comparison::results::{Curve, Scene};

/// Errors that tables ask for, as fractions.
pub const LEVELS: [f64; 4] = [0.05, 0.02, 0.01, 0.005];

/// The Pareto front of a scene: (seconds, error) of every comparable point that is the most exact for its time,
/// fastest first.
pub fn pareto(scene: &Scene) -> Vec<(f64, f64)> {
    let comparable = scene.curves.iter().filter(|c| c.comparable);
    let points = comparable.flat_map(|c| &c.points).map(|p| (p.seconds, p.error));
    let usable = |v: f64| v.is_finite() && v > 0.0;
    let mut points: Vec<(f64, f64)> = points.filter(|&(s, e)| usable(s) && usable(e)).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut best = f64::INFINITY;
    points.retain(|&(_, error)| {
        let better = error < best;
        best = best.min(error);
        better
    });
    points
}

/// Seconds to `error`, where that is a number one can divide by.
pub fn seconds_to(curve: &Curve, error: f64) -> Option<f64> {
    curve.seconds_to(error).filter(|s| s.is_finite() && *s > 0.0)
}

/// The curve that is first at `error` among those that `which` admits, and its seconds. Methods whose error is no
/// measure of them are left out.
pub fn fastest(scene: &Scene, error: f64, which: impl Fn(&Curve) -> bool) -> Option<(&Curve, f64)> {
    let curves = scene.curves.iter().filter(|c| c.comparable && which(c));
    curves.filter_map(|c| Some((c, seconds_to(c, error)?))).min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Seconds at which pictures are compared, and whose they are: what our fastest method takes to 2 %, else to the best
/// that we reach; `None` for a scene without pictures of ours.
pub fn moment(scene: &Scene) -> Option<(&Curve, f64)> {
    fastest(scene, 0.02, |c| c.ours).or_else(|| {
        let ours = scene.curves.iter().filter(|c| c.ours);
        let bests = ours.filter_map(|c| Some((c, c.best()?)));
        let (curve, best) = bests.min_by(|a, b| a.1.error.total_cmp(&b.1.error))?;
        (best.seconds.is_finite() && best.seconds > 0.0).then_some((curve, best.seconds))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comparison::report::tests::{curve, scene};

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let a = curve("split", true, &[(1.0, 0.04), (2.0, 0.05), (4.0, 0.01)]);
        let b = curve("mitsuba", false, &[(0.5, 0.2), (3.0, 0.02), (9.0, 0.01), (f64::NAN, 0.0)]);
        let mut cheat = curve("other", false, &[(0.1, 0.001)]);
        cheat.comparable = false;
        let scene = scene(vec![a, b, cheat]);
        assert_eq!(pareto(&scene), [(0.5, 0.2), (1.0, 0.04), (3.0, 0.02), (4.0, 0.01)]);
        let (curve, seconds) = fastest(&scene, 0.02, |_| true).unwrap();
        assert_eq!(curve.method, "split");
        assert!((2.0..3.0).contains(&seconds), "{seconds}");
        assert_eq!(moment(&scene).map(|(c, s)| (c.method.as_str(), s)), Some(("split", seconds)));
    }

    #[test]
    fn nothing_has_no_front() {
        let empty = scene(vec![]);
        assert!(pareto(&empty).is_empty() && moment(&empty).is_none());
        let zero = scene(vec![curve("split", true, &[(0.0, 0.0)])]);
        assert!(pareto(&zero).is_empty() && moment(&zero).is_none());
    }
}
