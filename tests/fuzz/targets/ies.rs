//! Photometric files.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(web) = geometry::ies::parse(bytes) {
        assert!(web.solid_angle().is_finite() && web.solid_angle() > 0.0 && web.peak() > 0.0);
        let d = web.sample([0.3, 0.7]);
        assert!(d.is_finite() && web.relative(d).is_finite() && web.pdf(d).is_finite());
        assert!(geometry::ies::parse(web.to_lm63().as_bytes()).is_ok(), "what is written can be read");
    }
});
