//! `lagrangian formula`: laws of recordings and of saved models, and refusals.

use crate::workbench::Workbench;

const SIMULATED: &str =
    "simulate pendulum --trajectories 6 --duration 3 --noise 0.002 --out swing.csv";

#[test]
fn a_law_is_printed_from_recordings_and_from_the_model_that_a_plain_fit_keeps() {
    let bench = Workbench::new();
    bench.succeed(SIMULATED);
    let found = bench.run("formula swing.csv --json --quiet").json();
    let law = &found["law"];
    assert_eq!(law["verdict"], "law", "{law}");
    assert!(
        law["text"]
            .as_str()
            .is_some_and(|text| text.contains("cos(q1)")),
        "{law}"
    );
    let fitted = bench.run("fit swing.csv --out run --quiet --json").json();
    assert_eq!(fitted["family"], "formula");
    assert_eq!(fitted["law"]["verdict"], "law");
    let page = String::from_utf8(bench.read("run/report.html")).unwrap();
    assert!(page.contains("as far as these data tell"));
    let latex = bench.succeed("formula run --latex").stdout;
    assert!(latex.contains(r"\dot{q_{1}}^{2}"), "{latex}");
    bench.succeed("export run --c law-c");
}

#[test]
fn a_network_has_a_law_and_what_has_none_is_refused_in_words() {
    let bench = Workbench::new();
    bench.succeed(SIMULATED);
    bench.succeed("simulate pendulum --trajectories 8 --duration 4 --out exact.csv");
    bench.succeed("fit exact.csv --model lnn --steps 300 --out net --quiet");
    let found = bench.run("formula net --json --quiet").json();
    assert_eq!(found["distilled"]["family"], "lnn", "{found}");
    let text = found["law"]["text"].as_str().unwrap_or_default();
    assert!(text.contains("cos(q1)"), "{found}");
    bench.refuse("formula swing");
    let columns =
        |k: u32| (1..=9).map(move |i| (f64::from(k) * 0.05 + f64::from(i)).sin().to_string());
    let row = |k: u32| {
        format!(
            "{},{}",
            f64::from(k) * 0.02,
            columns(k).collect::<Vec<_>>().join(",")
        )
    };
    let rows: Vec<String> = (0..200).map(row).collect();
    let header: Vec<String> = (1..=9).map(|i| format!("q{i}")).collect();
    bench.write(
        "nine.csv",
        &format!("t,{}\n{}\n", header.join(","), rows.join("\n")),
    );
    let said = bench.refuse("formula nine.csv");
    assert!(said.contains("at most 8 coordinates"), "{said}");
}
