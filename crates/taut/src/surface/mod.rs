//! What a surface must answer.
pub mod implicit;
