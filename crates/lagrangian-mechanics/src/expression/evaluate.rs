//! The numbers of expressions: slow and plain, the reference that printed code is tested against.

use std::collections::HashMap;

use super::{Graph, Id, Operation, Value};
use lagrangian_motion::{Error, Result};

impl Graph {
    /// Numbers of `outputs` at these inputs.
    ///
    /// # Errors
    /// [`Error::UnknownName`] for a missing input; [`Error::Shape`] for one of another length.
    pub fn evaluate(
        &self,
        inputs: &[(&str, &[f64])],
        outputs: &[Value<'_>],
    ) -> Result<Vec<Vec<f64>>> {
        let ids: Vec<Id> = outputs.iter().map(|output| output.id()).collect();
        let mut found: HashMap<Id, Vec<f64>> = HashMap::new();
        for id in self.needed(&ids) {
            let numbers = match self.operation(id) {
                Operation::Input(name) => self.given(inputs, name, id)?,
                operation => self.compute(id, &operation, &found),
            };
            found.insert(id, numbers);
        }
        Ok(ids.iter().map(|id| found[id].clone()).collect())
    }

    fn given(&self, inputs: &[(&str, &[f64])], name: &str, id: Id) -> Result<Vec<f64>> {
        let input = inputs.iter().find(|(other, _)| *other == name);
        let (_, numbers) = input.ok_or_else(|| Error::UnknownName {
            kind: "input",
            name: name.into(),
            known: inputs
                .iter()
                .map(|(name, _)| *name)
                .collect::<Vec<_>>()
                .join(", "),
        })?;
        let remedy = "give as many numbers as the expression reads";
        Error::check_shape(name, numbers.len(), self.length(id), remedy)?;
        Ok(numbers.to_vec())
    }

    fn compute(&self, id: Id, operation: &Operation, found: &HashMap<Id, Vec<f64>>) -> Vec<f64> {
        let length = self.length(id);
        let of = |id: &Id| &found[id];
        let at = |id: &Id, i: usize| {
            let numbers = &found[id];
            numbers[if numbers.len() == 1 { 0 } else { i }]
        };
        let each = |f: &dyn Fn(usize) -> f64| (0..length).map(f).collect();
        match operation {
            Operation::Input(_) => Vec::new(),
            Operation::Constant(bits) => bits.iter().map(|x| f64::from_bits(*x)).collect(),
            Operation::Weights(first) => {
                let all = self.spans().into_iter().flat_map(|span| span.values);
                all.skip(*first).take(length).collect()
            }
            Operation::Add(a, b) => each(&|i| at(a, i) + at(b, i)),
            Operation::Subtract(a, b) => each(&|i| at(a, i) - at(b, i)),
            Operation::Multiply(a, b) => each(&|i| at(a, i) * at(b, i)),
            Operation::Divide(a, b) => each(&|i| at(a, i) / at(b, i)),
            Operation::Negate(a) => each(&|i| -at(a, i)),
            Operation::Map(function, a) => each(&|i| function.evaluate(at(a, i))),
            Operation::Choose(by, a, b) => each(&|i| match at(by, i) >= 0.0 {
                true => at(a, i),
                false => at(b, i),
            }),
            Operation::Sum(a) => vec![of(a).iter().sum()],
            Operation::Slice(a, first) => of(a)[*first..first + length].to_vec(),
            Operation::Join(parts) => parts.iter().flat_map(|part| of(part).clone()).collect(),
            Operation::Matrix {
                matrix,
                transposed,
                of: x,
            } => {
                let matrix = &self.matrices.borrow()[*matrix];
                let x = of(x);
                let entry = |i: usize, j: usize| match transposed {
                    false => matrix.values[i * matrix.columns + j],
                    true => matrix.values[j * matrix.columns + i],
                };
                each(&|i| x.iter().enumerate().map(|(j, x)| entry(i, j) * x).sum())
            }
        }
    }
}
