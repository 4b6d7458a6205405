//! Lines that are drawn again in place, on a terminal.

use std::io;

use console::Term;

/// A terminal, and what was drawn on it last.
#[derive(Debug)]
pub struct Screen {
    terminal: Term,
    drawn: usize,
}

impl Default for Screen {
    fn default() -> Self {
        Self::new()
    }
}

impl Screen {
    /// The terminal on stdout, with nothing drawn yet.
    #[must_use]
    pub fn new() -> Self {
        Self {
            terminal: Term::buffered_stdout(),
            drawn: 0,
        }
    }

    /// Draws lines in place of those before, as much of them as there is room for.
    ///
    /// # Errors
    /// When the terminal cannot be written to.
    pub fn draw(&mut self, lines: &[String]) -> io::Result<()> {
        let (rows, columns) = self.terminal.size();
        let shown = lines.len().min(usize::from(rows).saturating_sub(1));
        // A terminal that became smaller keeps some lines of before.
        let above = self.drawn.min(usize::from(rows).saturating_sub(1));
        self.terminal.move_cursor_up(above)?;
        for line in lines.iter().take(shown) {
            let fitting: String = line.chars().take(columns.into()).collect();
            self.terminal.clear_line()?;
            self.terminal.write_line(&fitting)?;
        }
        self.terminal.clear_to_end_of_screen()?;
        self.drawn = shown;
        self.terminal.flush()
    }
}
