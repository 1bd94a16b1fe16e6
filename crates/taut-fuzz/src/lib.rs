//! What must hold for any input whatever: a target is a function of bytes that panics where it does not hold.
//!
//! `fuzz/` calls the targets with inputs that a fuzzer makes up, the tests of this crate with those kept in `fuzz/corpus`
//! (well-formed ones, and others that reach far) and in `fuzz/found` (those that once failed), each in a folder by the
//! target's name.

#![expect(
    clippy::unwrap_used,
    reason = "as in a test, a panic is how a failure is told"
)]

mod bytes;
mod clouds;
mod copies;
mod edits;
mod formulas;
mod lists;
mod models;
mod readers;

use bytes::Bytes;

/// Something to call with any bytes.
#[derive(Clone, Copy)]
pub struct Target {
    /// The name of its folders and of its program in `fuzz/`.
    pub name: &'static str,
    /// Panics where what must hold does not.
    pub run: fn(&[u8]),
}

macro_rules! targets {
    ($($name:ident: $function:path,)*) => {
        /// Every target.
        pub const TARGETS: &[Target] = &[$(Target { name: stringify!($name), run: $function },)*];
    };
}

targets! {
    ply: readers::ply,
    obj: readers::obj,
    off: readers::off,
    stl: readers::stl,
    xyz: readers::xyz,
    csv: readers::csv,
    pcd: readers::pcd,
    las: readers::las,
    copies: copies::copies,
    e57: readers::e57,
    npy: readers::npy,
    lists: lists::lists,
    formula: formulas::formula,
    model: models::model,
    edits: edits::edits,
    atlas: clouds::atlas,
    field: clouds::field,
    fit: clouds::fit,
}

/// Calls the target of a name.
///
/// # Panics
/// Where what must hold does not, and where there is no such target.
pub fn run(name: &str, bytes: &[u8]) {
    let target = TARGETS.iter().find(|target| target.name == name);
    (target.expect("a target of this name").run)(bytes);
}
