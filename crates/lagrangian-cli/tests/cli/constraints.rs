//! `lagrangian constraints`, and fits of points that rods join.

use crate::workbench::Workbench;

/// Writes `points.csv`: two marks of a double pendulum of rods of 1 m in a few films.
fn film(bench: &Workbench) {
    bench.succeed("simulate double-pendulum --trajectories 5 --duration 2 --step 0.02 --noise 0.001 --out swing.csv");
    let swing = String::from_utf8(bench.read("swing.csv")).unwrap();
    let row = |line: &str| {
        let values: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        let (x, y) = (values[2].sin(), -values[2].cos());
        let (to, down) = (x + values[3].sin(), y - values[3].cos());
        format!("{},{},{x},{y},{to},{down}", values[0], values[1])
    };
    let rows: Vec<String> = swing.lines().skip(1).map(row).collect();
    let table = format!("trajectory,t,x1,y1,x2,y2\n{}\n", rows.join("\n"));
    bench.write("points.csv", &table);
}

const COLUMNS: &str = "--q x1,y1,x2,y2";

#[test]
fn bodies_that_nothing_joins_are_fitted_with_the_forces_between_them() {
    let bench = Workbench::new();
    // Motions near circles keep relations of many products of places and velocities, none of which is a constraint.
    bench.succeed("simulate n-body --trajectories 10 --duration 5 --noise 0.001 --out bodies.csv");
    let fitted = bench.run("fit bodies.csv --out run --json");
    assert!(
        !fitted.stderr.contains("no Lagrangian"),
        "{}",
        fitted.stderr
    );
    let fitted = fitted.json();
    assert_eq!(fitted["family"], "cartesian");
    assert_eq!(fitted["law"]["verdict"], "law", "{fitted}");
    let law = fitted["law"]["text"].as_str().unwrap();
    assert!(law.contains("|(q3, q4) - (q5, q6)|^-1"), "{law}");
    let points = "--points q1:q2,q3:q4,q5:q6";
    let conserved = bench.succeed(&format!(
        "conserved run/model.safetensors bodies.csv {points}"
    ));
    let kept = |name: &str| {
        let mut lines = conserved.stdout.lines();
        let line = lines.find(|line| line.trim_start().starts_with(name));
        line.is_some_and(|line| line.contains(" conserved"))
    };
    assert!(
        kept("total momentum along x") && kept("angular momentum"),
        "{}",
        conserved.stdout
    );
    bench.succeed("export run/model.safetensors --c bodies");
}

#[test]
fn rods_are_named_and_a_plain_fit_keeps_them() {
    let bench = Workbench::new();
    film(&bench);
    let said = bench
        .succeed(&format!("constraints points.csv {COLUMNS}"))
        .stdout;
    assert!(said.contains("rod p1–p2, length 1.00"), "{said}");
    assert!(said.contains("2 degrees of freedom"), "{said}");
    let found = bench.run(&format!(
        "constraints points.csv {COLUMNS} --points x1:y1,x2:y2 --json"
    ));
    let found = &found.json()["structure"];
    assert_eq!(found["degrees_of_freedom"], 2);
    assert_eq!(found["constraints"][0]["kind"], "circle");
    let fitted = bench.run(&format!(
        "fit points.csv {COLUMNS} --out run --quiet --json"
    ));
    let fitted = fitted.json();
    assert_eq!(fitted["family"], "cartesian");
    assert_eq!(fitted["law"]["verdict"], "law", "{fitted}");
    let page = String::from_utf8(bench.read("run/report.html")).unwrap();
    assert!(page.contains("the rods that join them"));
    bench.succeed(
        "rollout run/model.safetensors --q0 1,0,1.6,-0.8 --qd0 0,0,0,0 --duration 3 --step 0.02 --out away.csv",
    );
    let away = String::from_utf8(bench.read("away.csv")).unwrap();
    let last: Vec<f64> = away
        .lines()
        .last()
        .unwrap()
        .split(',')
        .map(|x| x.parse().unwrap())
        .collect();
    let [x, y, to, down] = [last[1], last[2], last[3], last[4]];
    assert!(((to - x).hypot(down - y) - 1.0).abs() < 2e-3, "{last:?}");
}

#[test]
fn what_has_no_constraint_says_so_and_what_is_no_point_is_refused() {
    let bench = Workbench::new();
    bench.succeed("simulate kepler --trajectories 3 --duration 4 --out planet.csv");
    let said = bench.succeed("constraints planet.csv --q q1,q2").stdout;
    assert!(said.contains("no constraint was found"), "{said}");
    let said = bench.refuse("constraints planet.csv --points q1:z");
    assert!(said.contains('z'), "{said}");
    let said = bench.refuse("constraints planet.csv --points q1:q2,q2:q1");
    assert!(said.contains("no other point has"), "{said}");
    bench.succeed("simulate charged-particle --trajectories 3 --duration 4 --out charge.csv");
    let said = bench.refuse("fit charge.csv --model cartesian --out run");
    assert!(
        said.contains("no constraint between these coordinates was found")
            && said.contains("forces between points leave"),
        "{said}"
    );
}
