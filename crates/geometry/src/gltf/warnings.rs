//! Warnings: said once each, with a count.

use std::collections::HashMap;

/// Collects messages in the order of their first appearance.
#[derive(Default)]
pub(super) struct Warnings {
    order: Vec<Entry>,
    index: HashMap<String, usize>,
}

struct Entry {
    text: String,
    place: String,
    count: u64,
}

impl Warnings {
    /// A message that stands for itself; repeated, it is counted.
    pub fn say(&mut self, text: impl Into<String>) {
        self.count(text, "", 1);
    }

    /// `n` more cases of `text`, the first of all at `place`.
    pub fn count(&mut self, text: impl Into<String>, place: impl Into<String>, n: u64) {
        if n == 0 {
            return;
        }
        let text = text.into();
        match self.index.get(&text) {
            Some(&i) => self.order[i].count += n,
            None => {
                self.index.insert(text.clone(), self.order.len());
                self.order.push(Entry { text, place: place.into(), count: n });
            }
        }
    }

    /// One line a message.
    pub fn into_lines(self) -> Vec<String> {
        let line = |e: Entry| match (e.count, e.place.is_empty()) {
            (1, true) => e.text,
            (n, true) => format!("{} ({n} times)", e.text),
            (n, false) => format!("{}: {n} (first: {})", e.text, e.place),
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
        warnings.count("triangles without area dropped", "node Door", 3);
        warnings.say("b");
        warnings.count("triangles without area dropped", "node Wall", 2);
        warnings.count("never", "anywhere", 0);
        assert_eq!(
            warnings.into_lines(),
            ["b (2 times)", "triangles without area dropped: 5 (first: node Door)"]
        );
    }
}
