//! Tests of the library through its public interface, as one program: the library is compiled into it once.
//!
//! Tests that need a process of their own are separate: those of allocations, and of the instructions that the kernels use.

mod bad_robots;
mod bodies;
mod cartesian;
mod chain;
mod cyclic;
mod delan;
mod dry_friction;
mod edited_urdf;
mod ensembles;
mod excitation;
mod filtered;
mod formula;
mod hamiltonian;
mod identification;
mod identities;
mod lattice;
mod networks;
mod nominal;
mod order;
mod parameters;
mod recorded_data;
mod reference_systems;
mod refinement;
mod rigid_bodies;
mod rigid_identification;
mod rollout_loss;
mod rollouts;
mod saved_models;
mod settings;
mod training;
mod variational;
