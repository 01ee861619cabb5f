//! What comes with a model in C: an example, its test, how both are built, and a page that explains all of it.

use std::fmt::Write;

use crate::interface::one_line;
use crate::{Call, Drive, Error, File, Interface, Quantity, Shape, casadi};

const EXAMPLE: &str = include_str!("../templates/example.c");

/// The files that are written beside the model.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// The functions of the model.
    pub interface: &'a Interface,
    /// Whether `NAME_casadi.c` is among the files.
    pub casadi: bool,
    /// The names of the functional mock-up units beside them.
    pub units: &'a [String],
}

impl Surroundings<'_> {
    /// `example.c`, `selftest.c`, `CMakeLists.txt` and `README.md`.
    ///
    /// # Errors
    /// Those of [`Interface::check`].
    pub fn files(&self) -> Result<Vec<File>, Error> {
        self.interface.check()?;
        let file = |name: &str, text| File {
            name: name.into(),
            text,
        };
        Ok(vec![
            file("example.c", self.example()),
            file("selftest.c", self.selftest()),
            file("CMakeLists.txt", self.cmake()),
            file("README.md", self.readme()),
        ])
    }

    /// A program that prints what the model says about a state.
    fn example(&self) -> String {
        let start: Vec<String> = self
            .interface
            .start
            .iter()
            .map(|x| format!("(MODEL_real){x:?}"))
            .collect();
        let (q, qd) = start.split_at(self.interface.joints.len());
        let mut text = format!("/* {} */\n{EXAMPLE}", self.interface.origin());
        let _ = writeln!(
            text,
            "    const MODEL_real q[MODEL_N] = {{{}}};",
            q.join(", ")
        );
        let _ = writeln!(
            text,
            "    const MODEL_real qd[MODEL_N] = {{{}}};",
            qd.join(", ")
        );
        text += "    int failures = 0;\n";
        let mut calls: Vec<Call> = [
            Call::ForwardDynamics,
            Call::InverseDynamics,
            Call::Energy,
            Call::DistanceFromData,
        ]
        .into();
        calls.retain(|call| self.interface.has(*call));
        let zero = |q: Quantity, text: &mut String| {
            let _ = writeln!(
                text,
                "    const MODEL_real {}[{}] = {{0}};",
                q.name,
                self.size(q)
            );
        };
        // Forces and accelerations are an argument of one function and the result of the other.
        for call in calls {
            let [result] = call.results() else { continue };
            text += "    {\n";
            for argument in &call.arguments()[2..] {
                text += "    ";
                zero(*argument, &mut text);
            }
            let arguments: Vec<&str> = call.arguments().iter().map(|q| q.name).collect();
            let _ = write!(
                text,
                "        MODEL_real {name}[{size}];\n        const int status = MODEL_{call}({arguments}, {name});\n        \
                 failures += print(\"{call}\", {name}, {size}, status);\n    }}\n",
                name = result.name,
                size = self.size(*result),
                call = call.name(),
                arguments = arguments.join(", "),
            );
        }
        text += "    (void)q, (void)qd;\n    return failures ? 1 : 0;\n}\n";
        text.replace("MODEL", &self.interface.name)
    }

    /// The number of values of a quantity in C.
    fn size(&self, quantity: Quantity) -> String {
        match quantity.shape {
            Shape::Scalar => "1".into(),
            Shape::Vector(_) if quantity.name == "tau" => "MODEL_NU".into(),
            Shape::Vector(_) => "MODEL_N".into(),
            Shape::Matrix(..) => {
                let [rows, columns] = self.interface.rows_and_columns(quantity.shape);
                (rows * columns).to_string()
            }
        }
    }

    fn selftest(&self) -> String {
        let text = "/* Whether this build of the model gives the values that it was exported with. */\n\
                    #include \"MODEL.h\"\n\n#include <stdio.h>\n\n\
                    int main(void)\n{\n    const int status = MODEL_selftest();\n    \
                    if (status != MODEL_OK)\n        fprintf(stderr, \"MODEL_selftest: status %d\\n\", status);\n    \
                    return status == MODEL_OK ? 0 : 1;\n}\n";
        text.replace("MODEL", &self.interface.name)
    }

    fn cmake(&self) -> String {
        let mut text = String::from(
            "cmake_minimum_required(VERSION 3.10)\nproject(MODEL C)\nset(CMAKE_C_STANDARD 99)\nset(CMAKE_C_STANDARD_REQUIRED ON)\n\
             set(CMAKE_C_EXTENSIONS OFF)\nif(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)\n  set(CMAKE_BUILD_TYPE Release)\n\
             endif()\n\n\
             option(MODEL_FLOAT \"compute in single precision\" OFF)\nif(MODEL_FLOAT)\n  add_compile_definitions(MODEL_FLOAT)\nendif()\n\n\
             add_library(MODEL MODEL.c)\nset_target_properties(MODEL PROPERTIES POSITION_INDEPENDENT_CODE ON)\n\
             target_include_directories(MODEL PUBLIC ${CMAKE_CURRENT_SOURCE_DIR})\nif(UNIX)\n  target_link_libraries(MODEL PUBLIC m)\nendif()\n",
        );
        if self.casadi {
            text += "\nif(NOT MODEL_FLOAT)\n  add_library(MODEL_casadi MODULE MODEL_casadi.c)\n  target_link_libraries(MODEL_casadi PRIVATE MODEL)\n  \
                     set_target_properties(MODEL_casadi PROPERTIES PREFIX \"\")\nendif()\n";
        }
        text += "\nenable_testing()\nforeach(program example selftest)\n  add_executable(MODEL_${program} ${program}.c)\n  \
                 target_link_libraries(MODEL_${program} PRIVATE MODEL)\n  \
                 add_test(NAME ${program} COMMAND MODEL_${program})\nendforeach()\n";
        text.replace("MODEL", &self.interface.name)
    }

    fn readme(&self) -> String {
        let Interface {
            name,
            hash,
            version,
            ..
        } = self.interface;
        let mut text = format!(
            "# {name}\n\n{}.\n\nGenerated by lagrangian {version} from the model {hash}. The code is C99, needs the mathematical library \
             alone, takes no memory, and keeps nothing between calls, so that any thread may call it.\n\n\
             ```sh\ncmake -S . -B build && cmake --build build && ctest --test-dir build\n```\n\n",
            escaped(self.interface.description.trim_end_matches('.')),
        );
        text += &self.joints();
        text += &self.functions();
        text += &self.casadi_section();
        text += &self.units_section();
        text
    }

    fn joints(&self) -> String {
        let mut text = String::from(
            "## Joints\n\n| index | joint | position | velocity | force |\n|---|---|---|---|---|\n",
        );
        for (k, joint) in self.interface.joints.iter().enumerate() {
            let unit = joint.unit;
            let cells = [unit.rate(0), unit.rate(1), unit.force()].join(" | ");
            let _ = writeln!(text, "| {k} | {} | {cells} |", escaped(&joint.name));
        }
        text + "\n"
    }

    fn functions(&self) -> String {
        let Interface { name, joints, .. } = self.interface;
        let mut text = format!(
            "## Functions\n\nVectors have {name}_N = {} values, `tau` has {name}_NU = {}{}. Matrices are stored by rows. All values are \
             `{name}_real`: double, or float where everything is compiled with `-D{name}_FLOAT`. Units are SI.\n\n| function | what |\n|---|---|\n",
            joints.len(),
            self.interface.inputs(),
            match self.interface.drive {
                Drive::Forces => "",
                Drive::Inputs(_) => ", the inputs of the actuators in the units of the data",
            },
        );
        for call in self.interface.offered() {
            let names = call
                .arguments()
                .iter()
                .chain(call.results())
                .map(|q| q.name);
            let names: Vec<&str> = names.collect();
            let _ = writeln!(
                text,
                "| `{name}_{}({})` | {} |",
                call.name(),
                names.join(", "),
                call.about()
            );
        }
        let _ = write!(
            text,
            "| `{name}_selftest()` | whether this build gives the values that the model was exported with |\n\n\
             Each returns a status:\n\n| status | meaning |\n|---|---|\n| `{name}_OK` = 0 | the results are valid |\n\
             | `{name}_OUTSIDE` = 1 | the results are computed, but the state is outside of the data that the model was learned from |\n\
             | `{name}_NOT_FINITE` = 2 | an argument or a result is not finite; the results are not valid |\n\
             | `{name}_SINGULAR` = 3 | the mass matrix has no inverse at this state; the results are not valid |\n\n"
        );
        text
    }

    fn casadi_section(&self) -> String {
        if !self.casadi {
            return String::new();
        }
        let name = &self.interface.name;
        let mut text = format!(
            "## CasADi\n\n```sh\ncc -O2 -shared -fPIC {name}.c {name}_casadi.c -o {name}_casadi.so -lm\n```\n\n```python\nimport casadi\n"
        );
        let functions = || {
            self.interface
                .offered()
                .filter(|call| casadi::is_function(*call))
        };
        let wanted = [Call::ForwardDynamics, Call::InverseDynamics];
        let first = functions()
            .find(|call| wanted.contains(call))
            .or_else(|| functions().next());
        if let Some(call) = first {
            let function = casadi::function_name(self.interface, call);
            let _ = writeln!(
                text,
                "f = casadi.external(\"{function}\", \"./{name}_casadi.so\")"
            );
        }
        text += "```\n\n";
        let exact: Vec<String> = functions()
            .filter(|call| call.derivatives().is_some_and(|d| self.interface.has(d)))
            .map(|call| format!("`{}`", casadi::function_name(self.interface, call)))
            .collect();
        if !exact.is_empty() {
            let _ = write!(text, "Jacobians are exact for {}. ", exact.join(" and "));
        }
        text + "The other functions, each under its own name after the same prefix, need the option `{\"enable_fd\": True}` to be \
                differentiated. There are no second derivatives: give ipopt as `hess_lag` the Hessian of the cost alone, or, with many more steps, the \
                option `hessian_approximation=limited-memory`.\n\n"
    }

    fn units_section(&self) -> String {
        if self.units.is_empty() {
            return String::new();
        }
        let files: Vec<String> = self
            .units
            .iter()
            .map(|file| format!("`{}`", escaped(file)))
            .collect();
        format!(
            "## Functional mock-up units\n\n{}: co-simulation and model exchange. Inputs are `tau[i]`, states and outputs `q[i]` and `qd[i]`, \
             further outputs `qdd[i]`, and `energy` and `distance_from_data` where the model knows them; indices begin at 1.\n",
            files.join(", ")
        )
    }
}

/// Text in a table of Markdown.
fn escaped(text: &str) -> String {
    one_line(text)
        .replace('|', "\\|")
        .replace('<', "&lt;")
        .replace('`', "'")
}
