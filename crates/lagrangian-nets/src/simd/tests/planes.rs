//! Conversion of layers to planes and back, and the circle functions of planes of angles.

use super::super::*;
use super::each;
use crate::simd::planes::{FromPlanes, Planes, ToPlanes};

/// Copies a layer of any width there and back on one instruction set: every number at its place, and 0 in the padding.
fn there_and_back<T: Real>(draw: &mut super::Draw) {
    let shape = draw.shape();
    let (component, cut) = (draw.size(0..shape.components), draw.size(0..T::LANES));
    let (width, first) = (shape.panels * T::LANES - cut, draw.size(0..3));
    let layer = draw.layer::<T>(&shape);
    let at = |u: usize, s: usize| shape.at::<T>(u / T::LANES, component, s) + u % T::LANES;
    for level in levels() {
        let mut planes = Planes::new(first + width, shape.samples);
        dispatch_on(
            level,
            ToPlanes {
                shape,
                component,
                width,
                layer: &layer,
                first,
                planes: &mut planes,
            },
        );
        let mut back = layer.clone();
        dispatch_on(
            level,
            FromPlanes {
                shape,
                component,
                width,
                layer: &mut back,
                first,
                planes: &planes,
            },
        );
        for s in 0..shape.samples {
            for u in 0..shape.panels * T::LANES {
                let expected = if u < width {
                    layer[at(u, s)]
                } else {
                    T::of(0.0)
                };
                assert!(
                    back[at(u, s)] == expected,
                    "{level}: unit {u} of sample {s}"
                );
                if u < width {
                    assert!(planes.number(first + u, s) == expected, "{level}: {u} {s}");
                }
            }
        }
        let elsewhere = |i: &usize| (*i / T::LANES / shape.samples) % shape.components != component;
        let others: Vec<usize> = (0..layer.len()).filter(elsewhere).collect();
        assert!(others.iter().all(|&i| back[i] == layer[i]), "{level}");
    }
}

#[test]
fn layers_go_to_planes_and_back_on_every_instruction_set() {
    each(there_and_back::<f32>);
    each(there_and_back::<f64>);
}

struct Circle<'a> {
    angles: &'a [f64],
    sines: &'a mut [f64],
    cosines: &'a mut [f64],
}

impl Task for Circle<'_> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        for at in (0..self.angles.len()).step_by(8) {
            let (sin, cos) = sin_cos(I::F64::load(&self.angles[at..]));
            sin.store(&mut self.sines[at..]);
            cos.store(&mut self.cosines[at..]);
        }
    }
}

#[test]
fn sin_and_cos_agree_with_the_mathematics_library_up_to_the_largest_angle() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let near = (-40..40).flat_map(|k| {
        let turn = f64::from(k) * quarter;
        [turn, turn + 1e-9, turn - 1e-5, turn + 0.5 * quarter]
    });
    let spread = (0..2000).map(|k| (f64::from(k) - 1000.0) * 1e-3 * LARGEST_ANGLE);
    let small = (0..300).map(|k| 2.0_f64.powi(-k));
    let mut angles: Vec<f64> = near.chain(spread).chain(small).collect();
    angles.resize(angles.len().next_multiple_of(8), 0.0);
    for level in levels() {
        let (mut sines, mut cosines) = (vec![0.0; angles.len()], vec![0.0; angles.len()]);
        let (angles, sines, cosines) = (&angles[..], &mut sines[..], &mut cosines[..]);
        dispatch_on(
            level,
            Circle {
                angles,
                sines,
                cosines,
            },
        );
        for ((&q, &sin), &cos) in angles.iter().zip(&*sines).zip(&*cosines) {
            let bound = 3e-16;
            assert!((sin - q.sin()).abs() < bound, "{level}: sin {q}: {sin}");
            assert!((cos - q.cos()).abs() < bound, "{level}: cos {q}: {cos}");
            // Relative to its size near 0.
            if q.abs() < 0.5 {
                assert!((sin - q.sin()).abs() <= 3e-16 * q.abs(), "{level}: {q}");
            }
        }
    }
}
