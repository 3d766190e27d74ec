//! The torture cases: what has to pass passes, and what has to fail, as theory says, fails.

use geometry::World;
use radiosity::classical::Room;
use radiosity::element::Side;
use support::files::asset;
use support::stability::{ELSEWHERE, Section, Solver, form_factors, hemicube_errors, solvers};

fn comes_out(section: &Section) {
    println!("{}", section.markdown());
    let surprises = section.surprises();
    assert!(surprises.is_empty(), "{}", surprises.join("\n"));
}

#[test]
fn form_factors_come_out_as_they_must() {
    comes_out(&form_factors());
}

#[test]
fn solvers_come_out_as_they_must() {
    comes_out(&solvers());
}

/// A lamp of a tenth of its distance covers n/20 pixels: in one dimension the hemicube counts a pixel too many or too few,
/// so that its error falls as one over the resolution.
#[test]
fn a_hemicube_is_as_wrong_as_its_pixels_are_large() {
    let errors = hemicube_errors();
    println!("{errors:?}");
    let slope = |a: (u32, f64), b: (u32, f64)| (a.1 / b.1).ln() / f64::from(b.0 / a.0).ln();
    let whole = slope(errors[0], errors[errors.len() - 1]);
    assert!((0.7..2.0).contains(&whole), "falls with the power {whole}: {errors:?}");
}

/// What light cannot reach (the outside of a room, the inside of a block) is no patch, or memory would go to the dark.
#[test]
fn patches_are_where_light_comes() {
    let (scene, _) = asset("cornell-box.gltf");
    let world = World::new(scene);
    let settings = Solver::Progressive.settings(1, 1000);
    let config = settings.classical.expect("it is a classical one");
    let room = Room::new(&world, &config, &());
    let mut shooting = room.shooting(&config);
    shooting.shoot_until(u64::MAX, |s| s.finished(0.01));
    let dark =
        (0..room.patches.len()).filter(|&i| (shooting.direct[i] + shooting.indirect[i]).is_black()).count();
    let backs = room.patches.all.iter().filter(|p| p.side == Side::Back).count();
    println!("{} patches, {backs} of them backs, {dark} dark", room.patches.len());
    assert!(dark * 20 < room.patches.len(), "{dark} of {}", room.patches.len());
}

#[test]
fn every_case_is_somewhere() {
    let named = |id: &str| ELSEWHERE.iter().any(|(e, ..)| *e == id);
    let measured = [
        "C1", "C2", "C4", "C5", "C6", "C7", "C8", "C9", "C10", "C11", "C12", "C13", "C14", "C15", "C17",
        "C18", "C21", "C22", "C23", "C24", "C26",
    ];
    for n in 1..=42 {
        let id = format!("C{n}");
        assert!(named(&id) || measured.contains(&id.as_str()), "{id}");
    }
}
