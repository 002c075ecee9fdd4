//! `ground sbom`: what a program is built from, as a CycloneDX 1.5 bill of materials (ECMA-424) in JSON.
//!
//! In: `cargo tree` of the program's package with the versions of Cargo.lock, and the hashes in Cargo.lock. Out: every
//! package with version, licence, SHA-256 and what it depends on. What is in the program is `required`; what only builds
//! it, macros and build scripts, is `excluded`. The script that stands in every page, which is no package of cargo's, is named
//! beside them. There is no time in it: the same Cargo.lock gives the same bytes. Refuses
//! a package without a hash, because it does not come from a registry.

use std::{
    collections::{BTreeMap, BTreeSet},
    io,
    path::Path,
    process::Command,
};

use serde_json::{Value, json};

/// Prints what the image or this program is built from (CycloneDX 1.5, JSON)
///
/// Asks cargo, in the folder of the sources; run it from there.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  ground sbom image > image.cdx.json\n  ground sbom ground > ground.cdx.json")]
pub struct SbomArguments {
    /// Which program
    #[arg(value_enum)]
    program: Program,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Program {
    /// The firmware
    Image,
    /// The host program
    Ground,
}

/// Why there is no bill.
#[derive(Debug, thiserror::Error)]
pub enum SbomError {
    /// Cargo does not answer.
    #[error("cargo tree: {0}; run it in the folder of the sources")]
    Cargo(String),
    /// Cargo.lock cannot be read.
    #[error("Cargo.lock: {0}; run it in the folder of the sources")]
    Lock(#[from] io::Error),
    /// Cargo.lock is no TOML.
    #[error("Cargo.lock: {0}")]
    Syntax(#[from] toml::de::Error),
    /// A line of cargo that means nothing here.
    #[error("cargo tree said {0:?}, which this program does not know")]
    Line(String),
    /// A package from elsewhere.
    #[error("{0} has no hash in Cargo.lock: it does not come from a registry")]
    NoHash(String),
}

/// Prints the bill.
///
/// # Errors
/// When cargo or Cargo.lock cannot be asked, or a package is not from a registry.
pub fn sbom(arguments: &SbomArguments) -> Result<(), SbomError> {
    let (package, target) = match arguments.program {
        Program::Image => ("emems", "thumbv7em-none-eabihf"),
        Program::Ground => ("emems-ground", "host-tuple"),
    };
    let lock = std::fs::read_to_string(Path::new("Cargo.lock"))?;
    let within = tree(package, target, "normal,no-proc-macro")?;
    let builds = tree(package, target, "normal,build")?;
    let mut bill = bill(&within, &builds, &lock)?;
    if let (Program::Ground, Some(components)) = (arguments.program, bill["components"].as_array_mut()) {
        components.push(uplot());
    }
    println!("{bill:#}");
    Ok(())
}

/// What every page with plots has in it.
fn uplot() -> Value {
    let version = chart::page::UPLOT_VERSION;
    json!({
        "type": "library", "bom-ref": format!("pkg:npm/uplot@{version}"), "purl": format!("pkg:npm/uplot@{version}"),
        "name": "uplot", "version": version, "scope": "required", "licenses": [{"expression": "MIT"}],
        "hashes": [{"alg": "SHA-256", "content": chart::page::uplot_sha256()}],
    })
}

fn tree(package: &str, target: &str, edges: &str) -> Result<String, SbomError> {
    let mut cargo = Command::new("cargo");
    cargo.args(["tree", "--locked", "--prefix", "depth", "--format", "\t{p}\t{l}"]);
    cargo.args(["--package", package, "--target", target, "--edges", edges]);
    let output = cargo.output().map_err(|error| SbomError::Cargo(error.to_string()))?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(SbomError::Cargo(
            String::from_utf8_lossy(&output.stderr).trim().to_owned(),
        ))
    }
}

/// Name and version.
type Package = (String, String);

#[derive(Default)]
struct Tree {
    root: Option<Package>,
    licences: BTreeMap<Package, String>,
    own: BTreeSet<Package>,
    needs: BTreeMap<Package, BTreeSet<Package>>,
}

/// Lines of `depth TAB name vVERSION (note) TAB licence`, and ` (*)` after what was said before.
fn read(text: &str) -> Result<Tree, SbomError> {
    let mut tree = Tree::default();
    let mut above: Vec<Package> = Vec::new();
    for line in text.lines().filter(|line| !line.is_empty()) {
        let strange = || SbomError::Line(line.to_owned());
        let mut parts = line.trim_end_matches(" (*)").split('\t');
        let (Some(depth), Some(package), Some(licence)) = (parts.next(), parts.next(), parts.next()) else {
            return Err(strange());
        };
        let depth: usize = depth.parse().map_err(|_| strange())?;
        let mut words = package.split(' ');
        let (Some(name), Some(version)) = (words.next(), words.next().and_then(|word| word.strip_prefix('v'))) else {
            return Err(strange());
        };
        let package = (name.to_owned(), version.to_owned());
        // A path stands after a package of this workspace, `(proc-macro)` after a macro.
        if words.any(|word| word.starts_with("(/") || word.contains(":\\")) {
            tree.own.insert(package.clone());
        }
        above.truncate(depth);
        match above.last() {
            Some(parent) => drop(tree.needs.entry(parent.clone()).or_default().insert(package.clone())),
            None => tree.root = Some(package.clone()),
        }
        tree.licences.insert(package.clone(), licence.replace('/', " OR "));
        above.push(package);
    }
    Ok(tree)
}

fn hashes(lock: &str) -> Result<BTreeMap<Package, String>, SbomError> {
    let lock: toml::Table = lock.parse()?;
    let packages = lock
        .get("package")
        .and_then(toml::Value::as_array)
        .into_iter()
        .flatten();
    let text = |package: &toml::Value, key: &str| package.get(key).and_then(toml::Value::as_str).map(str::to_owned);
    Ok(packages
        .filter_map(|package| {
            let key = (text(package, "name")?, text(package, "version")?);
            Some((key, text(package, "checksum")?))
        })
        .collect())
}

fn reference((name, version): &Package) -> String {
    format!("pkg:cargo/{name}@{version}")
}

/// The bill of a program: `within` is what is in it, `builds` that and what builds it.
fn bill(within: &str, builds: &str, lock: &str) -> Result<Value, SbomError> {
    let (within, builds, hashes) = (read(within)?, read(builds)?, hashes(lock)?);
    let root = builds.root.clone().ok_or_else(|| SbomError::Line(String::new()))?;
    let mut components = Vec::new();
    for (package, licence) in builds.licences.iter().filter(|(package, _)| **package != root) {
        let scope = if within.licences.contains_key(package) {
            "required"
        } else {
            "excluded"
        };
        let mut component = json!({
            "type": "library", "bom-ref": reference(package), "name": package.0, "version": package.1, "scope": scope,
            "licenses": [{"expression": licence}],
        });
        if !builds.own.contains(package) {
            let hash = hashes
                .get(package)
                .ok_or_else(|| SbomError::NoHash(reference(package)))?;
            component["purl"] = json!(reference(package));
            component["hashes"] = json!([{"alg": "SHA-256", "content": hash}]);
        }
        components.push(component);
    }
    let dependencies: Vec<Value> = builds
        .needs
        .iter()
        .map(|(package, needs)| {
            json!({"ref": reference(package), "dependsOn": needs.iter().map(reference).collect::<Vec<_>>()})
        })
        .collect();
    Ok(json!({
        "bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1,
        "metadata": {"component": {
            "type": "application", "bom-ref": reference(&root), "name": root.0, "version": root.1,
        }},
        "components": components,
        "dependencies": dependencies,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const WITHIN: &str = "0\temems v0.1.0 (/somewhere)\tMIT OR Apache-2.0\n1\tcrc v3.4.0\tMIT/Apache-2.0\n\
                          1\tpacked v0.1.0 (/somewhere/packed)\tMIT\n2\tcrc v3.4.0\tMIT/Apache-2.0 (*)\n";
    const LOCK: &str = "[[package]]\nname = \"crc\"\nversion = \"3.4.0\"\nchecksum = \"ab12\"\n\
                        [[package]]\nname = \"syn\"\nversion = \"2.0.1\"\nchecksum = \"cd34\"\n";

    #[test]
    fn every_package_has_its_version_licence_hash_and_scope() {
        let builds = format!("{WITHIN}1\tsyn v2.0.1 (proc-macro)\tMIT\n");
        let bill = bill(WITHIN, &builds, LOCK).expect("a bill");
        let components = bill["components"].as_array().expect("components");
        let said: Vec<_> = components
            .iter()
            .map(|component| ["name", "version", "scope"].map(|key| component[key].as_str().unwrap_or_default()))
            .collect();
        assert_eq!(
            said,
            [
                ["crc", "3.4.0", "required"],
                ["packed", "0.1.0", "required"],
                ["syn", "2.0.1", "excluded"]
            ]
        );
        assert_eq!(components[0]["licenses"][0]["expression"], "MIT OR Apache-2.0");
        assert_eq!(components[0]["hashes"][0]["content"], "ab12");
        assert_eq!(components[1].get("hashes"), None, "it is of this workspace");
        assert_eq!(bill["metadata"]["component"]["name"], "emems");
        let needs = &bill["dependencies"][1];
        assert_eq!(
            (&needs["ref"], &needs["dependsOn"][0]),
            (&json!("pkg:cargo/packed@0.1.0"), &json!("pkg:cargo/crc@3.4.0"))
        );
        assert!(!bill.to_string().contains("somewhere"), "a path of this machine");
    }

    #[test]
    fn a_package_that_is_not_from_a_registry_is_refused() {
        let text = "0\temems v0.1.0 (/somewhere)\tMIT\n1\tcrc v9.9.9 (https://git/crc#1)\tMIT\n";
        let error = bill(text, text, LOCK).expect_err("no hash");
        assert!(
            error.to_string().starts_with("pkg:cargo/crc@9.9.9 has no hash"),
            "{error}"
        );
        assert!(matches!(bill("x\ty\tz\n", "", LOCK), Err(SbomError::Line(_))));
    }
}
