//! Promises of selective refinement: what a request gives, and how large its error is.

mod at_vertices;
mod bounds;
mod budgets;
mod cameras;
mod fields;
mod guarantees;
mod histories;
mod inside;
mod needs;
mod orders;
mod plain_needs;
mod random_orders;
mod rounding;
mod subjects;
#[path = "../support/mod.rs"]
mod support;
mod tet_errors;
mod theory;
