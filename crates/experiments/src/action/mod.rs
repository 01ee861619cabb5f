//! The principle itself: the action of true and of learned Lagrangians along varied paths.

mod paths;

use anyhow::{Result, anyhow};
use lagrangian::analytic::AnalyticModel;
use lagrangian::dataset::random_states;
use lagrangian::mechanics::Lagrangian;
use lagrangian::models::Form;
use lagrangian::{FitConfig, Learned, LnnConfig, Loss, TrainingTask};
use lagrangian_analysis::action::{DiscreteAction, Path, PathKind};
use lagrangian_report::{Axis, Role};

use crate::harness::{Contestant, Experiment, Lab, contestant, less, neither};
use paths::{
    CASES, Case, Comparison, Measured, SIZES, compare, directions, energy_scale, mass_scale,
    measure,
};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "action",
    about: "stationary paths, their varied neighbours and conjugate points, of true and learned Lagrangians",
    run,
    title: "The action itself",
    text: &[
        "Hamilton's principle, measured: among all paths with the same ends in the same time, a motion is one whose action is \
         stationary. Stationary is not least: after the first conjugate point a motion is a saddle, and some paths near it \
         have less action. The least eigenvalue of the second variation says where.",
        "A learned Lagrangian knows its action up to a factor, a constant and a total derivative, which no path with fixed \
         ends can see; divided by the factor α of its mass matrices, its varied paths lie on the true curves.",
    ],
    quantities: &[
        neither("conjugate", "first conjugate point at", "s"),
        neither("morse_index", "Morse index", ""),
        neither("saddle", "saddle", ""),
        neither("action", "S", "J·s"),
        less("action_error_grid", "error of S, grid", "J·s"),
        less("slope", "slope of S(ε)", ""),
        less("missing_force", "missing force", ""),
        less("path_distance", "distance of the paths", ""),
        less("action_error", "error of S(ε) − S(0)", ""),
    ],
    about_quantities: "Stationary paths with the ends of a true motion. S of a learned Lagrangian is in its own gauge and not \
                       comparable; S(ε) − S(0) is, over the scale α of the mass matrices along the path, and its error is of \
                       all varied paths together (root mean square, relative). Slope: |dS/dε| at 0 times 0.2 over the \
                       change at ε = ±0.2. Distance: of the nodes of the two paths, largest.",
    ..Experiment::EMPTY
};

const TRUTH: Contestant = contestant("truth", "true", Role::Truth, ());

const LEARNED: Contestant = contestant("learned", "learned", Role::Lnn, ());

/// What was found between the ends of one case, by one Lagrangian.
struct Paths {
    short: Measured,
    long: Measured,
    /// First conjugate time of the long path, s.
    conjugate: Option<f64>,
}

impl Paths {
    /// Both paths of a case; `None` where one is not found.
    fn of(case: Case, lagrangian: &dyn Lagrangian) -> Result<Option<Self>> {
        let short = measure(lagrangian, &case.motion(case.short)?)?;
        let long = measure(lagrangian, &case.motion(case.long)?)?;
        let (Some(short), Some(long)) = (short, long) else {
            return Ok(None);
        };
        let conjugate = long.stationary.second_variation.conjugate_times.first();
        let conjugate = conjugate.copied();
        Ok(Some(Self {
            short,
            long,
            conjugate,
        }))
    }
}

fn run(lab: &mut Lab) -> Result<()> {
    let cases = if lab.quick() { &CASES[..1] } else { &CASES[..] };
    lab.plan(cases.len() * (1 + 8 * lab.seeds().len()));
    for case in cases {
        lab.begin(format!("{}, true", case.system))?;
        let system = case.system()?;
        let truth = Paths::of(*case, system.lagrangian())?
            .ok_or_else(|| anyhow!("the true system '{}' has no stationary path", case.system))?;
        record(lab, case, &TRUTH, &truth, None);
        draw_truth(lab, case, &*system, &truth)?;
        for seed in lab.seeds() {
            lab.begin_weighted(format!("{}, seed {seed}", case.system), 8.0)?;
            learned(lab, case, &*system, &truth, seed)?;
        }
    }
    Ok(())
}

/// One fit, where its Lagrangian has paths near the true ones.
fn learned(
    lab: &mut Lab,
    case: &Case,
    system: &dyn AnalyticModel,
    truth: &Paths,
    seed: u64,
) -> Result<()> {
    let model = fitted(lab, system, seed)?;
    let Some(lagrangian) = model.lagrangian() else {
        return Ok(());
    };
    let (scale, missed) = energy_scale(system, &model)?;
    let Some(paths) = Paths::of(*case, lagrangian)? else {
        let row = lab.row(&group(case, case.long), &LEARNED);
        row.add("conjugate", f64::NAN);
        return Ok(());
    };
    let compared = |truth: &Measured, own: &Measured| {
        let path = &truth.stationary.path;
        let scale = mass_scale(system.lagrangian(), lagrangian, path);
        compare(truth, own, scale)
    };
    let short = compared(&truth.short, &paths.short);
    let comparisons = [short, compared(&truth.long, &paths.long)];
    record(lab, case, &LEARNED, &paths, Some(comparisons));
    lab.row(&group(case, case.short), &LEARNED)
        .add("energy_scale", scale)
        .add("energy_missed", missed);
    if seed == lab.args.seed {
        let scales = comparisons.map(|c| c.scale);
        draw(lab, case, ("learned, over α", Role::Lnn), &paths, scales);
    }
    Ok(())
}

/// A Lagrangian network, fitted to exact accelerations of random states.
fn fitted(lab: &mut Lab, system: &dyn AnalyticModel, seed: u64) -> Result<Learned> {
    let quick = lab.quick();
    let samples = if quick { 4_000 } else { 20_000 };
    let data = random_states(system, samples, samples / 10, seed)?;
    let config = FitConfig {
        family: Box::new(LnnConfig {
            form: Form::Free,
            width: if quick { 32 } else { 64 },
            ..LnnConfig::default()
        }),
        training: TrainingTask {
            loss: Loss::ACCELERATION,
            budget: lab.budget(1000, 60),
            batch: if quick { 128 } else { 256 },
            seed,
            ..TrainingTask::default()
        },
    };
    Ok(lab.fit(&data, &config)?.model)
}

fn group(case: &Case, seconds: f64) -> String {
    format!("{}, {seconds} s", case.system)
}

/// Both paths; the conjugate point lies within the long one alone.
fn record(
    lab: &mut Lab,
    case: &Case,
    who: &Contestant,
    paths: &Paths,
    compared: Option<[Comparison; 2]>,
) {
    let both = [
        (case.short, &paths.short, None),
        (case.long, &paths.long, Some(paths.conjugate)),
    ];
    for (k, (seconds, measured, conjugate)) in both.into_iter().enumerate() {
        let path = &measured.stationary;
        let row = lab.row(&group(case, seconds), who);
        row.add("morse_index", path.second_variation.morse_index as f64)
            .add("saddle", f64::from(u8::from(path.kind == PathKind::Saddle)))
            .add("action", path.action)
            .add("action_error_grid", path.action_error)
            .add("slope", measured.slope)
            .add("missing_force", path.residual)
            .detail("verdict", path.kind);
        if let Some(conjugate) = conjugate {
            row.add("conjugate", conjugate.unwrap_or(f64::NAN));
        }
        if let Some(compared) = &compared {
            row.add("path_distance", compared[k].path_distance)
                .add("action_error", compared[k].action_error);
        }
    }
}

/// Title of the figures of actions along families of variations.
const VARIED: &str = "Action of varied paths";

/// Paths, actions along families of variations, and eigenvalues; those of a learned Lagrangian over its scale.
fn draw(
    lab: &mut Lab,
    case: &Case,
    (name, role): (&str, Role),
    paths: &Paths,
    [short, long]: [f64; 2],
) {
    let path = &paths.short.stationary.path;
    let q: Vec<f64> = path.q.iter().step_by(path.dof).copied().collect();
    let short_group = group(case, case.short);
    lab.plot_of([case.system, &short_group], "paths", "Stationary paths")
        .caption("The first coordinate.")
        .x(Axis::linear("time", "s"))
        .y(Axis::linear("first coordinate", ""))
        .add(name, role, &path.times(), q);
    let upwards = "flat at ε = 0, and upwards along all";
    let downwards =
        "after the conjugate point still flat at ε = 0, but downwards along one at least";
    let families = [
        ("minimum", case.short, &paths.short, short, upwards),
        ("saddle", case.long, &paths.long, long, downwards),
    ];
    for (id, seconds, measured, scale, caption) in families {
        let plot = lab
            .plot_of([case.system, &group(case, seconds)], id, VARIED)
            .caption(format!(
                "One curve for each variation, one and two half waves of each \
                coordinate: {caption}."
            ))
            .x(Axis::linear("size of the variation ε", ""))
            .y(Axis::linear("S(ε) − S(0)", "J·s"));
        for (k, one) in measured.families.iter().enumerate() {
            let change = one.iter().map(|s| s / scale).collect();
            plot.add(&format!("{name} {}", k + 1), role, &*SIZES, change);
        }
    }
    let eigenvalues = paths.long.eigenvalues.iter();
    let (t, x): (Vec<f64>, Vec<f64>) = eigenvalues.map(|(t, x)| (*t, x / long)).unzip();
    let caption = "Least eigenvalue of the second variation over the time of the end: the path is a minimum while it \
                       is above 0; it passes 0 at the first conjugate point.";
    lab.plot_of([case.system; 2], "conjugate", "Where the minimum ends")
        .caption(caption)
        .x(Axis::linear("time of the end", "s"))
        .y(Axis::linear("least eigenvalue", ""))
        .add(name, role, &t, x);
}

/// The same of the true Lagrangian, with the least curved variation and the order of the change along it.
fn draw_truth(lab: &mut Lab, case: &Case, system: &dyn AnalyticModel, paths: &Paths) -> Result<()> {
    draw(lab, case, ("true", Role::Truth), paths, [1.0; 2]);
    let stationary = &paths.long.stationary;
    let mut action = DiscreteAction::new(system.lagrangian());
    let mode = &stationary.second_variation.mode;
    let along = action.changes(&stationary.path, mode, &*SIZES);
    let [short, long] = [case.short, case.long].map(|seconds| group(case, seconds));
    lab.plot_of([case.system, &long], "saddle", VARIED).add(
        "least curved variation",
        Role::Other(0),
        &*SIZES,
        along,
    );
    let path = &paths.short.stationary.path;
    let epsilon = (-14..=-1).map(|k| 10.0_f64.powf(0.5 * f64::from(k)));
    let epsilon: Vec<f64> = epsilon.collect();
    let eta = &directions(path)[0];
    let lines = [
        (
            "from the stationary path: order 2",
            Role::Truth,
            path.clone(),
        ),
        (
            "from the straight path: order 1",
            Role::Other(0),
            straight(path),
        ),
    ];
    for (name, role, path) in lines {
        let change = action.changes(&path, eta, &epsilon);
        let change = change.iter().map(|s| s.abs()).collect();
        let caption = "Along the motion the action changes by the square of the variation, down to rounding; along any \
                           other path in proportion to it.";
        let title = "How fast the action changes";
        lab.plot_of([case.system, &short], "order", title)
            .caption(caption)
            .x(Axis::log("size of the variation ε", ""))
            .y(Axis::log("|S(ε) − S(0)|", "J·s"))
            .add(name, role, &epsilon, change);
    }
    Ok(())
}

/// The straight path between the same ends.
fn straight(path: &Path) -> Path {
    let last = path.segments();
    let node = |k: usize, i: usize| {
        let (a, b) = (path.node(0)[i], path.node(last)[i]);
        a + (b - a) * k as f64 / last as f64
    };
    let q = (0..=last).flat_map(|k| (0..path.dof).map(move |i| (k, i)));
    Path {
        q: q.map(|(k, i)| node(k, i)).collect(),
        ..*path
    }
}
