//! Sums of arrays, and steps of Adam.

use super::super::*;
use super::{Draw, agree, each};

fn sums<T: Real>(draw: &mut Draw) {
    let len = draw.size(0..70);
    let (from, to) = (draw.values::<T>(len), draw.values::<T>(len));
    agree("a sum of gradients", |level| {
        let mut to = to.clone();
        dispatch_on(
            level,
            AddTo {
                from: &from,
                to: &mut to,
            },
        );
        to.to_vec()
    });
}

fn rows<T: Real>(draw: &mut Draw) {
    let len = T::LANES * draw.size(0..40);
    let (numbers, start) = (draw.values::<T>(len), draw.values::<T>(T::LANES));
    agree("a sum of rows", |level| {
        let mut sums = start.clone();
        dispatch_on(
            level,
            SumRows {
                rows: &numbers,
                sums: &mut sums,
            },
        );
        sums.to_vec()
    });
    agree("a sum of squares", |level| {
        let mut sum = 0.5;
        dispatch_on(
            level,
            SumOfSquares {
                of: &numbers,
                sum: &mut sum,
            },
        );
        vec![T::of(sum)]
    });
}

/// A step with positive second moments, of weights with a lower bound.
fn adam<T: Real>(draw: &mut Draw) {
    let len = draw.size(0..70);
    let [gradient, first] = [0; 2].map(|_| draw.values::<T>(len));
    let second: Vec<T> = first.iter().map(|&x| x * x).collect();
    let weights = draw.values::<f64>(len);
    agree("a step of Adam", |level| {
        let (mut first, mut second) = (first.to_vec(), second.clone());
        let (mut weights, mut rounded) = (weights.to_vec(), first.clone());
        let rule = AdamRule {
            memory: [0.9, 0.999],
            corrections: [1.7, 2.3],
            epsilon: 1e-8,
            rate: 1e-2,
            decay: 1e-3,
            shorten: 0.6,
        };
        dispatch_on(
            level,
            AdamStep {
                gradient: &gradient,
                first: &mut first,
                second: &mut second,
                weights: &mut weights,
                rounded: Some(&mut rounded),
                rule,
                lowest: -1.0,
            },
        );
        let weights: Vec<T> = weights.into_iter().map(T::of).collect();
        [first, second, weights, rounded].concat()
    });
}

#[test]
fn sums_and_steps_agree_on_every_instruction_set() {
    each(sums::<f32>);
    each(sums::<f64>);
    each(rows::<f32>);
    each(rows::<f64>);
    each(adam::<f32>);
    each(adam::<f64>);
}
