//! A table that can become HTML or Markdown.

use super::words::{escape, escape_markdown};

/// Heads and rows of text; the first column is words, the others are numbers unless said.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Above each column.
    pub head: Vec<String>,
    /// As many cells each as there are heads.
    pub rows: Vec<Vec<Cell>>,
    /// Columns from the left that hold words.
    pub words: usize,
}

/// One cell.
#[derive(Clone, Debug, Default)]
pub struct Cell {
    /// What it says.
    pub text: String,
    /// Whether it is the best of its column.
    pub best: bool,
    /// Colour of a swatch before it, as CSS has it.
    pub swatch: Option<String>,
    /// Whether it counts less: numbers that are no measure.
    pub faint: bool,
}

impl From<String> for Cell {
    fn from(text: String) -> Cell {
        Cell { text, ..Cell::default() }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Cell {
        text.to_string().into()
    }
}

impl Table {
    /// An empty one.
    pub fn new(words: usize, head: &[&str]) -> Table {
        Table { head: head.iter().map(|h| h.to_string()).collect(), rows: Vec::new(), words }
    }

    /// As HTML, within a frame that scrolls sideways where the page is narrower than the table.
    pub fn html(&self, caption: &str) -> String {
        let class = |column: usize| if column < self.words { "" } else { " class=\"number\"" };
        let head = self.head.iter().enumerate();
        let head: String =
            head.map(|(i, h)| format!("<th scope=\"col\"{}>{}</th>", class(i), escape(h))).collect();
        let rows: String = self.rows.iter().map(|row| format!("<tr>{}</tr>\n", self.row(row))).collect();
        format!(
            "<p class=\"caption\">{0}</p>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{0}\"><table>\
             <thead><tr>{head}</tr></thead><tbody>\n{rows}</tbody></table></div>\n",
            escape(caption)
        )
    }

    fn row(&self, row: &[Cell]) -> String {
        let cell = |(i, cell): (usize, &Cell)| {
            let classes = [(i >= self.words, "number"), (cell.best, "best"), (cell.faint, "faint")];
            let classes: Vec<&str> = classes.iter().filter(|(on, _)| *on).map(|(_, name)| *name).collect();
            let swatch =
                cell.swatch.as_ref().map(|c| format!("<i class=\"swatch\" style=\"background:{c}\"></i>"));
            let (open, close) = if i == 0 { ("th scope=\"row\"", "th") } else { ("td", "td") };
            format!(
                "<{open} class=\"{}\">{}{}</{close}>",
                classes.join(" "),
                swatch.unwrap_or_default(),
                escape(&cell.text)
            )
        };
        row.iter().enumerate().map(cell).collect()
    }

    /// As Markdown; the best of a column in bold.
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let mut text = line(self.head.iter().map(|h| escape_markdown(h)).collect());
        let rule = (0..self.head.len()).map(|i| if i < self.words { "---".into() } else { "---:".into() });
        text += &line(rule.collect());
        for row in &self.rows {
            let cell = |c: &Cell| match c.best {
                true => format!("**{}**", escape_markdown(&c.text)),
                false => escape_markdown(&c.text),
            };
            text += &line(row.iter().map(cell).collect());
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_escaped_in_both_languages() {
        let mut table = Table::new(1, &["a<b", "n"]);
        let best = Cell { text: "1|2".into(), best: true, ..Cell::default() };
        table.rows.push(vec!["<script>".into(), best]);
        let html = table.html("<c>");
        assert!(
            !html.contains("<script>") && html.contains("&lt;script&gt;") && html.contains("number best")
        );
        assert_eq!(table.markdown(), "| a\\<b | n |\n| --- | ---: |\n| \\<script\\> | **1\\|2** |\n");
    }
}
