//! The action between two ends, and conserved quantities.

use crate::workbench::Workbench;

#[test]
fn the_action_of_an_oscillator_is_the_closed_form_and_its_kind_is_told() {
    let bench = Workbench::new();
    let line = "action mass-spring --from 1 --to 0.3 --json --time";
    let short = bench.succeed(&format!("{line} 1")).json();
    let path = &short["paths"][0];
    let (sin, cos) = 1.0_f64.sin_cos();
    let closed_form = ((1.0 + 0.09) * cos - 0.6) / (2.0 * sin);
    assert!((path["action"].as_f64().unwrap() - closed_form).abs() < 1e-5);
    assert_eq!(path["verdict"], "minimum");
    let told = bench.succeed("action mass-spring --from 1 --to 0.3 --time 1");
    let told = told.stdout;
    assert!(told.contains("\n1 stationary path from "), "{told}");
    let long = bench
        .succeed(&format!("{line} 4 --out path.csv --plot path.html"))
        .json();
    let second = &long["paths"][0]["second_variation"];
    assert_eq!(
        (&long["paths"][0]["verdict"], &second["morse_index"]),
        (&"saddle".into(), &1.into())
    );
    let conjugate = second["conjugate_times"][0].as_f64().unwrap();
    assert!(
        (conjugate - std::f64::consts::PI).abs() < 1e-3,
        "{conjugate}"
    );
    let names = bench.names(".");
    assert!(
        names.contains(&"path.csv".into()) && names.contains(&"path.html".into()),
        "{names:?}"
    );
}

#[test]
fn a_single_path_is_told_in_the_singular() {
    let found = Workbench::new().succeed("action mass-spring --from 1 --to 0.3 --time 1");
    assert!(
        found.stdout.contains("\n1 stationary path from"),
        "{}",
        found.stdout
    );
}

#[test]
fn ends_that_nothing_connects_are_an_outcome_with_a_reason() {
    let bench = Workbench::new();
    let line = "action relativistic-particle --set field=0 --from 0 --to 2 --time 1";
    let outcome = bench.run(&format!("{line} --json --out path.csv"));
    assert_eq!(outcome.code, 1, "{}", outcome.stderr);
    assert_eq!(outcome.json()["failure"], "undefined");
    assert!(outcome.stderr.contains("more time"), "{}", outcome.stderr);
    assert!(bench.names(".").is_empty());
    let conjugate = bench.run("action mass-spring --from 1 --to 0.3 --time 3.141592653589793");
    assert_eq!(conjugate.code, 1);
    assert!(
        conjugate.stderr.contains("conjugate"),
        "{}",
        conjugate.stderr
    );
}

#[test]
fn wrong_questions_of_the_action_are_refused_with_the_way_out() {
    let bench = Workbench::new();
    let cases = [
        ("action pendulm --from 0 --to 1 --time 1", "simulate list"),
        (
            "action nowhere.safetensors --from 0 --to 1 --time 1",
            "model.safetensors",
        ),
        (
            "action pendulum --from 0,1 --to 1 --time 1",
            "one value per coordinate",
        ),
        (
            "action pendulum --from 0 --to 1 --time 1 --turns 1,2",
            "--turns",
        ),
        (
            "action mass-spring --from 0 --to 1 --time 1 --turns 1",
            "not angles",
        ),
        (
            "action pendulum --from 0 --to 1 --time 1 --steps 7",
            "even number",
        ),
        (
            "action pendulum --from 0 --to 1 --time 1 --guesses 0",
            "from 1 to 1000",
        ),
        (
            "action pendulum --from 0 --to 1 --time 1 --plot path.pdf",
            ".html",
        ),
        (
            "action pendulum --from 0 --to 1 --time 1 --set lenght=2",
            "length",
        ),
    ];
    for (line, hint) in cases {
        let message = bench.refuse(line);
        assert!(message.contains(hint), "{line}: {message}");
    }
    let outcome = bench.run("action pendulum --from 0 --to nan --time -1");
    assert_eq!(outcome.code, 2);
    assert!(outcome.stderr.contains("'nan'"), "{}", outcome.stderr);
}

#[test]
fn a_planet_turns_and_a_recorded_one_too() {
    let bench = Workbench::new();
    let known = bench
        .succeed("conserved kepler --points q1:q2 --json")
        .json();
    let conserved = |figures: &serde_json::Value| -> Vec<String> {
        let quantities = figures["conserved"]["quantities"]
            .as_array()
            .unwrap()
            .clone();
        let symmetric = quantities.iter().filter(|q| q["symmetric"] == true);
        symmetric
            .map(|q| q["name"].as_str().unwrap().to_string())
            .collect()
    };
    assert_eq!(conserved(&known), ["energy", "angular momentum"]);
    assert_eq!(known["judgements"][0]["grade"], "good", "{known}");
    assert_eq!(
        known["conserved"]["generators"].as_array().unwrap().len(),
        1
    );
    bench.succeed("simulate cart-pole --trajectories 10 --duration 2 --out cart.csv");
    let cart = bench.succeed("conserved cart-pole cart.csv --json").json();
    assert_eq!(conserved(&cart), ["energy", "momentum of x"]);
    let text = bench
        .succeed("conserved charged-particle --points q1:q2")
        .stdout;
    assert!(text.contains("less F = +0.500 q2"), "{text}");
}

#[test]
fn what_is_conserved_has_a_page_with_verdicts() {
    let bench = Workbench::new();
    let text = bench
        .succeed("conserved kepler --points q1:q2 --plot kepler.html")
        .stdout;
    assert!(text.contains("  good"), "{text}");
    let page = String::from_utf8(bench.read("kepler.html")).unwrap();
    for part in [
        "Change of the energy",
        "Change of the angular momentum",
        "along rollouts of the model",
        "not conserved",
        "class=\"grade",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // The model does not promise a momentum that gravity changes.
    assert!(!page.contains("Change of the momentum"));
    let again = bench.refuse("conserved kepler --points q1:q2 --plot kepler.html");
    assert!(again.contains("--force"), "{again}");
    // Friction that the system does not include.
    bench
        .succeed("simulate pendulum --friction 0.3 --trajectories 4 --duration 3 --out damped.csv");
    let damped = bench.succeed("conserved pendulum damped.csv --json").json();
    let energy = &damped["judgements"][0];
    assert_eq!(energy["grade"], "poor", "{damped}");
    assert!(
        energy["why"]
            .as_str()
            .unwrap()
            .contains("along the motions")
    );
    assert!(damped["judgements"][1].is_null(), "{damped}");
}

#[test]
fn wrong_questions_of_what_is_conserved_are_refused_with_the_way_out() {
    let bench = Workbench::new();
    bench.succeed("simulate pendulum --trajectories 2 --duration 1 --out swing.csv");
    let cases = [
        ("conserved kepler --points q1:q3", "take one of q1, q2"),
        ("conserved kepler --points q1", "two or three Cartesian"),
        (
            "conserved kepler --points q1:q2,q2:q1",
            "share no coordinate",
        ),
        ("conserved double-pendulum --points q1:q2", "--points"),
        ("conserved kepler swing.csv", "--q"),
        ("conserved kepler nowhere.csv", "nowhere.csv"),
        ("conserved nowhere.safetensors", "model.safetensors"),
    ];
    for (line, hint) in cases {
        let message = bench.refuse(line);
        assert!(message.contains(hint), "{line}: {message}");
    }
}
