//! A cart-pole learned from its motions, exported, and swung up by a controller that uses only the export.

use std::process::Command;

use lagrangian::mechanics::{Dissipation, Mechanical};
use lagrangian::rollout::times;
use lagrangian::train::ForceTerms;
use lagrangian::trajectory::Visited;
use lagrangian::{
    Budget, Dataset, DelanConfig, FitConfig, Learned, Model as _, Result, RolloutOptions,
    TrainingTask, analytic, fit, rollout,
};
use lagrangian_export::{About, export};

use crate::tools::{
    exists, folder, library, python, script, succeed, unit_sources, write, write_unit,
};

/// Motions of the cart with a pole of tests/python/plant.py under forces of many frequencies, and the model learned from them.
fn learned() -> Result<Learned> {
    let cart_pole = analytic::by_name("cart-pole", &[("mass", 0.3), ("gravity", 9.81)])?;
    let truth = Mechanical::dissipative(
        cart_pole.lagrangian(),
        Dissipation::viscous(vec![0.1, 0.01]),
    )?;
    let mut motions = Vec::new();
    for k in 0..16 {
        let (w, start) = (1.5 + 0.4 * f64::from(k), 0.8 * f64::from(k));
        let drive = move |t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]| {
            tau[0] = 12.0 * (w * t).sin() + 6.0 * (2.3 * w * t).cos() - 5.0 * q[0] - qd[0];
            tau[1] = 0.0;
        };
        let (times, options) = (times(4.0, 0.02)?, RolloutOptions::default());
        motions.push(
            rollout(&truth, &[0.0, start], &[0.0, 0.0], &times, &drive, &options)?.trajectory,
        );
    }
    let data = Dataset::new(truth.coordinates().clone(), &motions[..14], &motions[14..])?;
    let config = FitConfig {
        family: Box::new(DelanConfig {
            width: 32,
            ..DelanConfig::default()
        }),
        training: TrainingTask {
            forces: ForceTerms::friction(),
            budget: Budget::Steps(300),
            batch: 128,
            ..TrainingTask::default()
        },
    };
    Ok(fit(&data, &config, None, &mut ())?.model)
}

#[test]
fn a_learned_cart_pole_is_swung_up_through_casadi_and_its_adapters_agree() {
    let (Some(python), true) = (python(), exists("cc")) else {
        return;
    };
    let model = learned().unwrap();
    let visited: Option<&Visited> = model.visited();
    assert!(visited.is_some());
    let about = About {
        name: "learned",
        hash: "0",
    };
    let export = export(&model, about).unwrap();
    let folder = folder("learned");
    let sources = [export.code.header.clone(), export.code.source.clone()];
    write(&folder, &export.files(None).unwrap());
    write(&folder, &unit_sources(&export.interface, &sources));
    let library = library(
        &folder,
        &["learned.c", "learned_casadi.c"],
        "learned_casadi.so",
    );
    let mut swing_up = Command::new(&python);
    succeed(
        swing_up
            .arg(script("with_casadi.py"))
            .arg(library)
            .arg("learned"),
    );
    write_unit(&folder, &export.interface, &sources);
    let mut both = Command::new(python);
    succeed(both.arg(script("any_model.py")).arg(folder).arg("learned"));
}
