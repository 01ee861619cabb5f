//! The data of a motion in a page.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::{Signals, Trajectory};
use lagrangian_report::{Animation, Panel, Report, Role, Shape, Stage, draw};

#[test]
fn points_that_are_joined_are_played_in_parts_of_their_stage() {
    let stage = Stage {
        middle: [1.0, 0.0],
        radius: 2.0,
    };
    // The last point is joined to one that does not exist.
    let joined = vec![0, 0, 7];
    let gone = [0.0, 0.0, 1.0, 2.0, f64::NAN, 0.0];
    let panel = Panel {
        shape: Shape::Points { joined, stage },
        t: vec![0.0, 1.0],
        values: [vec![0.0, 0.0, 1.0, 0.0, 2.0, -1.0], gone.to_vec()].concat(),
        ..Panel::chain(
            "p",
            Role::Truth,
            &[],
            &Trajectory::new("", vec![], Signals::default()),
            None,
        )
    };
    assert_eq!(panel.points(0), [(0.0, 0.0), (1.0, 0.0), (2.0, -1.0)]);
    assert!(panel.points(1).is_empty());
    let text = serde_json::to_string(&panel).unwrap();
    let back: Panel = serde_json::from_str(&text).unwrap();
    assert_eq!(back.shape, panel.shape);
    let animation = Animation {
        panels: vec![panel],
        ..Animation::default()
    };
    draw::gif(&animation, std::io::sink()).unwrap();
    let page = draw::html(&Report {
        animations: vec![animation],
        ..Report::default()
    });
    assert!(page.contains("\"joined\":[0,0,7]") && !page.contains("\"lengths\""));
    // The radius is written as 5 000, from the middle of the stage.
    assert!(page.contains("\"values\":[-2500,0,0,0,2500,-2500,"));
}

#[test]
fn a_pendulum_that_turns_many_times_keeps_its_angle() {
    let signals = Signals {
        q: vec![0.0, 40_000.0],
        ..Signals::default()
    };
    let fast = Trajectory::new("", vec![0.0, 1.0], signals);
    let panel = Panel::chain("p", Role::Truth, &[2.0], &fast, None);
    let page = draw::html(&Report {
        animations: vec![Animation {
            panels: vec![panel],
            ..Animation::default()
        }],
        ..Report::default()
    });
    assert!(page.contains(",40000000]") && page.contains("\"lengths\":[1.0]"));
}
