//! The command line from outside: its results for data, and its refusals.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod bad_input;
mod commands;
mod comparing;
mod constraints;
mod convert;
mod ensembles;
mod excited;
mod exported;
mod formulas;
mod hostile;
mod identified;
mod idle;
mod inputs;
mod instructions;
mod interrupted;
mod laws;
mod learned;
mod long_logs;
mod parameters;
mod quick;
mod resuming;
mod robots;
mod servos;
mod tracking;
mod units;
mod workbench;
