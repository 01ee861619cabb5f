//! One evaluation of a ring of points, on one thread: a learned density, the banded solve, and a dense solve beside it.
//!
//! `cargo bench -p lagrangian --bench field_step [-- --quick]`

use lagrangian::experiment::wave::{exponent, step_costs};
use lagrangian::field::{DensityConfig, DensityNet, FieldScaling};

fn main() {
    let quick = std::env::args().any(|a| a == "--quick" || a == "--test");
    let sizes: &[usize] = if quick {
        &[10, 100, 1000]
    } else {
        &[10, 30, 100, 300, 1000, 3000, 10_000]
    };
    let config = DensityConfig {
        width: 24,
        ..DensityConfig::default()
    };
    let density =
        DensityNet::random(config, FieldScaling::identity(), 0).unwrap_or_else(|e| panic!("{e}"));
    let costs = step_costs(&density, sizes, if quick { 3 } else { 20 });
    let costs = costs.unwrap_or_else(|e| panic!("{e}"));
    println!("µs an evaluation   whole   banded solve   with a dense solve");
    for cost in &costs {
        let dense = cost.dense.map_or("–".into(), |s| format!("{:.1}", 1e6 * s));
        let (whole, solve) = (1e6 * cost.seconds, 1e6 * cost.solve);
        println!(
            "{:7} points   {whole:9.1}   {solve:9.2}   {dense:>12}",
            cost.points
        );
    }
    let of = |f: &dyn Fn(&lagrangian::experiment::wave::StepCost) -> Option<f64>| {
        let pairs = costs.iter().filter_map(|c| f(c).map(|s| (c.points, s)));
        exponent(&pairs.collect::<Vec<_>>(), 30)
    };
    println!(
        "exponent of the number of points: whole {:.2}, banded solve {:.2}, dense {:.2}",
        of(&|c| Some(c.seconds)),
        of(&|c| Some(c.solve)),
        of(&|c| c.dense),
    );
}
