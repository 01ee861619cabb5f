//! Matrix products, and products with a factored Jacobian.

use super::super::*;
use super::{Draw, agree, each};

fn products<T: Real>(draw: &mut Draw) {
    let [rows, columns] = [0; 2].map(|_| draw.size(1..60));
    // Long sums are computed in several parts.
    let terms = draw.size(1..600);
    let panels = columns.div_ceil(T::LANES);
    let a = draw.values::<T>(terms.div_ceil(T::LANES) * rows * T::LANES);
    let b = draw.values::<T>(panels * terms * T::LANES);
    let c = draw.values::<T>(panels * rows * T::LANES);
    let bias = draw.values::<T>(panels * T::LANES);
    let part = draw.size(0..rows)..rows;
    for init in [Init::Zero, Init::Add, Init::Rows(&bias, rows / 2)] {
        agree("product along rows", |level| {
            let (mut c, part) = (c.clone(), part.clone());
            let product = Gemm::along_rows(&a, rows, &b, terms, &mut c, rows, part, panels, init);
            dispatch_on(level, product);
            c.to_vec()
        });
    }
    // Aᵀ B in two pieces, `terms` rows of each.
    let (left, right) = (2 * terms, 3 * terms);
    let a = draw.values::<T>(rows.div_ceil(T::LANES) * left * T::LANES);
    let b = draw.values::<T>(panels * right * T::LANES);
    let pieces = [(0, terms * T::LANES), (terms * T::LANES, 0)];
    agree("product along columns", |level| {
        let mut c = c.clone();
        dispatch_on(
            level,
            Gemm::along_columns(
                &a,
                left,
                &b,
                right,
                &pieces,
                terms,
                &mut c,
                rows,
                panels,
                Init::Add,
            ),
        );
        c.to_vec()
    });
}

#[test]
fn products_agree_on_every_instruction_set() {
    each(products::<f32>);
    each(products::<f64>);
}

fn factors<T: Real>(draw: &mut Draw) {
    let samples = T::LANES * draw.size(1..3);
    let shape = draw.shape_of(samples);
    let terms = draw.terms(&shape);
    let (y, a) = (draw.layer::<T>(&shape), draw.layer::<T>(&shape));
    let raw = draw.values::<f64>(samples * terms.len());
    agree("rows of the Jacobian times a step", |level| {
        let mut out = raw.to_vec();
        dispatch_on(
            level,
            RowDots {
                shape,
                pairs: &terms,
                y: &y,
                a: &a,
                out: &mut out,
            },
        );
        out.iter().map(|&x| T::of(x)).collect::<Vec<T>>()
    });
    agree("weighted rows of the Jacobian", |level| {
        let mut out = a.clone();
        dispatch_on(
            level,
            WeighRows {
                shape,
                pairs: &terms,
                components: 0..shape.components,
                x: &raw,
                y: &y,
                out: &mut out,
            },
        );
        out.to_vec()
    });
    let rows = samples * shape.components;
    let [left, right] = [0; 2].map(|_| draw.values::<T>(rows * rows));
    let tile = draw.values::<f64>((terms.len() * samples).pow(2));
    agree("a tile of J Jᵀ", |level| {
        let mut tile = tile.to_vec();
        dispatch_on(
            level,
            GramTile {
                samples,
                rows,
                pairs: &terms,
                y: &left,
                a: &right,
                tile: &mut tile,
            },
        );
        tile.into_iter().map(T::of).collect::<Vec<T>>()
    });
}

#[test]
fn products_with_a_factored_jacobian_agree_on_every_instruction_set() {
    each(factors::<f32>);
    each(factors::<f64>);
}
