#![no_main]

use libfuzzer_sys::fuzz_target;

// The reader turns panics of the crate that unpacks points into errors: only those that get through
// end the program.
fuzz_target!(
    init: std::panic::set_hook(Box::new(|_| {})),
    |bytes: &[u8]| taut_fuzz::run("copies", bytes)
);
