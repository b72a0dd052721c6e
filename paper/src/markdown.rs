//! Tables of Markdown, and numbers as the page writes them.

/// A table whose first columns are words and whose other columns are numbers.
pub struct Table {
    text: String,
    columns: usize,
}

impl Table {
    /// A table with these heads; all columns from number `words` on are set flush right.
    pub fn new(heads: &[&str], words: usize) -> Self {
        let rule = (0..heads.len()).map(|i| if i < words { "---" } else { "--:" });
        let mut table = Self { text: String::new(), columns: heads.len() };
        table.line(heads);
        table.line(&rule.collect::<Vec<_>>());
        table
    }

    /// Adds a row; cells that are missing stay empty.
    pub fn row(&mut self, cells: &[String]) {
        let mut cells: Vec<&str> = cells.iter().map(String::as_str).collect();
        assert!(cells.len() <= self.columns, "{cells:?}");
        cells.resize(self.columns, "");
        self.line(&cells);
    }

    fn line(&mut self, cells: &[&str]) {
        self.text.push_str(&format!("| {} |\n", cells.join(" | ")));
    }

    pub fn finish(self) -> String {
        self.text
    }
}

/// A count in groups of three digits, as the paper has it: `1,234,567`.
pub fn count(number: impl TryInto<u64>) -> String {
    let digits = number.try_into().unwrap_or(u64::MAX).to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// An error as a percentage with no more digits than it has: `0.1 %`.
pub fn percent(fraction: f64) -> String {
    // Rounded to a ten-thousandth of a percent, so that 0.07 · 100 is 7.
    format!("{} %", (fraction * 1e6).round() / 1e4)
}

/// How `ours` compares with `theirs`, to a percent: `8 % fewer`.
pub fn fewer(saved: f64) -> String {
    let share = (saved * 100.0).round();
    if share > 0.0 {
        format!("{share} % fewer")
    } else if share < 0.0 {
        format!("{} % more", -share)
    } else {
        "as many".to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_as_in_the_paper() {
        assert_eq!([0_u64, 999, 1000, 29_433_916].map(count), ["0", "999", "1,000", "29,433,916"]);
        assert_eq!([0.0, 0.001, 0.045, 0.07, 0.1].map(percent), ["0 %", "0.1 %", "4.5 %", "7 %", "10 %"]);
        assert_eq!([0.08, -0.161, 0.001].map(fewer), ["8 % fewer", "16 % more", "as many"]);
    }

    #[test]
    fn tables_are_rectangular() {
        let mut table = Table::new(&["what", "a", "b"], 1);
        table.row(&["x".into(), "1".into()]);
        assert_eq!(table.finish(), "| what | a | b |\n| --- | --: | --: |\n| x | 1 |  |\n");
    }
}
