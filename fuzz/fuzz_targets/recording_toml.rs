#![no_main]

fuzz::target!("recording_toml");
