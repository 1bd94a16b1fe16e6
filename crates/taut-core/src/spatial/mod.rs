//! Nearest neighbours; the leaves of the tree are the sparse cells of Algorithm 2.

pub(crate) mod principal;
pub(crate) mod tree;
