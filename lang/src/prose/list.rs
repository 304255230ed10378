//! Numbered steps with steps below them, and how they are written in Markdown.

/// Steps in order, and what stands below all of them.
#[derive(Clone, Debug, Default)]
pub(super) struct List {
    pub(super) steps: Vec<Step>,
    /// Groups that belong to the list as a whole, such as what is done in any case.
    pub(super) groups: Vec<Group>,
    /// Whether the steps happen at the same time.
    pub(super) at_once: bool,
}

/// A sentence with what stands below it.
#[derive(Clone, Debug, Default)]
pub(super) struct Step {
    pub(super) text: String,
    /// Rows of a table, the head first.
    pub(super) table: Vec<Vec<String>>,
    pub(super) groups: Vec<Group>,
}

/// Steps below a step, with a line that leads to them.
#[derive(Clone, Debug, Default)]
pub(super) struct Group {
    /// Empty for the first group, to which the step itself leads.
    pub(super) lead: String,
    pub(super) list: List,
}

impl Step {
    /// A sentence alone.
    pub(super) fn new(text: impl Into<String>) -> Self {
        Step { text: text.into(), ..Step::default() }
    }

    /// A sentence that leads to steps.
    pub(super) fn with(text: impl Into<String>, list: List) -> Self {
        Step { text: text.into(), table: Vec::new(), groups: vec![Group { lead: String::new(), list }] }
    }
}

impl List {
    /// As Markdown.
    pub(super) fn markdown(&self) -> String {
        let mut lines = Vec::new();
        self.write(0, &mut lines);
        lines.join("\n")
    }

    fn write(&self, indent: usize, out: &mut Vec<String>) {
        let blank = " ".repeat(indent);
        if self.steps.is_empty() {
            out.push(format!("{blank}No step."));
        }
        for (i, step) in self.steps.iter().enumerate() {
            let mark = if self.at_once { "-".to_string() } else { format!("{}.", i + 1) };
            out.push(format!("{blank}{mark} {}", step.text));
            let inner = indent + mark.len() + 1;
            if !step.table.is_empty() {
                out.push(String::new());
                table(&step.table, inner, out);
                out.push(String::new());
            }
            groups(&step.groups, inner, out);
        }
        groups(&self.groups, indent, out);
    }
}

fn groups(all: &[Group], indent: usize, out: &mut Vec<String>) {
    for group in all {
        if !group.lead.is_empty() {
            out.push(String::new());
            out.push(format!("{}{}", " ".repeat(indent), group.lead));
            out.push(String::new());
        }
        group.list.write(indent, out);
    }
}

/// A table, columns aligned.
pub(super) fn table(rows: &[Vec<String>], indent: usize, out: &mut Vec<String>) {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| rows.iter().filter_map(|r| r.get(c)).map(|s| s.chars().count()).max().unwrap_or(0).max(3);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    for (i, row) in rows.iter().enumerate() {
        let cell = |(c, w): (usize, &usize)| format!("{:<w$}", row.get(c).map_or("", String::as_str));
        let cells: Vec<String> = widths.iter().enumerate().map(cell).collect();
        out.push(format!("{}| {} |", " ".repeat(indent), cells.join(" | ")));
        if i == 0 {
            let rule: Vec<String> = widths.iter().map(|w| "-".repeat(*w)).collect();
            out.push(format!("{}| {} |", " ".repeat(indent), rule.join(" | ")));
        }
    }
}
