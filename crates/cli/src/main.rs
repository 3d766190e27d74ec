//! The command line: parses, runs, prints and exits.

fn main() {}
