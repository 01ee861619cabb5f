//! Names and files that would write elsewhere, run without end, or pass unseen.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use lagrangian::text::is_hidden;

use crate::workbench::{Outcome, Workbench, swing};

/// Names with a special meaning in some system, alone and within others.
fn names() -> Vec<String> {
    let parts = [
        "../",
        "..\\",
        "/",
        "\\",
        "/etc/",
        "C:\\",
        "x/../../../EVIL",
        "..",
        ".",
        "~",
        "-rf",
        "CON",
        "nul.txt",
        "LPT1",
        "com1.csv",
        "\u{1b}[2J",
        "\u{1b}]0;title\u{7}",
        "\u{9b}31m",
        "\u{202e}",
        "\u{2066}",
        "\u{2069}",
        "\u{200f}",
        "\u{feff}",
        "\u{2028}",
        "\u{8}\u{8}",
        "\u{7f}",
        "\u{85}",
        "\n",
        "\nverdict: good\n",
        "\t",
        "\u{fffe}",
        "\"",
        "'",
        "`",
        "\"'><",
        "*/",
        "/*",
        "*/ #error",
        "??/",
        "??/\n",
        "\\\n",
        "</script>",
        "</style>",
        "<!--",
        "-->",
        "]]>",
        "<![CDATA[",
        "&amp;",
        "&#0;",
        "<svg onload=x>",
        "%s%n",
        "{}",
        "{0}",
        "${HOME}",
        "$(id)",
        ";",
        "|",
        "&&",
        "#",
        "//",
        "q\u{301}",
        "θ",
        "🙂",
        "(m/s)",
        "= 1",
        "@x",
        "+1",
    ];
    let long = "w".repeat(5000);
    let alone = parts.iter().map(ToString::to_string);
    let within = parts.iter().map(|part| format!("a{part}b"));
    let twice = parts.iter().map(|part| format!("{part}{part}joint"));
    let last = parts.iter().map(|part| format!("joint_{part}"));
    let mixed = parts
        .iter()
        .zip(parts.iter().rev())
        .map(|(a, b)| format!("{a}k{b}k{a}"));
    let all = alone
        .chain(within)
        .chain(twice)
        .chain(last)
        .chain(mixed)
        .chain([long]);
    let mut known = std::collections::BTreeSet::new();
    let names = all.map(|name| name.trim().to_string());
    names
        .filter(|name| !name.is_empty() && known.insert(name.clone()))
        .collect()
}

/// A CSV file of motions with these coordinates, and the layout that names them, beside it.
fn write_motion(bench: &Workbench, file: &str, names: &[String]) {
    let quoted = |name: &String| format!("\"{}\"", name.replace('"', "\"\""));
    let mut text = format!(
        "t,{}\n",
        names.iter().map(quoted).collect::<Vec<_>>().join(",")
    );
    for row in 0..80 {
        let t = 0.05 * f64::from(row);
        let cells =
            (1..=names.len()).map(|k| ((1.0 + 0.07 * k as f64) * t + k as f64).sin().to_string());
        text += &format!("{t},{}\n", cells.collect::<Vec<_>>().join(","));
    }
    bench.write(&format!("{file}.csv"), &text);
    let q: Vec<String> = names
        .iter()
        .map(|name| serde_json::to_string(name).unwrap())
        .collect();
    // TOML has the escapes of JSON, and more characters that need one.
    let q = q.join(",").replace('\u{7f}', "\\u007f");
    bench.write(&format!("{file}.toml"), &format!("[columns]\nq = [{q}]\n"));
}

/// Checks that a text is safe on a terminal.
fn assert_plain(what: &str, outcome: &Outcome) {
    for text in [&outcome.stdout, &outcome.stderr] {
        let bad = text
            .char_indices()
            .find(|(_, c)| is_hidden(*c) && *c != '\n');
        let around = |at: usize| {
            text.chars()
                .skip(at.saturating_sub(40))
                .take(80)
                .collect::<String>()
        };
        assert!(
            bad.is_none(),
            "{what}: {:?} in {:?}",
            bad,
            bad.map(|(at, _)| around(at))
        );
        assert!(
            !text
                .lines()
                .any(|line| line == "verdict: good" && what == "check"),
            "{what}: {text}"
        );
        assert!(!text.contains("panicked"), "{what}: {text}");
    }
}

/// Files below a folder, except for those in `own`.
fn strangers(folder: &Path, own: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path == own {
            continue;
        }
        match path.is_dir() && own.starts_with(&path) {
            true => found.extend(strangers(&path, own)),
            false => found.push(path.display().to_string()),
        }
    }
    found
}

fn assert_pages(page: &str) {
    let bad = page.chars().find(|c| is_hidden(*c) && !"\n\t".contains(*c));
    assert_eq!(bad, None, "a page");
    assert!(!page.contains("<svg onload") && !page.contains("a</script>b"));
    assert_eq!(
        page.matches("<script").count(),
        page.matches("</script>").count()
    );
}

/// Compiles the files of an export without warnings, where there is a C compiler.
fn assert_compiles(folder: &Path) {
    let sources = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    let sources = sources.filter(|path| path.extension().is_some_and(|e| e == "c"));
    let mut cc = Command::new("gcc");
    cc.args([
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-Wbidi-chars=any",
        "-fsyntax-only",
    ]);
    match cc.args(sources).output() {
        Ok(output) => assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        ),
        Err(_) => eprintln!("skipped: there is no gcc"),
    }
}

#[test]
fn names_of_columns_write_nothing_outside_and_reach_no_terminal_page_or_compiler() {
    let names = names();
    assert!(names.len() >= 300, "{}", names.len());
    let outer = Workbench::new();
    fs::create_dir_all(outer.path("a/b/c/d")).unwrap();
    let bench = outer.within("a/b/c/d");
    for (k, names) in names.chunks(names.len().div_ceil(8)).enumerate() {
        let file = format!("d{k}");
        write_motion(&bench, &file, names);
        assert_plain("check", &bench.run(&format!("check {file}.csv")));
        if k % 4 != 0 {
            continue;
        }
        let line =
            format!("fit {file}.csv --model mlp --optimizer adam --width 4 --steps 2 --out r{k}");
        assert_plain("fit", &bench.run(&line));
        let model = format!("r{k}/model.safetensors");
        assert!(bench.path(&model).is_file(), "{names:?}");
        assert_pages(&String::from_utf8(bench.read(&format!("r{k}/report.html"))).unwrap());
        let json = bench.run(&format!("score {model} {file}.csv --json"));
        assert_plain("score", &json);
        assert!(json.json()["verdict"].is_string());
        assert_plain(
            "export",
            &bench.succeed(&format!("export {model} --c c{k} --name m")),
        );
        assert_compiles(&bench.path(&format!("c{k}")));
    }
    let few: Vec<String> = names
        .iter()
        .filter(|name| name.contains("EVIL"))
        .take(3)
        .cloned()
        .collect();
    write_motion(&bench, "few", &few);
    assert_plain(
        "fit",
        &bench.run("fit few.csv --model mlp --width 4 --steps 2 --out few"),
    );
    assert_plain("report", &bench.succeed("report few --pictures pictures"));
    let pictures = bench
        .names("pictures")
        .into_iter()
        .filter(|name| name.ends_with(".svg"));
    let pictures: Vec<String> = pictures.collect();
    assert!(
        pictures.iter().any(|name| name.contains("EVIL")),
        "{pictures:?}"
    );
    for name in pictures {
        let text = String::from_utf8(bench.read(&format!("pictures/{name}"))).unwrap();
        roxmltree::Document::parse(&text).unwrap();
    }
    assert_eq!(strangers(&outer.path(""), &bench.path("")), [""; 0]);
    assert!(!Path::new("/etc/joint").exists());
}

/// A chain of links that turn about x, with joints of these names.
fn chain(joints: &[String]) -> String {
    let quoted = |name: &str| {
        let name = name
            .replace('&', "&amp;")
            .replace('<', "&lt;")
            .replace('"', "&quot;");
        name.replace('\n', "&#10;").replace('\t', "&#9;")
    };
    let link = |k: usize| {
        format!(
            "<link name=\"l{k}\"><inertial><origin xyz=\"0 0 -0.1\"/><mass value=\"1\"/><inertia ixx=\"0.02\" iyy=\"0.02\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"
        )
    };
    let joint = |(k, name): (usize, &String)| {
        let child = k + 1;
        format!(
            "<joint name=\"{}\" type=\"continuous\"><origin xyz=\"0 0 -0.2\"/><parent link=\"l{k}\"/><child link=\"l{child}\"/><axis xyz=\"1 0 0\"/></joint>",
            quoted(name)
        )
    };
    let links: String = (0..=joints.len()).map(link).collect();
    let joints: String = joints.iter().enumerate().map(joint).collect();
    format!("<robot name=\"r\">{links}{joints}</robot>")
}

#[test]
fn names_of_joints_are_shown_as_they_are_or_refused() {
    // XML has no other control characters.
    let is_text = |name: &String| {
        !name
            .chars()
            .any(|c| c.is_control() && !"\n\t".contains(c) || c == '\u{fffe}')
    };
    let names: Vec<String> = names().into_iter().filter(is_text).collect();
    let (hidden, seen): (Vec<String>, Vec<String>) =
        names.into_iter().partition(|name| name.contains(is_hidden));
    let outer = Workbench::new();
    fs::create_dir_all(outer.path("a/b/c/d")).unwrap();
    let bench = outer.within("a/b/c/d");
    for name in hidden.iter().step_by(9) {
        bench.write("hidden.urdf", &chain(std::slice::from_ref(name)));
        let refused = bench
            .run("excite hidden.urdf --lower -1 --upper 1 --velocity 1 --effort 9 --out x.csv");
        assert_eq!(refused.code, 2, "{name:?}: {}", refused.stderr);
        assert!(
            refused.stderr.contains("cannot be seen"),
            "{}",
            refused.stderr
        );
        assert_plain("excite", &refused);
    }
    for names in seen.chunks(2).step_by(40) {
        bench.write("seen.urdf", &chain(names));
        let line = "excite seen.urdf --lower -1 --upper 1 --velocity 1 --effort 9 --duration 2 --seconds 0.1 --force --out s.csv";
        assert_plain("excite", &bench.succeed(line));
    }
    assert_eq!(strangers(&outer.path(""), &bench.path("")), [""; 0]);
}

#[test]
fn two_pictures_never_have_one_name() {
    let bench = Workbench::new();
    let names = ["a/b", "a\\b", "A b"].map(String::from);
    write_motion(&bench, "d", &names);
    bench.run("fit d.csv --model mlp --width 4 --steps 2 --out r");
    bench.succeed("report r --pictures p");
    let pictures = bench
        .names("p")
        .into_iter()
        .filter(|name| name.ends_with(".svg"));
    let page = String::from_utf8(bench.read("r/report.html")).unwrap();
    assert_eq!(pictures.count(), page.matches("id=\"figure-").count());
}

#[cfg(target_os = "linux")]
#[test]
fn a_closed_or_full_standard_output_is_an_error_of_every_command_that_prints() {
    let bench = Workbench::new();
    bench.write("a.csv", &swing());
    bench.run("fit a.csv --model lnn --width 4 --steps 2 --out r --quiet");
    for line in [
        "check a.csv",
        "score r/model.safetensors a.csv",
        "score r/model.safetensors a.csv --json",
        "fit a.csv --model lnn --width 4 --steps 2 --out r2 --force --json",
        "rollout r/model.safetensors --q0 1 --qd0 0 --duration 1",
        "export r --c c --force",
        "--help",
        "fit --help",
        "--version",
    ] {
        let shell = format!("exec \"$0\" {line}");
        let command = |end: &str| {
            let mut command = Command::new("sh");
            let program = bench.command("").get_program().to_owned();
            command.args(["-c", &format!("{shell} {end}")]).arg(program);
            Outcome::of(
                command
                    .current_dir(bench.path(""))
                    .stdin(Stdio::null())
                    .output()
                    .unwrap(),
            )
        };
        for end in [">&-", "> /dev/full"] {
            let outcome = command(end);
            assert!(
                outcome.code == 1 || outcome.code == 2,
                "{line} {end}: {} {}",
                outcome.code,
                outcome.stderr
            );
            assert!(
                outcome.stderr.contains("standard output"),
                "{line} {end}: {}",
                outcome.stderr
            );
        }
        let lost = command("> /dev/null").stderr;
        assert!(!lost.contains("standard output"), "{line}: {lost}");
    }
}

#[cfg(unix)]
#[test]
fn a_layout_that_cannot_be_read_is_not_passed_over() {
    for name in ["a.toml", "lagrangian.toml"] {
        let bench = Workbench::new();
        bench.write("a.csv", &swing());
        fs::create_dir(bench.path(name)).unwrap();
        assert!(bench.refuse("check a.csv").contains("it is a folder"));
        fs::remove_dir(bench.path(name)).unwrap();
        assert!(
            Command::new("mkfifo")
                .arg(bench.path(name))
                .status()
                .unwrap()
                .success()
        );
        assert!(bench.refuse("fit a.csv --out r").contains("it is a pipe"));
        fs::remove_file(bench.path(name)).unwrap();
        std::os::unix::fs::symlink("nowhere", bench.path(name)).unwrap();
        assert!(bench.refuse("check a.csv").contains(name));
    }
}

#[test]
fn time_in_nanoseconds_is_said_so_and_takes_no_longer() {
    let bench = Workbench::new();
    let rows: String = (0..300_i64)
        .map(|k| format!("{},{}\n", k * 10_000_000, (0.01 * k as f64).sin()))
        .collect();
    bench.write("a.csv", &format!("t,q1\n{rows}"));
    let check = bench.run("check a.csv");
    assert!(
        check.stdout.contains("it looks like nanoseconds"),
        "{}",
        check.stdout
    );
    assert!(check.stdout.contains("by 1e9"), "{}", check.stdout);
    // An earlier version made three billion predictions of a second each.
    let fit = bench.run("fit a.csv --model lnn --width 4 --steps 2 --out r");
    assert!(!fit.stderr.contains("its time is up"), "{}", fit.stderr);
    assert!(bench.path("r/report.html").is_file());
}

#[test]
fn an_angle_of_1e308_is_never_good_or_fair() {
    let bench = Workbench::new();
    bench.write("a.csv", &swing());
    bench.succeed("fit a.csv --model lnn --width 8 --steps 30 --out r --quiet");
    let text = swing();
    for (k, line) in text
        .lines()
        .enumerate()
        .filter(|(k, _)| [1, 2, 60, 150, 200].contains(k))
    {
        let mut cells: Vec<&str> = line.split(',').collect();
        cells[1] = "1e308";
        bench.write(
            "b.csv",
            &text.replace(&format!("{line}\n"), &format!("{}\n", cells.join(","))),
        );
        let score = bench.run("score r/model.safetensors b.csv --json");
        if score.code != 2 {
            assert_eq!(score.json()["verdict"], "poor", "row {k}");
            assert!(
                score.stdout.contains("not finite"),
                "row {k}: {}",
                score.stdout
            );
        }
    }
}

#[test]
fn a_number_of_joints_is_whole_and_above_zero() {
    let bench = Workbench::new();
    for joints in ["-1", "1.5", "-0", "1e3", "99999999999999999999999"] {
        let line =
            format!("excite --joints={joints} --lower -1 --upper 1 --velocity 1 --out x.csv");
        assert!(bench.refuse(&line).contains("--joints"), "{joints}");
    }
}
