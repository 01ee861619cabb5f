//! Columns that hold several numbers in a row: arrays of two axes, and lists.

use super::Layout;

/// The names of the columns of a matrix: `q1`, `q2` of `q`.
pub(super) fn numbered(name: &str, width: usize) -> Vec<String> {
    (1..=width).map(|i| format!("{name}{i}")).collect()
}

impl Layout {
    /// The layout with the names of matrices replaced by those of their columns.
    ///
    /// # Errors
    /// A message, for a matrix where a single column is required.
    pub(super) fn spread(&self, matrices: &[(&str, usize)]) -> Result<Self, String> {
        let mut layout = self.clone();
        let columns_of = |name: &str| {
            let (_, width) = matrices.iter().find(|(own, _)| *own == name)?;
            Some(numbered(name, *width))
        };
        let signals = layout.columns.iter_mut().map(|(_, names)| names);
        let lists = [
            &mut layout.angles,
            &mut layout.actuated,
            &mut layout.parameters,
        ];
        for names in signals.chain(lists) {
            let columns = |name: String| columns_of(&name).unwrap_or_else(|| vec![name]);
            let old = std::mem::take(names).into_iter();
            *names = old.flat_map(columns).collect();
        }
        for (single, default) in [(&mut layout.t, "t"), (&mut layout.trajectory, "trajectory")] {
            let name = single.as_deref().unwrap_or(default);
            match columns_of(name).as_deref() {
                None => {}
                Some([column]) => *single = Some(column.clone()),
                Some(columns) => {
                    let count = columns.len();
                    return Err(format!(
                        "array '{name}' has {count} columns where one is needed: store an array of shape (rows,)"
                    ));
                }
            }
        }
        Ok(layout)
    }
}
