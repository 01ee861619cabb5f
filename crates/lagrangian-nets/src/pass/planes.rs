//! Features, outputs and their sensitivities as [`Planes`], one component at a time.

use super::Pass;
use crate::net::Net;
use crate::packed::panels;
use crate::simd::{FromPlanes, Planes, Real, Shape, ToPlanes, dispatch};

impl<T: Real> Pass<T> {
    /// Shape of a matrix of `width` columns in this block.
    pub(crate) fn shape_of(&self, width: usize) -> Shape {
        Shape {
            samples: self.samples,
            components: self.components,
            capacity: self.capacity,
            panels: panels::<T>(width),
        }
    }

    /// Sets one component of all features: feature i from value i of the planes.
    pub fn set_features(&mut self, component: usize, planes: &Planes<T>) {
        dispatch(FromPlanes {
            shape: self.shape_of(self.x_width),
            component,
            width: self.x_width,
            layer: &mut self.x,
            first: 0,
            planes,
        });
    }

    /// Writes the gradient by the features to `planes`, after [`Pass::reverse_seeded`].
    pub fn read_feature_gradient(&self, planes: &mut Planes<T>) {
        dispatch(ToPlanes {
            shape: self.shape_of(self.x_width),
            component: 0,
            width: self.x_width,
            layer: &self.yx,
            first: 0,
            planes,
        });
    }

    /// Writes one component of all outputs to `planes`.
    pub fn read_outputs(&self, net: &Net, component: usize, planes: &mut Planes<T>) {
        let mut first = 0;
        for &l in &net.outputs {
            let (layer, width) = (&self.layers[l], net.layers[l].width);
            dispatch(ToPlanes {
                shape: layer.shape,
                component,
                width,
                layer: layer.output(),
                first,
                planes,
            });
            first += width;
        }
    }

    /// Sets one component of the sensitivities of all outputs, from which a reverse pass starts.
    pub fn set_seeds(&mut self, net: &Net, component: usize, planes: &Planes<T>) {
        let mut first = 0;
        for &l in &net.outputs {
            let (layer, width) = (&mut self.layers[l], net.layers[l].width);
            dispatch(FromPlanes {
                shape: layer.shape,
                component,
                width,
                layer: &mut layer.yz,
                first,
                planes,
            });
            first += width;
        }
    }
}
