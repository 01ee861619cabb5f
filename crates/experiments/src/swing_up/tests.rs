//! Laws of the swing-up controller on machines that are known exactly.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::by_name;
use lagrangian_control::{LoopConfig, Simulation};

use super::config::Machine;
use super::controller::SwingUp;
use super::lqr::{Linearisation, Lqr};

#[test]
fn the_regulator_of_a_double_integrator_is_that_of_the_textbook() {
    // Unit mass, Q = 1 for position alone, R = 1: K = (1, √2) in continuous time.
    let mass = by_name("mass-spring", &[("mass", 1.0), ("stiffness", 1e-9)]).unwrap();
    let linear = Linearisation::about(&*mass, &[0.0], 0).unwrap();
    let lqr = Lqr::design(&linear, 1e-3, &[1.0, 0.0], 1.0).unwrap();
    assert!((lqr.gain[0] - 1.0).abs() < 2e-3, "{:?}", lqr.gain);
    assert!((lqr.gain[1] - 2.0f64.sqrt()).abs() < 2e-3, "{:?}", lqr.gain);
}

#[test]
fn every_machine_swings_up_through_its_true_energy_and_stays_up() {
    use rand::SeedableRng;
    for machine in Machine::ALL {
        let model = by_name(machine.system(), &[]).unwrap();
        let config = machine.config();
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        for _ in 0..6 {
            let mut controller = SwingUp::new(&*model, config.clone(), 1.0 / 500.0).unwrap();
            let begin = model.sample_start(&mut rng);
            let mut simulation = Simulation::new(&*model, &begin, LoopConfig::default()).unwrap();
            simulation.run(&mut controller, 20.0);
            let (q, qd) = simulation.state();
            let (angle, rate) = (q[config.pendulum], qd[config.pendulum]);
            assert!(
                angle.cos() < -0.999 && rate.abs() < 0.05,
                "{machine:?} from {begin:?}: {angle} rad, {rate} rad/s"
            );
        }
    }
}
