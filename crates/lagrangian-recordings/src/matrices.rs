//! Columns that hold several numbers in a row: arrays of two axes, and lists.

use super::Layout;
use super::columns::{Resolved, resolve};
use lagrangian_motion::{Error, Result};

/// The name of an array, and the number of its columns where it has two axes.
pub(super) type Named<'a> = (&'a str, Option<usize>);

/// The columns of `layout` among those of arrays, and for each that is read the indices of its array and within it.
///
/// # Errors
/// Those of [`resolve`]; [`Error::Malformed`] for a matrix where a single column is required.
pub(super) fn resolve_arrays(
    arrays: &[Named<'_>],
    layout: &Layout,
    format: &'static str,
) -> Result<(Resolved, Vec<(usize, usize)>)> {
    let matrices = arrays
        .iter()
        .filter_map(|(name, width)| Some((*name, (*width)?)));
    let layout = layout.spread(&matrices.collect::<Vec<_>>(), format)?;
    let columns = arrays
        .iter()
        .enumerate()
        .flat_map(|(array, (name, width))| {
            let names = match width {
                Some(width) => numbered(name, *width),
                None => vec![(*name).to_owned()],
            };
            let column = move |(place, name)| (name, (array, place));
            names.into_iter().enumerate().map(column)
        });
    let (headers, all): (Vec<String>, Vec<(usize, usize)>) = columns.unzip();
    let resolved = resolve(&headers, &layout)?;
    let used = resolved.used().map(|column| all[column]).collect();
    Ok((resolved, used))
}

/// The names of the columns of a matrix: `q1`, `q2` of `q`.
fn numbered(name: &str, width: usize) -> Vec<String> {
    (1..=width).map(|i| format!("{name}{i}")).collect()
}

impl Layout {
    /// Of arrays, each with its name and the number of its columns where it has two axes, the indices of those that
    /// [`Format::Npz`](super::Format::Npz) reads.
    ///
    /// # Errors
    /// [`Error::Columns`]; [`Error::Malformed`] for a matrix where a single column is required.
    pub fn used_arrays(&self, arrays: &[(String, Option<usize>)]) -> Result<Vec<usize>> {
        let arrays: Vec<Named<'_>> = arrays
            .iter()
            .map(|(name, width)| (&**name, *width))
            .collect();
        let (_, used) = resolve_arrays(&arrays, self, "table")?;
        Ok(used.into_iter().map(|(array, _)| array).collect())
    }

    /// The layout with the names of matrices replaced by those of their columns.
    ///
    /// # Errors
    /// [`Error::Malformed`] for a matrix where a single column is required.
    fn spread(&self, matrices: &[(&str, usize)], format: &'static str) -> Result<Self> {
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
                    return Err(Error::malformed(
                        format,
                        format_args!(
                            "array '{name}' has {count} columns where one is needed: store an array of shape (rows,)"
                        ),
                    ));
                }
            }
        }
        Ok(layout)
    }
}
