//! Our chores, as `cargo xtask NAME`.

fn main() {}
