//! Generated C, compiled with a program that calls it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use lagrangian_export::{Call, Code, Interface, Shape};

/// A compiler with its flags.
#[derive(Debug, Clone)]
pub(crate) struct Compiler {
    pub(crate) program: &'static str,
    pub(crate) flags: Vec<&'static str>,
    /// The emulator of its programs; empty for this machine.
    pub(crate) emulator: &'static str,
    /// Whether numbers are `float`.
    pub(crate) single: bool,
}

/// The flags of every compiler.
const STRICT: [&str; 7] = [
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Werror",
    "-Wconversion",
    "-Wshadow",
];

impl Compiler {
    /// The compilers to test.
    ///
    /// Sanitizers take long to compile: without `all` they test two models.
    pub(crate) fn all(all: bool, model: &str) -> Vec<Self> {
        let native = |program, flags: &[&'static str]| Self {
            program,
            flags: flags.to_vec(),
            emulator: "",
            single: false,
        };
        let sanitized = [
            "-O1",
            "-g",
            "-fsanitize=address,undefined",
            "-fno-sanitize-recover=all",
        ];
        let own: &[&str] = if ["delan", "arm"].contains(&model) {
            &sanitized
        } else {
            &["-O1"]
        };
        let mut compilers = vec![native("cc", own)];
        let single = Self {
            single: true,
            ..native("cc", &["-O2", "-DSINGLE"])
        };
        if !all {
            return compilers;
        }
        compilers.push(single);
        for program in ["gcc", "clang"]
            .into_iter()
            .filter(|program| is_installed(program))
        {
            for level in ["-O0", "-O1", "-O2", "-O3"] {
                compilers.push(native(program, &[level]));
            }
            compilers.push(native(program, &sanitized));
        }
        if is_installed("arm-linux-gnueabihf-gcc") && is_installed("qemu-arm") {
            compilers.push(Self {
                emulator: "qemu-arm",
                ..native("arm-linux-gnueabihf-gcc", &["-O2", "-static"])
            });
        }
        compilers
    }
}

fn is_installed(program: &str) -> bool {
    let version = Command::new(program)
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    version.is_ok_and(|status| status.success())
}

/// The stack of each function, bytes, as reported by the compiler.
pub(crate) fn frames(folder: &Path, interface: &Interface, code: &Code) -> Vec<(String, usize)> {
    for file in [&code.header, &code.source] {
        fs::write(folder.join(&file.name), &file.text).unwrap();
    }
    let mut command = Command::new("cc");
    command
        .current_dir(folder)
        .args(["-std=c99", "-O1", "-fstack-usage", "-c", &code.source.name]);
    assert!(command.status().unwrap().success());
    let usage = fs::read_to_string(folder.join(format!("{}.su", interface.name))).unwrap();
    let line = |line: &str| {
        let mut fields = line.split('\t');
        let function = fields.next()?.rsplit(':').next()?.to_string();
        Some((function, fields.next()?.parse().ok()?))
    };
    usage.lines().filter_map(line).collect()
}

/// The result of a call for a state: its status and its numbers.
pub(crate) type Said = (Call, (i32, Vec<f64>));

/// A program that evaluates a model.
pub(crate) struct Built {
    program: PathBuf,
    emulator: &'static str,
    compiler: Compiler,
}

impl Built {
    /// The compiler and its flags.
    pub(crate) fn about(&self) -> String {
        format!(
            "{} {}",
            self.compiler.program,
            self.compiler.flags.join(" ")
        )
    }

    pub(crate) fn new(
        folder: &Path,
        interface: &Interface,
        code: &Code,
        compiler: &Compiler,
    ) -> Self {
        let name = &interface.name;
        for file in [&code.header, &code.source] {
            fs::write(folder.join(&file.name), &file.text).unwrap();
        }
        fs::write(folder.join("ask.c"), ask(interface)).unwrap();
        let program = folder.join(format!("{name}{}", compiler.flags.concat()));
        let mut command = Command::new(compiler.program);
        command
            .current_dir(folder)
            .args(STRICT)
            .args(&compiler.flags);
        if compiler.single {
            command.arg(format!("-D{name}_FLOAT"));
        }
        let output = command
            .args(["ask.c", &code.source.name, "-lm", "-o"])
            .arg(&program)
            .output()
            .unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.success(),
            "{name} by {compiler:?}: {}",
            errors.chars().take(3000).collect::<String>()
        );
        Self {
            program,
            emulator: compiler.emulator,
            compiler: compiler.clone(),
        }
    }

    fn command(&self) -> Command {
        if self.emulator.is_empty() {
            return Command::new(&self.program);
        }
        let mut command = Command::new(self.emulator);
        command.arg(&self.program);
        command
    }

    /// The output of the self test.
    pub(crate) fn selftest(&self) -> String {
        let output = self.command().arg("selftest").output().unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        String::from_utf8(output.stdout).unwrap()
    }

    /// The status and the numbers of every call at each of these states.
    pub(crate) fn run(&self, interface: &Interface, states: &[f64]) -> Vec<Vec<Said>> {
        let input = self.program.with_extension("states");
        let bytes: Vec<u8> = states.iter().flat_map(|x| x.to_le_bytes()).collect();
        fs::write(&input, bytes).unwrap();
        let file = fs::File::open(&input).unwrap();
        let output = self.command().stdin(file).output().unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let (numbers, _) = output.stdout.as_chunks::<8>();
        let mut numbers = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes));
        let mut next = move || numbers.next().unwrap();
        let n = interface.joints.len();
        let state = |_| {
            let of = |call: Call| {
                let status = next() as i32;
                let numbers = (0..count(call, n)).map(|_| next()).collect();
                (call, (status, numbers))
            };
            calls(interface).map(of).collect()
        };
        (0..states.len() / (4 * n)).map(state).collect()
    }
}

fn calls(interface: &Interface) -> impl Iterator<Item = Call> {
    Call::ALL
        .into_iter()
        .filter(|call| interface.calls.contains(call))
}

fn count(call: Call, n: usize) -> usize {
    let size = |shape| match shape {
        Shape::Scalar => 1,
        Shape::Vector(_) => n,
        Shape::Matrix(..) => n * n,
    };
    call.results().iter().map(|result| size(result.shape)).sum()
}

/// A program that writes the results of every call for the states that it reads.
fn ask(interface: &Interface) -> String {
    let (name, n) = (&interface.name, interface.joints.len());
    let mut body = String::new();
    for call in calls(interface) {
        let arguments = call.arguments().iter().map(|argument| match argument.name {
            "h" => "(NAME_real)0.01".replace("NAME", name),
            "leash" => "(NAME_real)0.1".replace("NAME", name),
            // Any numbers are a desired position.
            "q_d" => "tau".into(),
            "qd_d" => "qd".into(),
            "qdd_d" => "qdd".into(),
            other => other.to_string(),
        });
        let mut at = 0;
        let results: Vec<String> = call
            .results()
            .iter()
            .map(|result| {
                let text = format!("x + {at}");
                at += match result.shape {
                    Shape::Scalar => 1,
                    Shape::Vector(_) => n,
                    Shape::Matrix(..) => n * n,
                };
                text
            })
            .collect();
        let all: Vec<String> = arguments.chain(results).collect();
        body += &format!(
            "    put({name}_{}({}), x, {at});\n",
            call.name(),
            all.join(", ")
        );
    }
    format!(
        "#include \"{name}.h\"\n#include <stdio.h>\n#include <string.h>\n\n\
         static void put(int status, const {name}_real *x, int count) {{\n\
         \x20 double number = status;\n  fwrite(&number, 8, 1, stdout);\n\
         \x20 for (int i = 0; i < count; ++i) {{\n    number = (double)x[i];\n    fwrite(&number, 8, 1, stdout);\n  }}\n}}\n\n\
         int main(int count, char **arguments) {{\n  double state[{four}];\n  {name}_real own[{four}];\n  {name}_real x[{most}];\n\
         \x20 const {name}_real *q = own;\n  const {name}_real *qd = own + {n};\n  const {name}_real *qdd = own + {two};\n\
         \x20 const {name}_real *tau = own + {three};\n\
         \x20 if (count > 1 && strcmp(arguments[1], \"selftest\") == 0) {{\n    printf(\"%d\", {name}_selftest());\n    return 0;\n  }}\n\
         \x20 memset(x, 0, sizeof x);\n  (void)qdd;\n  (void)tau;\n\
         \x20 while (fread(state, 8, {four}, stdin) == {four}) {{\n\
         \x20   for (int i = 0; i < {four}; ++i) own[i] = ({name}_real)state[i];\n{body}  }}\n  return 0;\n}}\n",
        two = 2 * n,
        three = 3 * n,
        four = 4 * n,
        most = 3 * n * n + 2 * n,
    )
}
