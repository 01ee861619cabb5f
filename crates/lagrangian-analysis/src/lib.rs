//! What mechanics says of a learned or known Lagrangian beyond its motions: the action of paths, what is conserved, how
//! long motions can be predicted, and whether recorded motions have a Lagrangian at all.

pub mod action;
pub mod chaos;
pub mod conserved;
pub mod existence;
