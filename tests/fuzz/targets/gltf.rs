//! JSON, as a `.gltf` file.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::check(bytes, "gltf"));
