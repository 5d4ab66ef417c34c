//! No code branches on an effect's name: as a string it stands in the effect's own file and nowhere else.
#![cfg(feature = "identify")]
#![allow(clippy::unwrap_used)]

use gpi_core::effects::CATALOGUE;
use std::fs;
use std::path::{Path, PathBuf};

/// String literals that equal an effect's name and mean something else: an option, and a residual test.
const OTHER_MEANINGS: [(&str, &str); 4] = [
    ("identify/quasi_static.rs", "delay"),
    ("explain/residual/outcome.rs", "outliers"),
    ("explain/residual/wrong_samples.rs", "outliers"),
    ("explain/residual/simulated.rs", "outliers"),
];

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let below = |path: PathBuf| if path.is_dir() { sources(&path) } else { vec![path] };
    entries.flat_map(below).collect()
}

/// The string literals of a file, without comments and tests.
fn literals(source: &str) -> Vec<String> {
    let code = source.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
    let code = lines.collect::<Vec<_>>().join("\n").replace("\\\"", "").replace("'\"'", "");
    code.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn an_effects_name_stands_in_its_own_file_alone() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for path in sources(&root) {
        let place = path.strip_prefix(&root).unwrap().to_str().unwrap().replace('\\', "/");
        for literal in literals(&fs::read_to_string(&path).unwrap()) {
            let own = format!("effects/{}.rs", literal.replace('-', "_"));
            let is_name = CATALOGUE.iter().any(|entry| entry.name == literal);
            let is_meant = place == own || OTHER_MEANINGS.contains(&(&place, &literal));
            assert!(!is_name || is_meant, "src/{place} names the effect {literal:?}");
        }
    }
}

#[test]
fn literals_are_found() {
    let source =
        "//! \"a\"\nlet x = \"drift\"; let y = ['\"', \"b\"];\n#[cfg(test)]\nmod tests { \"c\" }";
    assert_eq!(literals(source), ["drift", "b"]);
}
