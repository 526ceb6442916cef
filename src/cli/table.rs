//! Tables of figures: a heading, a first column of names, columns of numbers aligned to the right.

/// A table, row by row.
pub struct Table<const N: usize> {
    /// `None` is a line across.
    rows: Vec<Option<[String; N]>>,
}

impl<const N: usize> Table<N> {
    pub fn new(names: &[&str; N]) -> Self {
        Self {
            rows: vec![Some(names.map(String::from))],
        }
    }

    pub fn row(&mut self, cells: [String; N]) {
        self.rows.push(Some(cells));
    }

    pub fn rule(&mut self) {
        self.rows.push(None);
    }

    /// Appends the table to `out`, indented.
    pub fn print(&self, out: &mut String) {
        let mut widths = [0; N];
        for row in self.rows.iter().flatten() {
            for (width, cell) in widths.iter_mut().zip(row) {
                *width = (*width).max(cell.chars().count());
            }
        }
        for row in &self.rows {
            let line = match row {
                Some(cells) => {
                    let padded = cells.iter().zip(widths).enumerate();
                    let padded = padded.map(|(i, (cell, width))| match i {
                        0 => format!("  {cell:<width$}"),
                        _ => format!("  {cell:>width$}"),
                    });
                    padded.collect::<String>()
                }
                None => {
                    let width = widths.iter().sum::<usize>() + 2 * (N - 1);
                    format!("  {}", "-".repeat(width))
                }
            };
            out.push_str(line.trim_end());
            out.push('\n');
        }
    }
}

/// Begins a section.
pub fn heading(out: &mut String, text: &str) {
    out.push('\n');
    out.push_str(text);
    out.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let mut table = Table::new(&["name", "±"]);
        table.row(["a".into(), "12.5".into()]);
        table.rule();
        table.row(["total".into(), String::new()]);
        let mut out = String::new();
        heading(&mut out, "Figures");
        table.print(&mut out);
        let expected = "\nFigures\n  name      ±\n  a      12.5\n  -----------\n  total\n";
        assert_eq!(out, expected);
    }
}
