#![no_main]

fuzz::target!("answer_json");
