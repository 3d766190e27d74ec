//! Warnings: said once each, with a count.

use std::collections::HashMap;

/// How many places a message names.
const SHOWN: usize = 4;

/// Collects messages in the order of their first appearance.
#[derive(Default)]
pub(super) struct Warnings {
    order: Vec<Entry>,
    index: HashMap<String, usize>,
}

struct Entry {
    text: String,
    /// The first few places that differ.
    places: Vec<String>,
    count: u64,
}

impl Warnings {
    /// A message that stands for itself; repeated, it is counted.
    pub fn say(&mut self, text: impl Into<String>) {
        self.count(text, "", 1);
    }

    /// `n` more cases of `text`, at `place`.
    pub fn count(&mut self, text: impl Into<String>, place: impl Into<String>, n: u64) {
        if n == 0 {
            return;
        }
        let text = text.into();
        let i = *self.index.entry(text.clone()).or_insert_with(|| {
            self.order.push(Entry { text, places: Vec::new(), count: 0 });
            self.order.len() - 1
        });
        let entry = &mut self.order[i];
        entry.count += n;
        // One more than is shown, to know that there are more.
        let place = place.into();
        if entry.places.len() <= SHOWN && !place.is_empty() && !entry.places.contains(&place) {
            entry.places.push(place);
        }
    }

    /// One line a message.
    pub fn into_lines(self) -> Vec<String> {
        let line = |e: Entry| {
            let more = if e.places.len() > SHOWN { ", …" } else { "" };
            let places = e.places[..e.places.len().min(SHOWN)].join(", ");
            match (e.count, places.is_empty()) {
                (1, true) => e.text,
                (n, true) => format!("{} ({n} times)", e.text),
                (n, false) => format!("{}: {n} ({places}{more})", e.text),
            }
        };
        self.order.into_iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_messages_are_counted_in_order() {
        let mut warnings = Warnings::default();
        warnings.say("b");
        warnings.count("triangles without area", "Door", 3);
        warnings.say("b");
        warnings.count("triangles without area", "Wall", 2);
        warnings.count("never", "anywhere", 0);
        (0..9).for_each(|i| warnings.count("many", format!("{}", i / 2), 1));
        assert_eq!(
            warnings.into_lines(),
            ["b (2 times)", "triangles without area: 5 (Door, Wall)", "many: 9 (0, 1, 2, 3, …)"]
        );
    }
}
