//! The fuzz targets without a fuzzer: over their committed seeds, and over pseudo-random changes of them.

use std::{fs, panic, path::PathBuf};

use eigenmark::simulate::seeded;
use eigenmark_tests::{
    fuzz::{TARGETS, Target, holds_atlas},
    maps::workspace,
};
use rand::{Rng, RngExt};

/// Changed seeds that are tried per target.
const CHANGED: u64 = 20_000;

/// The longest input that a seed grows to.
const MAX_LEN: usize = 2048;

fn seeds(name: &str) -> Vec<Vec<u8>> {
    let directory = workspace().join("tests/fuzz/seeds").join(name);
    let mut paths: Vec<PathBuf> = fs::read_dir(&directory)
        .expect("the seeds are there")
        .map(|entry| entry.expect("readable").path())
        .collect();
    paths.sort();
    let seeds = paths.iter().map(|path| fs::read(path).expect("readable"));
    seeds.collect()
}

/// Changes some bytes, runs and the length of an input.
fn change(input: &mut Vec<u8>, seeds: &[Vec<u8>], random: &mut impl Rng) {
    for _ in 0..random.random_range(1..5) {
        let at = random.random_range(0..=input.len());
        match random.random_range(0..6) {
            0 => input.truncate(at),
            1 => input.insert(at, random.random()),
            2 if at < input.len() => drop(input.remove(at)),
            3 => {
                let other = &seeds[random.random_range(0..seeds.len())];
                input.truncate(at);
                input.extend(&other[at.min(other.len())..]);
            }
            _ => {
                if let Some(byte) = input.get_mut(at) {
                    *byte = match random.random_range(0..4) {
                        0 => *byte ^ 1 << random.random_range(0..8),
                        1 => 0,
                        2 => 255,
                        _ => random.random(),
                    };
                }
            }
        }
    }
    input.truncate(MAX_LEN);
}

/// Runs a target, and says on what input it panicked.
fn attempt(name: &str, target: Target, input: &[u8]) {
    if let Err(panic) = panic::catch_unwind(|| target(input)) {
        println!("{name}: {input:?}");
        panic::resume_unwind(panic);
    }
}

fn run(name: &str, target: Target) {
    let seeds = seeds(name);
    seeds.iter().for_each(|seed| attempt(name, target, seed));
    for number in 0..CHANGED {
        let mut random = seeded(number, 0);
        let mut input = seeds[random.random_range(0..seeds.len())].clone();
        change(&mut input, &seeds, &mut random);
        attempt(name, target, &input);
    }
    println!("{name}: {} seeds, {CHANGED} changed ones", seeds.len());
}

#[test]
fn arbitrary_bytes_break_no_promise() {
    for (name, target) in TARGETS {
        run(name, target);
    }
}

#[test]
fn committed_atlases_are_of_the_present_format() {
    for (number, seed) in seeds("atlas").iter().enumerate() {
        assert!(holds_atlas(seed), "seed {number} in the order of names");
    }
}
