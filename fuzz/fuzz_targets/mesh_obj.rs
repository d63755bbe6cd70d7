#![no_main]

fuzz::target!("mesh_obj");
