//! The program from outside: exit codes, messages, and the files it leaves.

mod accepted;
mod desk;
mod failing;
mod fields;
mod meshes;
mod refused;
