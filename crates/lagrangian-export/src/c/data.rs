//! The states of the data, as C.

use lagrangian::{Coordinates, Learned, Model as _};

use crate::block::literal;
use crate::tables::Tables;

/// The tables of the states of the data, as C.
pub(super) fn visited(model: &Learned, tables: &mut Tables) -> Option<String> {
    let visited = model.visited()?;
    let coordinates: &Coordinates = model.coordinates();
    let n = coordinates.dof();
    let ranges = visited.ranges(coordinates);
    let list = |f: &dyn Fn(usize) -> f64| (0..2 * n).map(f).collect::<Vec<f64>>();
    let of = |i: usize, f: &dyn Fn(&lagrangian::trajectory::Axis) -> f64| {
        ranges[i].as_ref().map_or(0.0, f)
    };
    tables.add("axis_low", &list(&|i| of(i, &|axis| axis.low)));
    tables.add("axis_high", &list(&|i| of(i, &|axis| axis.high)));
    tables.add("axis_margin", &list(&|i| of(i, &|axis| axis.margin)));
    tables.add("axis_scale", &list(&|i| of(i, &|axis| axis.scale)));
    let circles: Vec<&str> = (0..n)
        .map(|i| if coordinates.is_circle(i) { "1" } else { "0" })
        .collect();
    let (states, radius) = visited.representatives();
    tables.add("representatives", states);
    let angles = |f: fn(f64) -> f64| {
        let rows = states.chunks_exact(2 * n);
        rows.flat_map(|row| row[..n].iter().map(|q| f(*q)).collect::<Vec<_>>())
            .collect::<Vec<f64>>()
    };
    tables.add("representative_sines", &angles(f64::sin));
    tables.add("representative_cosines", &angles(f64::cos));
    Some(format!(
        "/* The states that the data visited: ranges of q and q', and states near which all others were. */\n\
         #define REPRESENTATIVES {}\n#define RADIUS {}\n\nstatic const int axis_is_circle[N] = {{{}}};\n\n",
        states.len() / (2 * n),
        literal(radius),
        circles.join(", ")
    ))
}
