//! `ground effects`: what a unit may have and its description may lack.
//!
//! In: the library's own pages ([`twin::effect::Page`]), and for `--with` the trials' disturbances. Out: text or JSON: what each effect is, its
//! parameters with unit and usual size, what makes it show, what it is mistaken for, how to confirm it, and whether and
//! where `ground fly --with` lets it strike. That physics is the trials' own and shares no equation with the library.

use std::{fmt::Write, sync::Arc};

use trials::{followed::Follower, scene::Scene, strike};
use twin::{
    effect::{LIBRARY, Page},
    environment::Environment,
    motion,
    plant::Views,
    truth::TruthSource,
};

/// Columns of a screen.
const WIDTH: usize = 110;

/// \[s\] of the scene that is struck to learn what a disturbance acts on.
const SCENE_S: f64 = 60.0;

/// Lists the effects that a unit may have: what, sizes, how each shows, how to confirm it
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:\n  ground effects\n  ground effects gyro-scale\n  ground effects mag")]
pub struct EffectsArguments {
    /// Only effects whose name holds this
    #[arg(value_name = "NAME")]
    pub name: Option<String>,
    /// Print them as JSON
    #[arg(long)]
    pub json: bool,
}

/// Nothing of this name.
#[derive(Debug, thiserror::Error)]
#[error("no effect's name holds \"{0}\"; `ground effects` lists all")]
pub struct NoEffect(String);

/// Runs `ground effects`.
///
/// # Errors
/// When no effect has such a name.
pub fn effects(arguments: &EffectsArguments) -> Result<String, NoEffect> {
    let wanted = arguments.name.as_deref().unwrap_or_default();
    let pages = LIBRARY.iter().map(|effect| effect.page());
    let pages: Vec<&Page> = pages.filter(|page| page.name.contains(wanted)).collect();
    match (pages.is_empty(), arguments.json) {
        (true, _) => Err(NoEffect(wanted.to_owned())),
        (false, true) => Ok(format!(
            "{:#}\n",
            serde_json::Value::from_iter(pages.into_iter().map(listed))
        )),
        (false, false) => Ok(pages.into_iter().map(told).collect()),
    }
}

/// The page for programs, under the names that the text has.
fn listed(page: &Page) -> serde_json::Value {
    let sizes = page.parameters.iter().map(|symbol| {
        serde_json::json!({
            "name": symbol.name,
            "unit": symbol.unit,
            "usual": symbol.prior_sigma,
            "signed": symbol.signed,
        })
    });
    serde_json::json!({
        "name": page.name,
        "what": page.physics,
        "equation": page.equation,
        "size": serde_json::Value::from_iter(sizes),
        "source": page.source,
        "shows": page.excited_by,
        "mistaken": page.siblings,
        "confirm": page.confirm_by,
        "with": with(page.name),
    })
}

fn told(page: &Page) -> String {
    let mut text = format!("{}\n", page.name);
    let mut line = |name: &str, words: &str| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}", wrapped(&format!("    {name:9} {words}")));
    };
    line("what", page.physics);
    line("equation", page.equation);
    let sizes: Vec<String> = (page.parameters.iter())
        .map(|symbol| {
            let sign = if symbol.signed { "+-" } else { "" };
            let unit = if symbol.unit == "1" { "" } else { symbol.unit };
            format!("{} {sign}{} {unit}", symbol.name, symbol.prior_sigma)
                .trim_end()
                .to_owned()
        })
        .collect();
    let sizes = if sizes.is_empty() {
        "there or not".to_owned()
    } else {
        sizes.join(", ")
    };
    line("size", &format!("usually {sizes} ({})", page.source));
    line("shows", &format!("in {}", page.excited_by));
    if !page.siblings.is_empty() {
        line("mistaken", &format!("for {}", page.siblings.join(", ")));
    }
    line("confirm", page.confirm_by);
    line("--with", &with(page.name));
    text.push('\n');
    text
}

/// What `--with` does.
fn with(name: &str) -> String {
    match strike::acts_on(name, &scene) {
        None => "no: the trials have no law of their own for it".to_owned(),
        Some(strike::ActsOn::Registers) if strike::is_warm(name) => {
            "yes, in what the parts convert; needs a motion with a temperature that changes".to_owned()
        }
        Some(strike::ActsOn::Registers) => "yes, in what the parts convert".to_owned(),
        Some(strike::ActsOn::Packets) => {
            "yes, in the packets on their way to the file, not in the registers".to_owned()
        }
        Some(strike::ActsOn::Reference) => "yes, in motion.csv or case.toml: the reference is what is wrong".to_owned(),
    }
}

fn scene() -> Scene {
    let site = Environment::laboratory();
    let world = motion::world_by_name("tumble");
    let motion: Arc<dyn motion::Motion> = world.map_or(Arc::new(motion::Still::level()), |world| world.motion);
    let source: Arc<dyn TruthSource> = Arc::new(twin::environment::World {
        motion: motion.clone(),
        environment: site,
    });
    let followed = Follower::new(motion, SCENE_S);
    Scene::of(Arc::new(followed), SCENE_S, site, Views::of(&source))
}

/// Longer lines go on in the next, indented as far as the words begin.
fn wrapped(line: &str) -> String {
    let (mut out, mut width) = (String::new(), 0);
    for (at, word) in line.split(' ').enumerate() {
        let length = word.chars().count();
        if at > 0 && width + 1 + length > WIDTH {
            out.push_str("\n              ");
            width = 14;
        } else if at > 0 {
            out.push(' ');
            width += 1;
        }
        out.push_str(word);
        width += length;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_is_listed_with_all_that_is_to_be_known() {
        let text = effects(&EffectsArguments {
            name: None,
            json: false,
        })
        .expect("all of them");
        for effect in LIBRARY {
            let page = effect.page();
            assert!(text.contains(&format!("{}\n    what", page.name)), "{}", page.name);
        }
        assert_eq!(text.matches("    confirm ").count(), LIBRARY.len());
        // Each has a way to be flown but the law of fibre-optic gyros.
        assert_eq!(text.matches("--with    no").count(), 1);
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
    }

    #[test]
    fn a_name_narrows_the_list_and_a_strange_one_is_refused() {
        let text = effects(&EffectsArguments {
            name: Some("hard-iron".into()),
            json: false,
        })
        .expect("one");
        assert_eq!(text.matches("    what").count(), 1);
        assert!(
            effects(&EffectsArguments {
                name: Some("softiron".into()),
                json: false,
            })
            .is_err()
        );
    }
}
