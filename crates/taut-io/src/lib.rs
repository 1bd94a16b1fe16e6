//! taut-io
