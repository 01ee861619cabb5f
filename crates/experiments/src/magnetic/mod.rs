//! Particles in magnetic fields: a force that is no gradient and does no work, and who can learn it.

mod orbits;

use anyhow::Result;
use lagrangian::dataset::random_starts;
use lagrangian::{DelanConfig, FitConfig, Loss, TrainingTask};
use lagrangian_report::{Axis, Role};

use crate::data::{TEST_SEED, beyond_delan, column, lagrangian_of, two_samples};
use crate::families::{self, MakeFamily, WIDTH};
use crate::harness::{Contestant, Experiment, Lab, contestants, less, neither};
use orbits::{
    CIRCLE, FIELDS, Field, MIRROR, Orbit, acceleration_error, field_error, orbit, samples,
};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "magnetic",
    about: "charged particles in a uniform field and between magnetic mirrors: the field, the energy, the bounce",
    run,
    title: "Particles in magnetic fields",
    text: &[
        "A magnetic force is no gradient and does no work. It comes from a term A(q)·q̇ of the Lagrangian, whose curl is \
         the field whatever the gauge.",
        "Learned from random states under known random forces; then free orbits, m = e = B₀ = 1.",
    ],
    quantities: &[
        less("field_error", "error of B", ""),
        less("acceleration_error", "error of q̈", ""),
        less("energy_drift", "energy", ""),
        less("largest_distance", "distance", "m"),
        neither("seconds", "training", "s"),
    ],
    about_quantities: "Root mean squared errors of e B = ∂pⱼ/∂qᵢ − ∂pᵢ/∂qⱼ and of q̈, relative, on states that no fit has \
                       seen; over a free orbit, the largest relative error of the true energy and the largest distance \
                       from the true orbit.",
    ..Experiment::EMPTY
};

const CONTESTANTS: [Contestant<MakeFamily>; 4] = contestants! {
    "lnn", "Lagrangian network, free", Lnn, families::lnn;
    "delan_vector_potential", "deep Lagrangian network with A(q)·q̇", Other(0), families::delan_with_vector_potential;
    "delan", "deep Lagrangian network", Other(1), families::delan;
    "baseline", "plain network", Baseline, families::mlp;
};

fn run(lab: &mut Lab) -> Result<()> {
    lab.plan(FIELDS.len() * CONTESTANTS.len() * lab.seeds().len());
    let circles = if lab.quick() { 20.0 } else { 100.0 };
    lab.setting("Free orbits", format!("{circles} gyro-periods"));
    for field in FIELDS {
        let system = field.system()?;
        let truth = orbit(&*system, field, circles)?;
        draw(lab, field, "truth", Role::Truth, &truth);
        let states = random_starts(&*system, 20, TEST_SEED);
        for who in &CONTESTANTS {
            if let Some(config) = (who.config)(WIDTH).downcast_ref::<DelanConfig>() {
                let reasons = beyond_delan(system.lagrangian(), &states, config.vector_potential);
                lab.cannot(field.name, who, reasons);
            }
            for seed in lab.seeds() {
                measure(lab, field, who, seed, &truth)?;
            }
        }
    }
    Ok(())
}

fn measure(
    lab: &mut Lab,
    field: &Field,
    who: &Contestant<MakeFamily>,
    seed: u64,
    truth: &Orbit,
) -> Result<()> {
    let system = field.system()?;
    lab.begin(format!("{} field, {}, seed {seed}", field.name, who.key))?;
    let (count, coordinates) = (
        if lab.quick() { 2_000 } else { 20_000 },
        system.coordinates(),
    );
    let states = |count, seed| samples(&*system, count, seed);
    let data = two_samples(coordinates, states, count, seed)?;
    let config = FitConfig {
        family: (who.config)(WIDTH),
        training: TrainingTask {
            loss: Loss::ACCELERATION,
            budget: lab.budget(5000, 100),
            batch: 128,
            seed,
            ..TrainingTask::default()
        },
    };
    let fitted = lab.fit(&data, &config)?;
    let model = &fitted.model;
    lab.save(&format!("{}-{}", field.name, who.key), model, seed)?;
    let field_error = lagrangian_of(model).map(|l| field_error(l, &*system, TEST_SEED));
    let periods = truth.t.last().map_or(0.0, |t| t / CIRCLE);
    let own = orbit(model, field, periods)?;
    let distance = own.distance(truth);
    let error = acceleration_error(model, &*system, TEST_SEED);
    let largest = distance.iter().fold(0.0, |most: f64, x| most.max(*x));
    lab.row(field.name, who)
        .add("field_error", field_error)
        .add("acceleration_error", error)
        .add("energy_drift", own.drift())
        .add("largest_distance", largest)
        .add("seconds", fitted.seconds);
    if seed == lab.args.seed {
        draw(lab, field, who.name, who.role, &own);
        let periods = in_periods(&own);
        let of = [field.name, field.title];
        lab.plot_of(of, "distance", "Distance from the true orbit")
            .caption("From the same start.")
            .x(Axis::linear("time", "gyro-periods"))
            .y(Axis::log("distance", "m").between(1e-9, 100.0))
            .add(who.name, who.role, &periods, distance);
    }
    Ok(())
}

fn in_periods(orbit: &Orbit) -> Vec<f64> {
    orbit.t.iter().map(|t| t / CIRCLE).collect()
}

/// The path, the energy, and between mirrors the bounce and the magnetic moment.
fn draw(lab: &mut Lab, field: &Field, name: &str, role: Role, orbit: &Orbit) {
    let coordinate = |i| column(&orbit.q, orbit.q.len() / orbit.t.len().max(1), i);
    // The first ten circles, before lines cover lines.
    let cut = |i| coordinate(i).into_iter().take(200).collect::<Vec<f64>>();
    let mut plot = |what: &str, title: &str, [x, y]: [Axis; 2], values: (&[f64], Vec<f64>)| {
        lab.plot_of([field.name, field.title], what, title)
            .x(x)
            .y(y)
            .add(name, role, values.0, values.1);
    };
    let metres = |label: &str, most: f64| Axis::linear(label, "m").between(-most, most);
    let time = || Axis::linear("time", "gyro-periods");
    let periods = in_periods(orbit);
    let (axes, path) = ([metres("x", 2.0), metres("y", 2.0)], (&cut(0)[..], cut(1)));
    let title = "The first ten gyro-periods, seen along z";
    plot("path", title, axes, path);
    let axes = [time(), Axis::log("|E/E₀ − 1|", "").between(1e-14, 10.0)];
    let errors = orbit.energy.iter().map(|e| e.abs()).collect();
    plot(
        "energy",
        "Error of the true energy",
        axes,
        (&periods, errors),
    );
    if field.name == MIRROR.name {
        // It turns round near ± 2.25 m, where B is |v|²/v⊥² times that in the middle.
        let axes = [time(), metres("z", 4.0)];
        let title = "Bouncing between the mirrors";
        plot("bounce", title, axes, (&periods, coordinate(2)));
        let axes = [time(), Axis::linear("μ/μ₀ − 1", "").between(-0.5, 0.5)];
        let title = "Magnetic moment m v⊥²/(2 B), an adiabatic invariant";
        plot("moment", title, axes, (&periods, orbit.moment.clone()));
    }
}
