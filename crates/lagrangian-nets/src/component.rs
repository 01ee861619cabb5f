//! The components of a quantity in a [`Pass`](crate::Pass): its value and derivatives over the truncated algebra
//! (theory.md, equation 9). Mixed second derivatives come after all tangents, at [`Pass::mixed`](crate::Pass::mixed).

/// Component of the value.
pub const VALUE: usize = 0;

/// Component of the tangent ′, the first derivative along the direction ′.
pub const PRIME: usize = 1;

/// Component of the tangent i, the first derivative along direction `i`.
#[inline]
#[must_use]
pub const fn tangent(i: usize) -> usize {
    2 + i
}
