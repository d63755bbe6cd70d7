#![no_main]

fuzz::target!("sound_wav");
