#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| lamp_tests::hostile::variants(bytes));
