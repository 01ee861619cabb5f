//! One array of weights.

use std::borrow::Cow;

use safetensors::tensor::{Dtype, TensorView, View};

use super::wrong_tensor;
use lagrangian_motion::Result;

/// An array of weights: finite, row-major, f64 in memory and in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensor {
    shape: Vec<usize>,
    data: Vec<f64>,
}

impl Tensor {
    /// Values with their shape.
    ///
    /// # Errors
    /// [`crate::Error::Tensor`] if the values do not fill the shape or one is not finite.
    pub fn new(shape: Vec<usize>, data: Vec<f64>) -> Result<Self> {
        let tensor = Self { shape, data };
        tensor.check("tensor")?;
        Ok(tensor)
    }

    /// Its shape; `[]` is a single number.
    #[must_use]
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Its values, row-major.
    #[must_use]
    pub fn data(&self) -> &[f64] {
        &self.data
    }

    pub(super) fn check(&self, name: &str) -> Result<()> {
        let Self { shape, data } = self;
        let mut sides = shape.iter();
        let size = sides.try_fold(1_usize, |size, &side| size.checked_mul(side));
        if size != Some(data.len()) {
            let problem = format!("holds {} values, which do not fill {shape:?}", data.len());
            return Err(wrong_tensor(name, problem));
        }
        match data.iter().position(|x| !x.is_finite()) {
            Some(index) => {
                let problem = format!("is {} at index {index}", data[index]);
                Err(wrong_tensor(name, problem))
            }
            None => Ok(()),
        }
    }

    /// f64 as it is, f32 widened (exact); other types are refused.
    pub(super) fn from_view(name: &str, view: &TensorView<'_>) -> Result<Self> {
        let single = |b: &[u8; 4]| f64::from(f32::from_le_bytes(*b));
        let double = |b: &[u8; 8]| f64::from_le_bytes(*b);
        let data = match view.dtype() {
            Dtype::F64 => view.data().as_chunks().0.iter().map(double).collect(),
            Dtype::F32 => view.data().as_chunks().0.iter().map(single).collect(),
            other => {
                let problem = format!("is of type {other}, not F64 or F32");
                return Err(wrong_tensor(name, problem));
            }
        };
        let shape = view.shape().to_vec();
        let tensor = Self { shape, data };
        tensor.check(name)?;
        Ok(tensor)
    }
}

impl View for &Tensor {
    fn dtype(&self) -> Dtype {
        Dtype::F64
    }

    fn shape(&self) -> &[usize] {
        &self.shape
    }

    fn data(&self) -> Cow<'_, [u8]> {
        self.data.iter().flat_map(|x| x.to_le_bytes()).collect()
    }

    fn data_len(&self) -> usize {
        size_of_val(self.data.as_slice())
    }
}
