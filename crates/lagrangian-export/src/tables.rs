//! The constants of a generated file: each table once.

use std::collections::HashMap;
use std::fmt::Write as _;

use lagrangian::expression::Graph;

use crate::block::literal;

/// The tables of a file.
#[derive(Debug, Default)]
pub(crate) struct Tables {
    names: HashMap<Vec<u64>, String>,
    text: String,
    numbers: usize,
}

impl Tables {
    /// The name of the table of a vector.
    pub(crate) fn vector(&mut self, bits: &[u64]) -> String {
        if let Some(name) = self.names.get(bits) {
            return name.clone();
        }
        let name = format!("table_{}", self.names.len());
        let numbers: Vec<f64> = bits.iter().map(|x| f64::from_bits(*x)).collect();
        self.add(&name, &numbers);
        self.names.insert(bits.to_vec(), name.clone());
        name
    }

    /// Rows and columns of a matrix of the graph, and the name of its table.
    pub(crate) fn matrix(&mut self, graph: &Graph, matrix: usize) -> (usize, usize, String) {
        let matrix = graph.matrix_of(matrix);
        let bits: Vec<u64> = matrix.values.iter().map(|x| x.to_bits()).collect();
        (matrix.rows, matrix.columns, self.vector(&bits))
    }

    /// Adds a table under this name.
    pub(crate) fn add(&mut self, name: &str, numbers: &[f64]) {
        self.numbers += numbers.len();
        let _ = writeln!(
            self.text,
            "static const real {name}[{}] = {{",
            numbers.len().max(1)
        );
        for row in numbers.chunks(4) {
            let row: Vec<String> = row.iter().map(|x| literal(*x)).collect();
            let _ = writeln!(self.text, "  {},", row.join(", "));
        }
        if numbers.is_empty() {
            self.text += "  C(0),\n";
        }
        self.text += "};\n\n";
    }

    /// The tables as C.
    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    /// Count of numbers in the tables.
    pub(crate) fn numbers(&self) -> usize {
        self.numbers
    }
}
