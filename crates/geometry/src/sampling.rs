//! Square to disc, hemisphere, triangle, with the pdf beside each; seeded streams of numbers.
