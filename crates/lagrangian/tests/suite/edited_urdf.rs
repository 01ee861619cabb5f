//! Robots written back into the URDF text that they were read from.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::ops::ControlFlow;

use lagrangian::Model;
use lagrangian::mechanics::Dissipation;
use lagrangian::rigid::{self, RigidBodies};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Torques of random states.
fn torques(robot: &RigidBodies) -> Vec<f64> {
    let n = robot.dof();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut column = |size: f64| -> Vec<f64> {
        (0..100 * n)
            .map(|_| rng.random_range(-size..size))
            .collect()
    };
    let (q, qd, qdd) = (column(3.0), column(2.0), column(5.0));
    let mut tau = vec![0.0; q.len()];
    let _ = robot.evaluator().inverse_dynamics(&q, &qd, &qdd, &mut tau);
    tau
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A robot with other bodies, as an identification leaves them: heavier or lighter, with a load off the axis.
fn changed(robot: &RigidBodies, seed: u64) -> RigidBodies {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut parameters = robot.inertial_parameters();
    for body in parameters.as_chunks_mut::<10>().0 {
        let factor = rng.random_range(0.3..2.0);
        body.iter_mut().for_each(|x| *x *= factor);
        let [x, y, z]: [f64; 3] = std::array::from_fn(|_| rng.random_range(-0.3..0.3));
        let load = [
            1.0,
            x,
            y,
            z,
            y * y + z * z + 0.02,
            -x * y,
            -x * z,
            x * x + z * z + 0.02,
            -y * z,
            x * x + y * y + 0.02,
        ];
        body.iter_mut().zip(load).for_each(|(x, l)| *x += l);
    }
    robot.clone().with_inertial_parameters(&parameters).unwrap()
}

fn friction(n: usize) -> Dissipation {
    Dissipation {
        viscous: (0..n).map(|i| 0.1 + 0.01 * i as f64).collect(),
        coulomb: (0..n).map(|i| 1.0 / (3.0 + i as f64)).collect(),
        smoothing: vec![0.05; n],
        ..Dissipation::default()
    }
}

/// The text without the elements that may be edited, and without blanks.
fn rest(text: &str) -> String {
    let edited = ["<mass", "<inertia ", "<dynamics", "<inertial", "</inertial"];
    let lines = text.lines();
    let kept = lines.filter(|line| !edited.iter().any(|tag| line.trim().starts_with(tag)));
    kept.filter(|line| !line.trim().starts_with("<origin"))
        .map(|line| format!("{line}\n"))
        .collect()
}

#[test]
fn a_robot_that_is_read_again_has_the_torques_and_the_friction_that_were_written() {
    for name in rigid::EXAMPLES {
        let text = rigid::example(name).unwrap();
        let robot = RigidBodies::from_urdf(text).unwrap();
        for seed in 0..5 {
            let changed = changed(&robot, seed);
            let friction = friction(robot.dof());
            let edited = changed.edit_urdf(text, Some(&friction)).unwrap();
            let again = RigidBodies::from_urdf(&edited).unwrap();
            let difference = largest_difference(&torques(&changed), &torques(&again));
            assert!(difference < 1e-9, "{name}: {difference:e}");
            assert!(largest_difference(&torques(&robot), &torques(&again)) > 0.1);
            assert_eq!(again.dissipation(0.05).unwrap(), Some(friction));
            assert_eq!(rest(text), rest(&edited), "{name}");
        }
    }
}

#[test]
fn a_robot_that_was_not_changed_leaves_the_text_to_the_byte() {
    for name in rigid::EXAMPLES {
        let text = rigid::example(name).unwrap();
        let robot = RigidBodies::from_urdf(text).unwrap();
        assert_eq!(robot.edit_urdf(text, None).unwrap(), text);
    }
}

/// Windows line ends, a byte order mark, tabs, quotes of both kinds, comments in between, a link without inertia and without a
/// closing tag, an origin that turns, and a tool that is fixed to the last link.
const UNUSUAL: &str = "\u{feff}<?xml version='1.0' encoding=\"UTF-8\"?>\r\n<!-- Größe: ½ -->\r\n<robot name='odd'\r\n\tversion=\"1\">\r\n\t<link name=\"base\"/>\r\n\t<link name='arm' />\r\n\t<link name=\"hand\">\r\n\t\t<visual/>\r\n\t\t<inertial><!-- by hand --><mass  value = '0.5' unit='kg'/>\r\n\t\t\t<origin rpy=\"0.1 0.2 0.3\"/><inertia ixx='1e-3' iyy=\"0.001\" izz=\"0.001\"/></inertial>\r\n\t</link>\r\n\t<link name=\"tool\"><inertial><mass value=\"0.4\"/><inertia ixx=\"0.002\" iyy=\"0.002\" izz=\"0.002\"/></inertial></link>\r\n\t<joint name=\"j1\" type=\"continuous\"><parent link=\"base\"/><child link=\"arm\"/><axis xyz=\"0 1 0\"/></joint>\r\n\t<joint name=\"j2\" type=\"prismatic\">\r\n\t\t<parent link=\"arm\"/>\r\n\t\t<child link=\"hand\"/>\r\n\t\t<dynamics friction='0' />\r\n\t\t<axis xyz=\"1 1 0\"/>\r\n\t</joint>\r\n\t<joint name=\"fixed\" type=\"fixed\"><origin xyz=\"0 0 0.1\"/><parent link=\"hand\"/><child link=\"tool\"/></joint>\r\n</robot>\r\n";

#[test]
fn a_text_of_unusual_form_keeps_its_form() {
    let robot = RigidBodies::from_urdf(UNUSUAL).unwrap();
    let changed = changed(&robot, 3);
    let edited = changed.edit_urdf(UNUSUAL, Some(&friction(2))).unwrap();
    let again = RigidBodies::from_urdf(&edited).unwrap();
    assert!(largest_difference(&torques(&changed), &torques(&again)) < 1e-9);
    assert_eq!(again.dissipation(0.05).unwrap(), Some(friction(2)));
    let kept = [
        "\u{feff}<?xml version='1.0' encoding=\"UTF-8\"?>\r\n<!-- Größe: ½ -->\r\n<robot name='odd'\r\n\tversion=\"1\">\r\n\t<link name=\"base\"/>\r\n",
        "\t<link name='arm'>\r\n\t\t<inertial>\r\n\t\t\t<origin xyz=\"",
        "/>\r\n\t\t</inertial>\r\n\t</link>\r\n\t<link name=\"hand\">\r\n\t\t<visual/>\r\n\t\t<inertial><!-- by hand --><mass  value = '",
        "' unit='kg'/>\r\n\t\t\t<origin rpy=\"0 0 0\" xyz=\"",
        "\"><inertial><mass value=\"0.4\"/><inertia ixx=\"0.002\" iyy=\"0.002\" izz=\"0.002\"/></inertial></link>\r\n",
        "type=\"continuous\"><dynamics damping=\"0.1\" friction=\"0.3333333333333333\"/><parent",
        "\t\t<dynamics friction='0.25' damping=\"0.11\" />\r\n\t\t<axis",
    ];
    for part in kept {
        assert!(edited.contains(part), "{part}\nnot in\n{edited}");
    }
    assert_eq!(edited.matches('\n').count(), edited.matches("\r\n").count());
}

#[test]
fn fixed_links_lose_a_part_of_their_inertia_only_where_the_moving_link_could_not_exist() {
    let robot = RigidBodies::from_urdf(UNUSUAL).unwrap();
    let described = robot.inertial_parameters();
    // The hand with the tool weighs 0.9 kg; as a fifth of it, it cannot hold a tool of 0.4 kg.
    let lighter: Vec<f64> = described
        .iter()
        .enumerate()
        .map(|(k, x)| if k < 10 { unit(k) } else { 0.2 * x })
        .collect();
    let lighter = robot.clone().with_inertial_parameters(&lighter).unwrap();
    let edited = lighter.edit_urdf(UNUSUAL, None).unwrap();
    let again = RigidBodies::from_urdf(&edited).unwrap();
    assert!(largest_difference(&torques(&lighter), &torques(&again)) < 1e-9);
    assert!(
        edited.contains("<link name=\"tool\"><inertial><mass value=\"0.1\"/>")
            || edited.contains("<mass value=\"0.05\"/>"),
        "{edited}"
    );
    // Parameters that no body can have are refused.
    let mut none = described;
    none[10] = -1.0;
    let none = robot.with_inertial_parameters(&none).unwrap();
    let message = none.edit_urdf(UNUSUAL, None).unwrap_err().to_string();
    assert!(message.contains("link 'hand' is no body"), "{message}");
}

/// A ball of 1 kg.
fn unit(k: usize) -> f64 {
    match k {
        0 => 1.0,
        4 | 7 | 9 => 0.01,
        _ => 0.0,
    }
}

#[test]
fn the_text_of_another_robot_is_refused() {
    let ur5 = RigidBodies::from_urdf(rigid::example("ur5").unwrap()).unwrap();
    for name in ["panda", "two_link_arm"] {
        assert!(
            ur5.edit_urdf(rigid::example(name).unwrap(), None).is_err(),
            "{name}"
        );
    }
    let longer = rigid::example("ur5").unwrap().replace("0.089159", "0.09");
    let message = ur5.edit_urdf(&longer, None).unwrap_err().to_string();
    assert!(message.contains("other kinematics"), "{message}");
    assert!(ur5.edit_urdf("no XML", None).is_err());
}

#[test]
fn joints_in_another_order_or_locked_are_written_where_they_are() {
    let text = rigid::example("ur5").unwrap();
    let joints = ["elbow_joint".to_string(), "shoulder_lift_joint".to_string()];
    let robot = RigidBodies::with_joints(text, &joints).unwrap();
    let changed = changed(&robot, 7);
    let edited = changed.edit_urdf(text, Some(&friction(2))).unwrap();
    let again = RigidBodies::with_joints(&edited, &joints).unwrap();
    assert!(largest_difference(&torques(&changed), &torques(&again)) < 1e-9);
    assert_eq!(again.dissipation(0.05).unwrap(), Some(friction(2)));
    assert!(
        RigidBodies::from_urdf(&edited).is_ok(),
        "the locked joints still move bodies"
    );
}

/// Two arms on one turning trunk.
const BRANCHES: &str = r#"<robot name="branches">
  <link name="base"/>
  <link name="trunk"><inertial><mass value="5"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial></link>
  <link name="left"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial></link>
  <link name="right"><inertial><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.02"/></inertial></link>
  <joint name="right_joint" type="revolute"><origin xyz="0.2 0 0"/><parent link="trunk"/><child link="right"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="2" effort="60"/></joint>
  <joint name="trunk_joint" type="continuous"><parent link="base"/><child link="trunk"/><axis xyz="0 0 1"/><limit velocity="2" effort="60"/></joint>
  <joint name="left_joint" type="prismatic"><origin xyz="-0.2 0 0"/><parent link="trunk"/><child link="left"/><axis xyz="1 0 0"/><limit lower="0" upper="0.5" velocity="1" effort="60"/></joint>
</robot>
"#;

#[test]
fn branches_are_written_where_they_are_and_can_be_moved_for_identification() {
    let robot = RigidBodies::from_urdf(BRANCHES).unwrap();
    let changed = changed(&robot, 9);
    let edited = changed.edit_urdf(BRANCHES, Some(&friction(3))).unwrap();
    let again = RigidBodies::from_urdf(&edited).unwrap();
    assert!(largest_difference(&torques(&changed), &torques(&again)) < 1e-9);
    assert_eq!(again.dissipation(0.05).unwrap(), Some(friction(3)));
    let limits = rigid::JointLimits::of_urdf(BRANCHES, robot.joints()).unwrap();
    let config = rigid::ExcitationConfig {
        duration: 5.0,
        ..rigid::ExcitationConfig::default()
    };
    let found = rigid::excite(&robot, &limits, &config, &mut |_| ControlFlow::Break(())).unwrap();
    assert!(found.combinations > 10 && found.plan.tau.iter().all(|tau| tau.abs() < 60.0));
}
