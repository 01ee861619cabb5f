//! Evaluating a model allocates nothing once it has run: a control loop may call it.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod counting;

use lagrangian::mechanics::{Actuation, Dissipation, Mechanical, Scaling};
use lagrangian::models::{Delan, Form, Lnn, Mlp, MlpConfig, MlpScaling};
use lagrangian::rigid::{self, RigidBodies};
use lagrangian::{Coordinates, DelanConfig, LnnConfig, Model};

use counting::allocations_of;

fn allocations(model: &dyn Model, states: usize) -> usize {
    let n = model.coordinates().dof();
    let (q, mut out) = (vec![0.3; states * n], vec![0.0; states * n]);
    let mut energy = vec![0.0; states];
    let mut evaluator = model.evaluator();
    let mut call = || {
        let _ = evaluator.forward_dynamics(&q, &q, &q, &mut out);
        let _ = evaluator.inverse_dynamics(&q, &q, &q, &mut out);
        let _ = evaluator.energy(&q, &q, &mut energy);
    };
    call();
    allocations_of(call)
}

#[test]
fn a_warm_model_allocates_nothing_for_one_state_or_for_many() {
    for n in [1, 2, 7] {
        for form in [Form::Free, Form::Convex] {
            let config = LnnConfig {
                form,
                ..LnnConfig::default()
            };
            let lnn = Lnn::random(Coordinates::angles(n), config, Scaling::identity(n), 0).unwrap();
            let model = Mechanical::conservative(lnn);
            for states in [1, 40] {
                assert_eq!(
                    allocations(&model, states),
                    0,
                    "n {n} {form:?}, {states} states"
                );
            }
        }
        let delan = Delan::random(
            Coordinates::angles(n),
            DelanConfig::default(),
            Scaling::identity(n),
            0,
        );
        let friction = Dissipation::viscous(vec![0.1; n]);
        let model = Mechanical::dissipative(delan.unwrap(), friction).unwrap();
        let model = model
            .driven(Actuation::offset(vec![0.1; n]).unwrap())
            .unwrap();
        assert_eq!(allocations(&model, 1) + allocations(&model, 40), 0);
        let (scaling, config) = (MlpScaling::identity(n), MlpConfig::default());
        let mlp = Mlp::random(Coordinates::angles(n), config, scaling, 0).unwrap();
        assert_eq!(allocations(&mlp, 1) + allocations(&mlp, 40), 0);
    }
}

#[test]
fn a_robot_of_rigid_bodies_allocates_nothing() {
    for name in rigid::EXAMPLES {
        let robot = RigidBodies::from_urdf(rigid::example(name).unwrap()).unwrap();
        assert_eq!(
            allocations(&robot, 1) + allocations(&robot, 40),
            0,
            "{name}"
        );
        let braked = Dissipation::viscous(vec![0.1; robot.dof()]);
        let braked = Mechanical::dissipative(robot, braked).unwrap();
        assert_eq!(allocations(&braked, 1), 0, "{name}");
    }
}
