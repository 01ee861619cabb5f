//! Descriptions of robots that cannot be used: each is refused with a remedy, none makes the library panic.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::mechanics::Quantities;
use lagrangian::rigid::{self, RigidBodies};
use rand::{RngExt, SeedableRng};

const MASS: &str =
    "<inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial>";

fn link(name: &str) -> String {
    format!("<link name=\"{name}\">{MASS}</link>")
}

fn joint(name: &str, kind: &str, parent: &str, child: &str, more: &str) -> String {
    format!(
        "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/><axis xyz=\"0 0 1\"/>{more}</joint>"
    )
}

fn robot(content: &str) -> String {
    format!("<robot name=\"r\">{content}</robot>")
}

/// A base and one link that turns, with this inertial.
fn single(inertial: &str) -> String {
    robot(&format!(
        "<link name=\"base\"/><link name=\"arm\">{inertial}</link>{}",
        joint("turn", "revolute", "base", "arm", "")
    ))
}

/// A chain of n links that turn.
fn chain(n: usize) -> String {
    let links: String = (0..=n).map(|i| link(&format!("l{i}"))).collect();
    let joints: String = (0..n)
        .map(|i| {
            joint(
                &format!("j{i}"),
                "continuous",
                &format!("l{i}"),
                &format!("l{}", i + 1),
                "",
            )
        })
        .collect();
    robot(&(links + &joints))
}

fn refusal(text: &str) -> String {
    RigidBodies::from_urdf(text).unwrap_err().to_string()
}

#[test]
fn what_is_not_urdf_is_refused_as_such() {
    for text in [
        "",
        "   ",
        "q,qd\n1,2\n",
        "<robot",
        "<robot name='r'><link name='a'></robot>",
        "\u{0}\u{1}",
    ] {
        assert!(
            refusal(text).contains("not XML"),
            "{text:?}: {}",
            refusal(text)
        );
    }
    assert!(refusal("<sdf version='1.6'/>").contains("<sdf>"));
    assert!(refusal("<robot/>").contains("no link"));
    let entities = "<!DOCTYPE x [<!ENTITY a \"aaaaaaaa\">]><robot>&a;</robot>";
    assert!(refusal(entities).contains("not XML"));
}

#[test]
fn huge_and_deep_files_are_refused_before_they_are_parsed() {
    assert!(refusal(&" ".repeat(9 << 20)).contains("bytes of text"));
    assert!(refusal(&"<a>".repeat(1 << 20)).contains("deep"));
    assert!(refusal(&format!("{}{}", "<a>".repeat(500), "</a>".repeat(500))).contains("deep"));
    assert!(refusal(&robot(&"<link/>".repeat(300_000))).contains("not XML"));
    assert!(refusal(&chain(3000)).contains("3000 joints move"));
}

#[test]
fn what_is_no_tree_is_refused_by_name() {
    let (a, b, c) = (link("a"), link("b"), link("c"));
    let loop_ = [
        a.clone(),
        b.clone(),
        joint("j", "revolute", "a", "b", ""),
        joint("k", "revolute", "b", "a", ""),
    ]
    .concat();
    assert!(refusal(&robot(&loop_)).contains("closed loop"));
    let own = [a.clone(), b.clone(), joint("j", "revolute", "b", "b", "")].concat();
    assert!(refusal(&robot(&own)).contains("'b' is part of a closed loop"));
    let two = [
        a.clone(),
        b.clone(),
        c.clone(),
        joint("j", "revolute", "a", "c", ""),
        joint("k", "fixed", "b", "c", ""),
    ]
    .concat();
    assert!(refusal(&robot(&two)).contains("'c' is the child of joint 'j' and of joint 'k'"));
    let apart = [
        a.clone(),
        b.clone(),
        c,
        joint("j", "revolute", "a", "b", ""),
    ]
    .concat();
    assert!(refusal(&robot(&apart)).contains("'a' and 'c' have no parent joint"));
    let lost = [a.clone(), joint("j", "revolute", "a", "nowhere", "")].concat();
    assert!(refusal(&robot(&lost)).contains("'nowhere'"));
    assert!(refusal(&robot(&[a.clone(), a.clone()].concat())).contains("two links named 'a'"));
    let same = [
        a.clone(),
        b,
        joint("j", "revolute", "a", "b", ""),
        joint("j", "revolute", "a", "b", ""),
    ]
    .concat();
    assert!(refusal(&robot(&same)).contains("two joints named 'j'"));
    assert!(refusal(&robot("<link/>")).contains("no name"));
    assert!(refusal(&robot(&a)).contains("no joint can move"));
}

#[test]
fn joints_that_cannot_be_used_are_named_and_may_be_locked() {
    for kind in ["floating", "planar"] {
        let text = chain(2).replacen("\"continuous\"", &format!("\"{kind}\""), 1);
        assert!(refusal(&text).contains(&format!("joint 'j0' is {kind}")));
        let locked = RigidBodies::with_joints(&text, &["j1".into()]).unwrap();
        assert_eq!(locked.dof(), 1);
    }
    let mimic = [
        link("a"),
        link("b"),
        link("c"),
        joint("j", "revolute", "a", "b", ""),
        joint("k", "revolute", "b", "c", "<mimic joint=\"j\"/>"),
    ];
    let text = robot(&mimic.concat());
    assert!(
        refusal(&text).contains("joint 'k' mimics joint 'j'")
            && refusal(&text).contains("`joints`")
    );
    assert_eq!(
        RigidBodies::with_joints(&text, &["j".into()])
            .unwrap()
            .dof(),
        1
    );
    assert!(refusal(&chain(13)).contains("13 joints move, where 12 is the most"));
    assert_eq!(RigidBodies::from_urdf(&chain(12)).unwrap().dof(), 12);
    assert!(refusal(&chain(1).replace("continuous", "spherical")).contains("of type 'spherical'"));
    assert!(refusal(&chain(1).replace("0 0 1", "0 0 0")).contains("axis 0"));
}

#[test]
fn joints_that_are_asked_for_and_not_there_are_refused_with_those_that_are() {
    let with = |names: &[&str]| {
        let names: Vec<String> = names.iter().map(|n| (*n).to_string()).collect();
        RigidBodies::with_joints(rigid::example("ur5").unwrap(), &names)
            .unwrap_err()
            .to_string()
    };
    assert!(with(&["elbow"]).contains("elbow_joint"));
    assert!(with(&["elbow_joint", "elbow_joint"]).contains("chosen twice"));
    assert!(with(&["ee_fixed_joint"]).contains("is fixed"));
}

#[test]
fn masses_and_inertias_that_no_body_has_are_refused() {
    let inertial = |mass: &str, inertia: &str| {
        single(&format!(
            "<inertial><mass value=\"{mass}\"/><inertia {inertia}/></inertial>"
        ))
    };
    let sphere = "ixx=\"1\" iyy=\"1\" izz=\"1\"";
    assert!(RigidBodies::from_urdf(&inertial("1", sphere)).is_ok());
    assert!(refusal(&inertial("-1", sphere)).contains("mass -1"));
    assert!(refusal(&inertial("0", sphere)).contains("inertia and no mass"));
    assert!(
        refusal(&inertial("1", "ixx=\"1\" iyy=\"1\" izz=\"-1\"")).contains("principal moment -1")
    );
    assert!(refusal(&inertial("1", "ixx=\"1\" iyy=\"1\" izz=\"5\"")).contains("above the sum"));
    assert!(
        refusal(&inertial("1", "ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"3\""))
            .contains("principal moment")
    );
    for number in ["NaN", "inf", "1e400", "", "1,5", "${mass}", "one"] {
        assert!(
            refusal(&inertial(number, sphere)).contains("finite number"),
            "{number}"
        );
        assert!(
            refusal(&inertial("1", &format!("ixx=\"{number}\""))).contains("link 'arm': ixx"),
            "{number}"
        );
    }
    assert!(refusal(&single("<inertial/>")).contains("without <mass>"));
    assert!(refusal(&single("")).contains("nothing that joint 'turn' moves has inertia"));
    let on_axis = "<inertial><mass value=\"1\"/></inertial>";
    assert!(refusal(&single(on_axis)).contains("nothing that joint 'turn' moves has inertia"));
    let origin = |xyz: &str| {
        single(&format!(
            "<inertial><origin xyz=\"{xyz}\"/><mass value=\"1\"/></inertial>"
        ))
    };
    assert!(
        RigidBodies::from_urdf(&origin("0.5 0 0")).is_ok(),
        "a point mass off the axis"
    );
    assert!(refusal(&origin("1 2")).contains("three numbers"));
    assert!(refusal(&origin("1 2 NaN")).contains("link 'arm': xyz is 'NaN'"));
}

#[test]
fn what_is_a_matter_of_units_or_a_slip_is_refused_by_name() {
    let inertial = |origin: &str, mass: &str, ixx: &str| {
        single(&format!(
            "<inertial><origin {origin}/><mass value=\"{mass}\"/><inertia ixx=\"{ixx}\" iyy=\"{ixx}\" izz=\"{ixx}\"/></inertial>"
        ))
    };
    assert!(
        RigidBodies::from_urdf(&inertial(
            "xyz=\"0.2 0 0\" rpy=\"0 3.1416 -1.57\"",
            "1",
            "1"
        ))
        .is_ok()
    );
    let finding = refusal(&inertial("xyz=\"212.5 0 0\"", "1", "1"));
    assert!(
        finding.contains("'arm'") && finding.contains("millimetres"),
        "{finding}"
    );
    assert!(refusal(&inertial("rpy=\"0 90 0\"", "1", "1")).contains("degrees"));
    assert!(refusal(&inertial("", "2e6", "1")).contains("mass 2000000 kg"));
    assert!(refusal(&inertial("", "1", "2000")).contains("kg m²"));
    let of_joint = |more: &str| {
        let turning = joint("turn", "revolute", "base", "arm", more);
        robot(&format!("<link name=\"base\"/>{}{turning}", link("arm")))
    };
    for (more, part) in [
        ("<dynamics damping=\"-0.1\"/>", "damping is -0.1"),
        ("<dynamics friction=\"-2\"/>", "friction is -2"),
        ("<limit lower=\"1\" upper=\"-1\"/>", "exchange"),
        ("<limit lower=\"-180\" upper=\"180\"/>", "degrees"),
        ("<origin xyz=\"0 0 425\"/>", "millimetres"),
        ("<origin rpy=\"0 0 -90\"/>", "degrees"),
    ] {
        let finding = refusal(&of_joint(more));
        assert!(
            finding.contains("'turn'") && finding.contains(part),
            "{finding}"
        );
    }
    for whole in ["<limit lower=\"-3\" upper=\"3\"/>", "<limit effort=\"1\"/>"] {
        assert!(RigidBodies::from_urdf(&of_joint(whole)).is_ok(), "{whole}");
    }
}

#[test]
fn xacro_that_was_not_expanded_is_refused_as_such() {
    let declared =
        "<robot name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'><xacro:arm/></robot>";
    for text in [
        declared,
        "<robot name='r'><xacro:property name='x' value='1'/></robot>",
    ] {
        let finding = refusal(text);
        assert!(
            finding.contains("<xacro:") && finding.contains("expand"),
            "{finding}"
        );
    }
    let expanded = chain(1).replace(
        "<robot ",
        "<robot xmlns:xacro='http://www.ros.org/wiki/xacro' ",
    );
    assert!(RigidBodies::from_urdf(&expanded).is_ok());
}

#[test]
fn an_element_with_very_many_attributes_is_refused_before_they_are_compared() {
    let attributes: String = (0..200_000).map(|k| format!(" a{k}='1'")).collect();
    assert!(refusal(&format!("<robot{attributes}/>")).contains("attributes"));
}

#[test]
fn links_without_mass_are_accepted_where_something_heavy_hangs_on_them() {
    let text = chain(3).replacen(
        &format!("<link name=\"l1\">{MASS}</link>"),
        "<link name=\"l1\"/>",
        1,
    );
    assert!(RigidBodies::from_urdf(&text).is_ok());
    let text = chain(3).replacen(
        &format!("<link name=\"l3\">{MASS}</link>"),
        "<link name=\"l3\"/>",
        1,
    );
    assert!(refusal(&text).contains("joint 'j2'"));
}

#[test]
fn every_refusal_says_what_to_do() {
    for text in [
        "",
        "<robot/>",
        &chain(13),
        &single(""),
        &chain(1).replace("0 0 1", "0 0 0"),
    ] {
        let message = refusal(text);
        let (_, remedy) = message.rsplit_once(": ").unwrap();
        assert!(remedy.split(' ').count() > 3, "{message}");
    }
}

#[test]
fn damaged_descriptions_never_panic() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(0);
    for name in rigid::EXAMPLES {
        let whole = rigid::example(name).unwrap();
        for _ in 0..150 {
            let mut bytes = whole.as_bytes().to_vec();
            for _ in 0..rng.random_range(1..4) {
                let at = rng.random_range(0..bytes.len());
                match rng.random_range(0..3) {
                    0 => bytes[at] = rng.random_range(32..127),
                    1 => bytes.truncate(at.max(1)),
                    _ => drop(bytes.drain(at..(at + 40).min(bytes.len()))),
                }
                if bytes.is_empty() {
                    bytes.push(b'<');
                }
            }
            if let Ok(robot) = RigidBodies::from_urdf(&String::from_utf8_lossy(&bytes)) {
                let n = robot.dof();
                let half = vec![0.5; n];
                assert!(Quantities::bias(&robot, &half, &half).is_ok());
            }
        }
    }
}

#[test]
fn changes_at_run_time_are_checked_too() {
    let arm = || RigidBodies::from_urdf(rigid::example("two_link_arm").unwrap()).unwrap();
    assert!(
        arm()
            .with_payload("claw", 1.0, [0.0; 3])
            .unwrap_err()
            .to_string()
            .contains("hand")
    );
    assert!(arm().with_payload("hand", f64::NAN, [0.0; 3]).is_err());
    assert!(arm().with_gravity([0.0, f64::INFINITY, 0.0]).is_err());
    assert!(arm().with_drives(vec![0.0; 3], vec![0.0; 2]).is_err());
    assert!(arm().with_springs(vec![f64::NAN; 2]).is_err());
    assert!(
        arm()
            .with_drives(vec![0.0; 2], vec![0.0, f64::NAN])
            .is_err()
    );
    assert!(arm().with_inertial_parameters(&[1.0; 19]).is_err());
}

#[test]
fn elements_of_another_namespace_are_not_those_of_urdf() {
    let foreign = "<g:inertial xmlns:g=\"urn:g\"><g:mass value=\"77\"/></g:inertial>";
    let text = single(&format!("{foreign}{MASS}"));
    let robot = RigidBodies::from_urdf(&text).unwrap();
    assert_eq!(
        robot.inertial_parameters(),
        RigidBodies::from_urdf(&single(MASS))
            .unwrap()
            .inertial_parameters()
    );
    let within = single(&MASS.replace("<mass", "<g:mass xmlns:g=\"urn:g\" value=\"9\"/><mass"));
    assert_eq!(
        RigidBodies::from_urdf(&within)
            .unwrap()
            .inertial_parameters(),
        robot.inertial_parameters()
    );
    // A namespace of the root element applies to the whole file.
    let whole = text.replacen("<robot", "<robot xmlns=\"http://www.ros.org\"", 1);
    assert_eq!(
        RigidBodies::from_urdf(&whole)
            .unwrap()
            .inertial_parameters(),
        robot.inertial_parameters()
    );
    let prefixed = text
        .replace("<robot", "<g:robot xmlns:g=\"urn:g\"")
        .replace("</robot", "</g:robot");
    assert!(
        refusal(&prefixed).contains("<g:robot>"),
        "{}",
        refusal(&prefixed)
    );
}

#[test]
fn names_that_cannot_be_seen_are_refused() {
    for name in ["a\u{202e}b", "a&#10;b", "\u{2066}"] {
        for text in [
            single(MASS).replace("\"turn\"", &format!("\"{name}\"")),
            robot(&link(name)),
        ] {
            assert!(
                refusal(&text).contains("cannot be seen"),
                "{}",
                refusal(&text)
            );
        }
    }
}
