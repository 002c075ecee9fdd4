//! What the library says of its effects: every page whole, its kin known, its variants told apart.

use super::*;

#[test]
fn what_is_mistaken_for_another_is_its_kin_whichever_page_says_so() {
    for (one, other) in [("plate-rotation", "plate-flexing"), ("plate-flexing", "plate-rotation")] {
        assert!(kin(one).contains(&other) && kin(one).contains(&one), "{:?}", kin(one));
    }
    assert!(!kin("plate-rotation").contains(&"hard-iron"));
    assert!(kin("no such effect").is_empty());
}

#[test]
fn what_a_variant_says_is_said_and_each_says_another_thing() {
    let starts_s: Vec<f64> = (0..3000).map(|k| 0.2 * f64::from(k)).collect();
    for effect in LIBRARY.iter().filter(|effect| effect.variants(&starts_s).len() > 2) {
        let mut told: Vec<String> = effect
            .variants(&starts_s)
            .into_iter()
            .filter_map(|v| effect.told(v))
            .collect();
        let count = told.len();
        told.sort_unstable();
        told.dedup();
        let name = effect.page().name;
        assert!(count >= 2 && told.len() == count, "{name}: {} of {count}", told.len());
    }
    assert_eq!(by_name("bit-fault").unwrap().told(7.0).unwrap(), "bit 3 is always 1");
    assert_eq!(
        by_name("mag-axis-order").unwrap().told(17.0).unwrap(),
        "x reads -y, y reads x, z reads z"
    );
}

#[test]
fn every_page_is_written_and_its_siblings_exist() {
    for effect in LIBRARY {
        let page = effect.page();
        let texts = [
            page.name,
            page.physics,
            page.equation,
            page.source,
            page.excited_by,
            page.confirm_by,
        ];
        assert!(texts.iter().all(|text| !text.is_empty()), "{}", page.name);
        assert!(!page.sensors.is_empty() && !page.siblings.is_empty(), "{}", page.name);
        assert_eq!(
            LIBRARY.iter().filter(|other| other.page().name == page.name).count(),
            1,
            "{}",
            page.name
        );
        for sibling in page.siblings {
            assert!(
                by_name(sibling).is_some() && *sibling != page.name,
                "{}: {sibling}",
                page.name
            );
        }
        assert!(
            page.nature != Nature::Smooth || !page.parameters.is_empty(),
            "{}",
            page.name
        );
        assert!(
            page.parameters.iter().all(|symbol| symbol.prior_sigma > 0.0),
            "{}",
            page.name
        );
    }
}

#[test]
fn what_a_page_says_of_corrections_and_textures_suits_its_nature() {
    for effect in LIBRARY {
        let page = effect.page();
        let is_spread = page.nature == Nature::Spread;
        assert!(is_spread || page.texture == Texture::Own, "{}", page.name);
        assert!(!is_spread || page.corrected_as.is_none(), "{}", page.name);
    }
    let textures = [Texture::Louder, Texture::Line, Texture::Walk, Texture::Outliers];
    for texture in textures {
        let count = LIBRARY.iter().filter(|effect| effect.page().texture == texture).count();
        assert_eq!(count, 1, "{texture:?}");
    }
}
