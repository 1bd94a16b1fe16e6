//! taut-draw
