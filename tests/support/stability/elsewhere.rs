//! Cases that need no row of numbers here, for a test of their own holds them; and those that nothing holds yet.

/// Case, what it is, and the test that holds it; no test where the feature does not exist yet.
pub const ELSEWHERE: &[(&str, &str, Option<&str>)] = &[
    (
        "C3",
        "the solution is within the stated bound",
        Some(
            "tests: analytic::enclosures::the_solver_stops_at_its_bound; radiosity: gauss_seidel::a_furnace_has_its_closed_form_and_the_bound_holds",
        ),
    ),
    (
        "C9",
        "Jacobi's iteration at reflectance 0.99 needs 687 steps for 0.1 %",
        Some("radiosity: gauss_seidel::jacobi_crawls_where_it_walks"),
    ),
    (
        "C16",
        "a panel touching a wall, a leg smaller than a patch",
        Some("tests: agreement::the_gallery (against paths)"),
    ),
    (
        "C19",
        "light bleeds over no edge of a box",
        Some("tests: analytic::shadows::a_side_that_faces_away_gets_no_direct_light"),
    ),
    (
        "C20",
        "a penumbra is s · d2 / d1 wide on a coarse mesh",
        Some("tests: analytic::shadows::a_penumbra_is_as_wide_as_geometry_says"),
    ),
    (
        "C22",
        "direct light once, layers sum to beauty",
        Some(
            "tests: analytic::shadows::one_lamp_over_a_floor_is_counted_once; raytrace: film::beauty_is_the_sum_of_the_layers",
        ),
    ),
    ("C23", "threads", Some("tests: property::threads_do_not_matter, random_rooms")),
    ("C25", "killed in mid-solve and resumed", None),
    (
        "C27",
        "self-hits at grazing angles, far from the origin",
        Some(
            "geometry: bvh::tests::origins; tests: analytic::shadows::far_from_the_origin_nothing_breaks_out",
        ),
    ),
    ("C28", "rays along edges and through vertices", Some("geometry: bvh::tests::watertight")),
    ("C29", "flat, empty, coincident input to the ray tree", Some("geometry: bvh::tests::degenerate")),
    ("C30", "shadow terminator on few facets", None),
    (
        "C31",
        "a slab of glass, all orders",
        Some("tests: analytic::optics::a_slab_of_glass_reflects_and_passes_its_share"),
    ),
    (
        "C32",
        "a slab at an angle; inner reflection",
        Some(
            "geometry: optics::total_internal_reflection_begins_at_the_critical_angle (the shift of the exit ray has no test)",
        ),
    ),
    ("C33", "glass of index 1", Some("tests: analytic::optics::glass_of_index_one_is_invisible")),
    (
        "C34",
        "a white furnace around every material",
        Some("tests: analytic::optics::under_an_even_sky_a_ball_vanishes; geometry: bsdf::tests"),
    ),
    ("C35", "water in a glass: volumes that overlap", None),
    (
        "C36",
        "open and inside-out glass, camera in glass",
        Some("tests: property::odd_scenes_give_finite_pictures"),
    ),
    (
        "C37",
        "facing mirrors, a box of mirrors",
        Some(
            "tests: analytic::optics::facing_mirrors_make_a_geometric_series, a_box_of_perfect_mirrors_ends",
        ),
    ),
    (
        "C38",
        "a lamp behind a pane; sun, mirror, ceiling",
        Some(
            "tests: analytic::optics::a_mirror_throws_a_lamp_on_the_ceiling; raytrace: path::a_window_is_no_matter_which_way_the_lamp_is_found",
        ),
    ),
    ("C39", "a glass ball's caustic", Some("tests: agreement::the_cornell_box_with_mirror_and_glass")),
    ("C40", "malformed glTF", Some("geometry: corpus::hostile_files_are_loaded_or_refused_in_time")),
    (
        "C41",
        "required extensions, odd lamps, textured emission",
        Some("geometry: gltf::tests, emitter::tests"),
    ),
    (
        "C42",
        "EXR: big values, NaN, odd sizes",
        Some("raytrace: exr::write, film; xtask: read_exr.py reads one by OpenEXR"),
    ),
];
