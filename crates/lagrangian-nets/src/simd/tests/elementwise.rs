//! Activations, tangents, sensitivities and gates.

use super::super::*;
use super::{ConcatAll, Draw, agree, each};
use crate::Activation;

fn activations<T: Real>(draw: &mut Draw) {
    let shape = draw.shape();
    let z = draw.layer::<T>(&shape);
    let [slope] = draw.slopes::<T, 1>(&shape);
    for activation in [
        Activation::Softplus,
        Activation::Tanh,
        Activation::Gelu,
        Activation::XTanh,
        Activation::Square,
        Activation::Exp,
    ] {
        agree("activation", |level| {
            let mut a = z.clone();
            let [mut first, mut second, mut third] = [0; 3].map(|_| slope.clone());
            let slopes: [&mut [T]; 3] = [&mut first, &mut second, &mut third];
            dispatch_on(
                level,
                PointForward {
                    shape,
                    activation,
                    z: &z,
                    a: &mut a,
                    slopes,
                },
            );
            [a, first, second, third].concat_all()
        });
    }
}

#[test]
fn activations_agree_on_every_instruction_set() {
    each(activations::<f32>);
    each(activations::<f64>);
}

fn tangents<T: Real>(draw: &mut Draw) {
    let shape = draw.shape();
    let (z, out) = (draw.layer::<T>(&shape), draw.layer::<T>(&shape));
    let [first, second] = draw.slopes::<T, 2>(&shape);
    let directions = draw.size(1..shape.capacity + 1);
    agree("tangents through an activation", |level| {
        let mut output = out.clone();
        dispatch_on(
            level,
            PointTangent {
                shape,
                components: 1..2 + directions,
                first: &first,
                input: &z,
                output: &mut output,
            },
        );
        output.to_vec()
    });
    agree("mixed derivatives through an activation", |level| {
        let mut a = out.clone();
        dispatch_on(
            level,
            PointSecond {
                shape,
                directions,
                slopes: [&first, &second],
                z: &z,
                a: &mut a,
            },
        );
        a.to_vec()
    });
}

fn sensitivities<T: Real>(draw: &mut Draw) {
    let shape = draw.shape();
    let (z, ya, out) = (
        draw.layer::<T>(&shape),
        draw.layer::<T>(&shape),
        draw.layer::<T>(&shape),
    );
    let [first, second, third] = draw.slopes::<T, 3>(&shape);
    let directions = draw.size(1..shape.capacity + 1);
    agree("sensitivities back through an activation", |level| {
        let mut yz = out.clone();
        dispatch_on(
            level,
            PointReverse2 {
                shape,
                directions,
                slopes: [&first, &second, &third],
                z: &z,
                ya: &ya,
                yz: &mut yz,
                value_only: false,
            },
        );
        yz.to_vec()
    });
    agree("sensitivities of tangents back", |level| {
        let mut yz = out.clone();
        dispatch_on(
            level,
            PointReverseTangents {
                shape,
                directions,
                slopes: [&first, &second],
                z: &z,
                ya: &ya,
                yz: &mut yz,
            },
        );
        yz.to_vec()
    });
}

fn sensitivities_to_the_value<T: Real>(draw: &mut Draw) {
    let shape = draw.shape();
    let (z, ya, out) = (
        draw.layer::<T>(&shape),
        draw.layer::<T>(&shape),
        draw.layer::<T>(&shape),
    );
    let [first, second, third] = draw.slopes::<T, 3>(&shape);
    let directions = draw.size(1..shape.capacity + 1);
    let reverse = |value_only: bool, level| {
        let mut ya = ya.clone();
        // The other components are never read, or they are zero.
        let rest = if value_only { f64::NAN } else { 0.0 };
        for panel in ya.chunks_exact_mut(shape.rows() * T::LANES) {
            panel[shape.samples * T::LANES..].fill(T::of(rest));
        }
        let mut yz = out.clone();
        let task = PointReverse2 {
            shape,
            directions,
            slopes: [&first, &second, &third],
            z: &z,
            ya: &ya,
            yz: &mut yz,
            value_only,
        };
        dispatch_on(level, task);
        yz.to_vec()
    };
    agree("sensitivities of the value alone", |level| {
        reverse(true, level)
    });
    agree("sensitivities with zeros", |level| reverse(false, level));
    let (alone, zeros) = (
        reverse(true, Level::Portable),
        reverse(false, Level::Portable),
    );
    assert!(
        alone
            .iter()
            .zip(&zeros)
            .all(|(a, b)| (*a - *b).f64().abs() < 1e-12)
    );
}

#[test]
fn tangents_and_sensitivities_agree_on_every_instruction_set() {
    each(tangents::<f32>);
    each(tangents::<f64>);
    each(sensitivities::<f32>);
    each(sensitivities::<f64>);
    each(sensitivities_to_the_value::<f32>);
    each(sensitivities_to_the_value::<f64>);
}

fn contractions<T: Real>(draw: &mut Draw) {
    let shape = draw.shape();
    let (n, samples) = (shape.capacity, shape.samples);
    let (z, ya) = (draw.layer::<T>(&shape), draw.layer::<T>(&shape));
    let [second] = draw.slopes::<T, 1>(&shape);
    let sums = draw.values::<T>(samples * n * (n + 1));
    agree("second derivatives along tangents", |level| {
        let mut hessian = sums.clone();
        dispatch_on(
            level,
            Contract {
                shape,
                directions: n,
                second: &second,
                z: &z,
                ya: &ya,
                hessian: &mut hessian,
            },
        );
        hessian.to_vec()
    });
    let (along, onto) = (draw.values::<T>(samples * n), draw.values::<T>(samples * n));
    for onto in [None, Some(&onto[..])] {
        agree("combinations of tangents", |level| {
            let mut buffer = z.clone();
            dispatch_on(
                level,
                Combine {
                    shape,
                    directions: n,
                    along: &along,
                    onto,
                    buffer: &mut buffer,
                },
            );
            buffer.to_vec()
        });
    }
}

#[test]
fn second_derivatives_agree_on_every_instruction_set() {
    each(contractions::<f32>);
    each(contractions::<f64>);
}

fn gates<T: Real>(draw: &mut Draw) {
    let shape = draw.shape();
    let (n, samples) = (draw.size(1..4), shape.samples);
    let wide = Shape {
        panels: (n + 1) * shape.panels,
        ..shape
    };
    let g = draw.layer::<T>(&wide);
    let v = draw.values::<T>(shape.components * samples * n);
    let (z, yg) = (draw.layer::<T>(&shape), draw.layer::<T>(&wide));
    let gates = || Gates {
        shape,
        n,
        g: &g,
        v: &v,
    };
    agree("gates forward", |level| {
        let mut out = z.clone();
        dispatch_on(
            level,
            GateForward {
                gates: gates(),
                components: 0..shape.components,
                z: &mut out,
            },
        );
        out.to_vec()
    });
    let directions = shape.capacity;
    let yv = draw.values::<T>(samples * n);
    let sums = draw.values::<T>(samples * directions * (directions + 1));
    agree("gates backward", |level| {
        let (mut yg, mut yv, mut sums) = (yg.clone(), yv.clone(), sums.clone());
        dispatch_on(
            level,
            GateReverse {
                gates: gates(),
                components: 0..shape.components,
                yz: &z,
                yg: &mut yg,
                yv: Some(&mut yv),
                hessian: Some((&mut sums, directions)),
            },
        );
        [yg, yv, sums].concat_all()
    });
}

#[test]
fn gates_agree_on_every_instruction_set() {
    each(gates::<f32>);
    each(gates::<f64>);
}
