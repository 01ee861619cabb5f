//! Writes what surrounds the cart-pole of the tests into a folder: `cargo run --example cart_pole -- FOLDER [LIBRARY2 LIBRARY3]`.
//! With two libraries, compiled from the sources of FMI 2.0 and 3.0, the units hold them.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use lagrangian_export_draft::fmu::{Binary, Unit, Version, archive};
use lagrangian_export_draft::surroundings::Surroundings;
use lagrangian_export_draft::{Call, File, Interface, Joint, Unit as Of, casadi};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [folder, libraries @ ..] = arguments.as_slice() else {
        return Err("usage: cart_pole FOLDER [LIBRARY2 LIBRARY3]".into());
    };
    let interface = cart_pole();
    let sources = sources()?;
    let units = ["cart_pole_fmi2.fmu".into(), "cart_pole_fmi3.fmu".into()];
    let around = Surroundings { interface: &interface, casadi: true, units: &units };
    let mut files = around.files()?;
    files.push(casadi::file(&interface)?);
    files.extend(sources.clone());
    write(folder, &files)?;
    for (k, version) in [Version::Two, Version::Three].into_iter().enumerate() {
        let unit = Unit { interface: &interface, version, start: &[0.0, 0.5, 0.0, 0.0], sources: &sources };
        write(&folder.join(units[k].trim_end_matches(".fmu")), &unit.files(true)?)?;
        let library = libraries.get(k).map(fs::read).transpose()?;
        let platform = version.platform().ok_or("FMI has no name for this platform")?;
        let binary = library.as_deref().map(|bytes| Binary { platform: &platform, extension: "so", bytes });
        fs::write(folder.join(&units[k]), archive(&unit, binary)?)?;
    }
    Ok(())
}

fn cart_pole() -> Interface {
    let joint = |name: &str, unit| Joint { name: name.into(), unit };
    Interface {
        name: "cart_pole".into(),
        joints: vec![joint("cart <left & right>", Of::Metre), joint("pole \"1\" */", Of::Radian)],
        inputs: 1,
        calls: [
            Call::InverseDynamics,
            Call::ForwardDynamics,
            Call::MassMatrix,
            Call::Energy,
            Call::Step,
            Call::InverseDynamicsDerivatives,
            Call::ForwardDynamicsDerivatives,
            Call::DistanceFromData,
        ]
        .into(),
        description: "A cart with a pole, in closed form */".into(),
        version: env!("CARGO_PKG_VERSION").into(),
        hash: "0123abcd".into(),
    }
}

fn sources() -> Result<Vec<File>, Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixture");
    let read = |name: &str| -> Result<File, Box<dyn Error>> {
        Ok(File { name: name.into(), text: fs::read_to_string(folder.join(name))? })
    };
    Ok(vec![read("cart_pole.h")?, read("cart_pole.c")?])
}

fn write(folder: &Path, files: &[File]) -> Result<(), Box<dyn Error>> {
    for file in files {
        let path = folder.join(&file.name);
        fs::create_dir_all(path.parent().ok_or("a file without a folder")?)?;
        fs::write(path, &file.text)?;
    }
    Ok(())
}
