//! JSON and binary, a zero byte between them, as a `.glb` file.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::check(&fuzz::glb(bytes), "glb"));
