//! The program from outside: exit codes, messages, and the files it leaves.

mod accepted;
mod accuracy;
mod studies;
mod terminal;
mod test_directory;
mod tutorial;
mod check;
mod compare;
mod constants;
mod doors;
mod export;
mod extremes;
mod failing;
mod fields;
mod plot;
mod losses;
mod kept;
mod krylov;
mod keys;
mod meshes;
mod notebook;
mod odd_names;
mod provenance;
mod refused;
mod restart;
mod serve;
