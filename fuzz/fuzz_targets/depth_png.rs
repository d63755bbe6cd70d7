#![no_main]

fuzz::target!("depth_png");
