#![no_main]

fuzz::target!("mesh_stl");
