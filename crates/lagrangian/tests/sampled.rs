//! A log that is longer than the kept part: the samples that are drawn, the findings on the rest, and the memory that it takes.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(unsafe_code, reason = "an allocator that counts")]

use std::alloc::{GlobalAlloc, Layout as Memory, System};
use std::cell::Cell;
use std::f64::consts::{PI, TAU};
use std::io::{Cursor, Read};

use lagrangian::trajectory::{Readings, Sampling, csv, thin};
use lagrangian::{
    CheckOptions, Error, EstimateOptions, Format, Layout, Recording, Signals, Trajectory, Verdict,
    check,
};

/// Records the largest number of bytes that this thread has held.
struct Peak;

thread_local! {
    static HELD: Cell<(isize, isize)> = const { Cell::new((0, 0)) };
}

fn note(bytes: isize) {
    HELD.with(|held| {
        let (now, most) = held.get();
        held.set((now + bytes, most.max(now + bytes)));
    });
}

// SAFETY: passes every call on to the system's allocator.
unsafe impl GlobalAlloc for Peak {
    unsafe fn alloc(&self, layout: Memory) -> *mut u8 {
        note(layout.size().cast_signed());
        // SAFETY: as for the caller.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Memory) {
        note(-layout.size().cast_signed());
        // SAFETY: as for the caller.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Peak = Peak;

/// The largest number of bytes that `run` has held.
fn peak<X>(run: impl FnOnce() -> X) -> (isize, X) {
    HELD.with(|held| held.set((0, 0)));
    let result = run();
    (HELD.with(Cell::get).1, result)
}

const LIMIT: usize = 2000;
const STEP: f64 = 0.01;

fn sampling(rows: usize, seed: u64) -> Sampling {
    Sampling {
        rows,
        seed,
        stretch: Sampling::SHORT,
    }
}

fn sampled(rows: usize, seed: u64) -> Layout {
    Layout {
        sample: Some(sampling(rows, seed)),
        ..Layout::default()
    }
}

/// A pendulum-like motion under a force, `t,q1,tau1`.
fn rows(count: usize) -> String {
    let row = |k: usize| {
        let t = STEP * k as f64;
        format!("{t:.4},{:.9},{:.9}\n", t.sin(), (0.7 * t).cos())
    };
    let all: String = (0..count).map(row).collect();
    format!("t,q1,tau1\n{all}")
}

fn read(text: &str, name: &str, layout: &Layout) -> lagrangian::Result<Readings> {
    Format::Csv.read(Cursor::new(text.to_owned()), name, layout)
}

fn one(text: &str, layout: &Layout) -> Recording {
    read(text, "log", layout).unwrap().recordings.remove(0)
}

#[test]
fn a_log_within_the_limit_is_kept_whole() {
    let text = rows(LIMIT);
    let (plain, drawn) = (
        one(&text, &Layout::default()),
        one(&text, &sampled(LIMIT, 0)),
    );
    assert!(drawn.part().is_none());
    assert_eq!(
        (&plain.t, &plain.q, &plain.tau),
        (&drawn.t, &drawn.q, &drawn.tau)
    );
}

#[test]
fn of_a_longer_log_whole_stretches_are_kept_and_never_more_rows_than_asked_for() {
    let log = one(&rows(30_000), &sampled(LIMIT, 3));
    // Velocities are estimated, so that stretches are as long as eight of them allow.
    let stretch = LIMIT / 8;
    assert!(
        log.len() <= LIMIT && log.len() > LIMIT - stretch,
        "{}",
        log.len()
    );
    assert_eq!(log.part().unwrap().rows, 30_000);
    for (t, q) in log.t.iter().zip(&log.q) {
        assert!((q - t.sin()).abs() < 1e-8);
    }
    let cuts = log
        .t
        .windows(2)
        .filter(|w| w[1] - w[0] > 1.5 * STEP)
        .count();
    assert!(cuts > 3 && cuts < 8, "{cuts} cuts");
}

#[test]
fn the_sample_depends_on_the_seed_alone_whatever_the_format() {
    let truth = Trajectory::new(
        "log",
        (0..20_000).map(|k| STEP * f64::from(k)).collect(),
        Signals {
            q: (0..20_000).map(|k| (STEP * f64::from(k)).sin()).collect(),
            qd: (0..20_000).map(|k| (STEP * f64::from(k)).cos()).collect(),
            ..Signals::default()
        },
    );
    let drawn = |format: Format, seed: u64| {
        let mut file = Cursor::new(Vec::new());
        format
            .write(&mut file, std::slice::from_ref(&truth))
            .unwrap();
        file.set_position(0);
        format.read(file, "log", &sampled(LIMIT, seed)).unwrap()
    };
    let first = drawn(Format::Csv, 1);
    assert_eq!(first.recordings, drawn(Format::Csv, 1).recordings);
    assert_eq!(first.recordings, drawn(Format::Npz, 1).recordings);
    assert_ne!(first.recordings[0].t, drawn(Format::Csv, 2).recordings[0].t);
}

#[test]
fn every_part_of_a_log_is_drawn_as_often() {
    let text = rows(20_000);
    let mut tenths = [0_u32; 10];
    for seed in 0..60 {
        for t in one(&text, &sampled(1000, seed)).t {
            tenths[((t / STEP) as usize / 2000).min(9)] += 1;
        }
    }
    let mean = f64::from(tenths.iter().sum::<u32>()) / 10.0;
    // Some 480 stretches in all, 48 a tenth: four standard deviations of their number.
    for count in tenths {
        assert!(
            (f64::from(count) / mean - 1.0).abs() < 4.0 / 48_f64.sqrt(),
            "{tenths:?}"
        );
    }
}

#[test]
fn a_value_that_is_no_number_is_refused_with_its_row_wherever_it_stands() {
    for (row, wrong, finding) in [
        (12_345, "nan,1,1", "the value is NaN"),
        (7_001, "70.0,,1", "the value is NaN"),
        (19_999, "0.5,1,1", "time goes back"),
    ] {
        let mut lines: Vec<String> = rows(20_000).lines().map(str::to_owned).collect();
        lines[row] = wrong.into();
        for seed in 0..3 {
            let log = one(&lines.join("\n"), &sampled(LIMIT, seed));
            let error = log.validate().unwrap_err();
            assert!(
                matches!(error, Error::Sample { row: found, .. } if found == row),
                "{error}"
            );
            assert!(error.to_string().contains(finding), "{error}");
            let report = check(&[log], &CheckOptions::default());
            let item = report.items.iter().find(|i| i.name == "sample").unwrap();
            assert_eq!(item.verdict, Verdict::Fail);
        }
    }
    let text = rows(20_000).replace("150.0100,", "150.0100x,");
    let error = read(&text, "log", &sampled(LIMIT, 0)).unwrap_err();
    assert!(matches!(error, Error::Cell { line: 15_003, .. }), "{error}");
}

#[test]
fn a_parameter_that_changes_in_a_row_that_was_passed_over_is_refused() {
    let mass = |k: usize| if k < 15_000 { 1.0 } else { 2.0 };
    let all: String = (0..20_000)
        .map(|k| format!("{},{},{}\n", STEP * k as f64, k % 7, mass(k)))
        .collect();
    let layout = Layout {
        parameters: vec!["m".into()],
        ..sampled(LIMIT, 0)
    };
    let error = one(&format!("t,q1,m\n{all}"), &layout)
        .validate()
        .unwrap_err();
    assert!(
        matches!(&error, Error::Sample { row: 15_001, column, .. } if column == "m"),
        "{error}"
    );
}

#[test]
fn a_wrapped_angle_is_unwrapped_through_the_rows_that_are_passed_over() {
    let truth = |k: usize| 0.3 * k as f64;
    let wrapped = |k: usize| (truth(k) + PI).rem_euclid(TAU) - PI;
    let all: String = (0..20_000)
        .map(|k| format!("{k},{}\n", wrapped(k)))
        .collect();
    let text = format!("t,q1\n{all}");
    for every in [1, 3] {
        let layout = Layout {
            angles: vec!["all".into()],
            every,
            ..sampled(1000, 5)
        };
        let log = one(&text, &layout);
        for (t, q) in log.t.iter().zip(&log.q) {
            assert!((q - 0.3 * t).abs() < 1e-9, "every {every}: {q} at {t}");
        }
    }
}

#[test]
fn files_are_thinned_together_as_the_trajectories_of_one_file() {
    let (short, long) = (rows(3_000), rows(17_000));
    let sampling = sampling(LIMIT, 9);
    let layout = sampled(LIMIT, 9);
    let mut apart = Vec::new();
    for (name, text) in [("a", &short), ("b", &long)] {
        apart.extend(read(text, name, &layout).unwrap().recordings);
        thin(&mut apart, &sampling);
    }
    let of = |name: &str, text: &str| -> String {
        let body = text.lines().skip(1);
        body.map(|line| format!("{name},{line}\n")).collect()
    };
    let both = format!(
        "trajectory,t,q1,tau1\n{}{}",
        of("a", &short),
        of("b", &long)
    );
    let mut together = read(&both, "file", &layout).unwrap().recordings;
    thin(&mut together, &sampling);
    let times = |all: &[Recording]| -> Vec<Vec<f64>> { all.iter().map(|r| r.t.clone()).collect() };
    assert!(apart.iter().map(Recording::len).sum::<usize>() <= LIMIT);
    assert!(times(&apart) == times(&together));
}

#[test]
fn pieces_become_trajectories_whose_estimates_are_as_good_as_they_say() {
    let text = rows(40_000);
    let options = EstimateOptions::default();
    let (pieces, estimates) = one(&text, &sampled(8_000, 0))
        .into_trajectories(&options)
        .unwrap();
    assert!(pieces.len() > 6);
    assert_eq!(estimates.len(), 2);
    // The ends of the log itself are kept, with the accuracy of a window on one side alone.
    let inside = |t: f64| (1.0..STEP * 39_900.0).contains(&t);
    let worst = |motion: &Trajectory| -> f64 {
        let pairs = motion.t.iter().zip(&motion.qdd);
        let errors = pairs.filter(|(t, _)| inside(**t));
        errors.fold(0.0, |most, (t, a)| most.max((a + t.sin()).abs()))
    };
    for piece in &pieces {
        let together = piece.t.windows(2).all(|w| w[1] - w[0] < 1.5 * STEP);
        assert!(together, "{}", piece.name);
    }
    let worst = pieces.iter().map(worst).fold(0.0, f64::max);
    // The largest of thousands of errors lies near four standard deviations.
    let claimed = estimates[1].standard_error;
    assert!(
        worst < 6.0 * claimed && claimed < 1e-3,
        "{worst:.1e}, said {claimed:.1e} m/s²"
    );
}

#[test]
fn no_force_is_shifted_across_a_cut() {
    let log = one(&rows(30_000), &sampled(LIMIT, 3))
        .delayed(&[0.055])
        .unwrap();
    let tau = &log.tau;
    assert!(log.len() > LIMIT * 3 / 4);
    for (t, tau) in log.t.iter().zip(tau) {
        assert!((tau - (0.7 * (t - 0.055)).cos()).abs() < 1e-4, "at {t}");
    }
    let (pieces, _) = log.into_trajectories(&EstimateOptions::default()).unwrap();
    assert!(
        pieces
            .iter()
            .all(|p| p.t.windows(2).all(|w| w[1] - w[0] < 1.5 * STEP))
    );
}

#[test]
fn a_sample_is_no_log_with_gaps_but_a_gap_in_it_is_found() {
    let with_gap = |gap: f64| -> Item {
        let row = |k: usize| {
            let t = STEP * k as f64 + if k > 11_111 { gap } else { 0.0 };
            format!("{t:.4},{:.9}\n", t.sin())
        };
        let all: String = (0..30_000).map(row).collect();
        let report = check(
            &[one(&format!("t,q1\n{all}"), &sampled(LIMIT, 0))],
            &CheckOptions::default(),
        );
        assert!(report.items.iter().all(|i| i.name != "jumps"));
        let gaps = report.items.iter().find(|i| i.name == "gaps");
        gaps.map(|i| (i.verdict, i.values["longest_s"])).unwrap()
    };
    type Item = (Verdict, f64);
    assert_eq!(with_gap(0.0), (Verdict::Pass, 0.0));
    let (verdict, longest) = with_gap(2.0);
    assert!(verdict == Verdict::Warn && (longest - 2.01).abs() < 1e-3);
}

/// Lines that are generated while they are read.
struct Endless {
    row: usize,
    last: usize,
    line: Cursor<Vec<u8>>,
}

impl Read for Endless {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.line.read(buffer)?;
        if count > 0 || self.row == self.last {
            return Ok(count);
        }
        let t = STEP * self.row as f64;
        self.line = Cursor::new(format!("{t:.4},{:.6},0.5\n", t.sin()).into_bytes());
        self.row += 1;
        self.line.read(buffer)
    }
}

#[test]
fn memory_is_bounded_by_the_rows_that_are_kept_not_by_the_log() {
    let log = |last: usize| Endless {
        row: 0,
        last,
        line: Cursor::new(b"t,q1,tau1\n".to_vec()),
    };
    let bytes = |last: usize| {
        let (most, readings) = peak(|| csv::read(log(last), "log", &sampled(10_000, 0)).unwrap());
        assert!(readings.recordings[0].len() <= 10_000);
        most
    };
    let (short, long) = (bytes(40_000), bytes(400_000));
    // Three numbers a row, a quarter more rows while reading, vectors that double, and the reader's buffers.
    assert!(long < 2 * 10_000 * 3 * 8 + 300_000, "{long} bytes");
    assert!(long < short + short / 4, "{short} and {long} bytes");
}
