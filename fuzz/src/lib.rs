//! Fuzz targets: what must hold whatever comes. `cargo xtask fuzz` runs them under libFuzzer; the tests run them over the kept corpus.
//!
//! Each target is a function of some bytes that panics if the library breaks a promise. Nothing lives on from one call to the next, so each failing
//! input fails alone.

pub mod base;
pub mod flash;
pub mod grammar;
pub mod interpreter;
pub mod invariant;
pub mod lines;
pub mod protocol;
pub mod replies;
pub mod store;
pub mod tick;

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    /// Runs what is kept of a target's inputs; how many there are.
    fn replay(target: &str, run: fn(&[u8])) -> usize {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut count = 0;
        for kind in ["seeds", "corpus"] {
            // Not every target has seeds.
            for entry in fs::read_dir(here.join(kind).join(target))
                .into_iter()
                .flatten()
            {
                let path = entry.unwrap().path();
                println!("{}", path.display());
                run(&fs::read(&path).unwrap());
                count += 1;
            }
        }
        count
    }

    #[test]
    fn kept_lines() {
        assert!(replay("lines", crate::lines::run) > 50);
    }

    #[test]
    fn kept_conversations() {
        assert!(replay("interpreter", crate::interpreter::run) > 50);
    }

    #[test]
    fn kept_saves() {
        assert!(replay("store", crate::store::run) > 20);
    }

    #[test]
    fn kept_ticks() {
        assert!(replay("tick", crate::tick::run) > 50);
    }
}
