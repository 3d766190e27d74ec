//! A photometric file such as makers of lamps publish: a downlight that lights one way more than the other.

/// The file's name in `assets/`.
pub const NAME: &str = "downlight.ies";

/// Candela on the axis.
const PEAK: f64 = 900.0;

/// The text of an LM-63-2002 file: 19 vertical by 7 horizontal angles, the quarter that symmetry leaves.
pub fn downlight() -> String {
    let vertical: Vec<f64> = (0..19).map(|i| 5.0 * f64::from(i)).collect();
    let horizontal: Vec<f64> = (0..7).map(|i| 15.0 * f64::from(i)).collect();
    let list = |all: Vec<f64>| all.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let mut text = String::from(
        "IESNA:LM-63-2002\n[TEST] made by a formula\n[ISSUEDATE] none\n[MANUFAC] twolight\n[LUMCAT] downlight\nTILT=NONE\n",
    );
    text += &format!("1 -1 1 {} {} 1 2 0.1 0.1 0\n1 1 12\n", vertical.len(), horizontal.len());
    text += &format!("{}\n{}\n", list(vertical.clone()), list(horizontal.clone()));
    for h in horizontal {
        // Half width at 1/e: 38° along the lamp, 22° across.
        let width = 30.0 + 8.0 * (2.0 * h.to_radians()).cos();
        text += &list(vertical.iter().map(|v| (PEAK * (-(v / width).powi(2)).exp()).round()).collect());
        text += "\n";
    }
    text
}
