//! `lagrangian constraints`: rods, circles and lines that join recorded points.

use anyhow::Result;
use lagrangian::Coordinates;
use lagrangian::constraints::{Found, Point, Structure, find_in};
use lagrangian::text::counted;
use lagrangian_report::{Report, Table};
use serde_json::json;

use super::OutputMode;
use super::conserved::named_points;
use crate::data;
use crate::failure::{Context, SUCCESS};
use crate::law_args::ConstraintsArgs;
use crate::text;

pub(super) fn run(args: &ConstraintsArgs, mode: OutputMode) -> Result<u8> {
    let recordings = data::read_sample(&args.files, &args.data, None)?.recordings;
    let coordinates = recordings.first().map(|own| own.coordinates.clone());
    let coordinates = coordinates.unwrap_or_else(|| Coordinates(Vec::new()));
    let points = match args.points.is_empty() {
        true => None,
        false => {
            let points = named_points(&args.points, &coordinates)?.into_iter();
            Some(points.map(|axes| Point::of(&coordinates, axes)).collect())
        }
    };
    let structure = find_in(&recordings, points).context(
        "cannot look for constraints",
        "give recordings of one system at a time, with the same columns (--q), and each point as x1:y1 or x1:y1:z1",
    )?;
    let figures = json!({
        "command": "constraints",
        "files": args.files,
        "structure": structure,
    });
    mode.print(&figures, || shown(&structure, coordinates.dof()))?;
    Ok(SUCCESS)
}

fn shown(structure: &Structure, coordinates: usize) -> String {
    let answer = match structure.found.is_empty() {
        true => {
            "no constraint was found, neither a line, a rod, a circle or another relation of second order, nor one of velocities: each \
             coordinate moves by itself, as far as these data tell"
                .into()
        }
        false => format!(
            "{} among {}: {} of freedom",
            counted(structure.found.len(), "constraint"),
            counted(coordinates, "coordinate"),
            counted(structure.freedom, "degree"),
        ),
    };
    let row = |own: &Found| {
        let [scatter, noise] = [own.scatter, own.noise].map(|x| format!("{x:.2e}"));
        vec![own.constraint.name.clone(), scatter, noise]
    };
    let rows: Vec<Vec<String>> = structure.found.iter().map(row).collect();
    let header = ["constraint", "deviation", "by the noise"];
    let tables = vec![Table::new("Constraints.", &header, rows)];
    text::of(&Report {
        answer,
        tables: if structure.found.is_empty() {
            Vec::new()
        } else {
            tables
        },
        ..Report::default()
    })
}
