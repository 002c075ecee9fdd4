//! Places of a firmware image that may panic: calls of the functions that end in the panic handler.
//!
//! In: an ELF file with symbols, for a Cortex-M. Out: the calls of those functions from code that is not one of
//! them: where, and which. Every instruction is looked at: mapping symbols tell code from data (ELF for the Arm architecture 5.5.5), a first
//! halfword tells 16 from 32 bits (ARMv7-M ARM, A5.1), and a call is BL or a branch B.W, B (A7.7.12, A7.7.18). A call
//! through a pointer is not seen; none of these functions is called so.

use std::collections::{BTreeMap, BTreeSet};

use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};

/// In the mangled name of a function that panics: `core::panicking`, and what stands before it for options, results, slices,
/// `RefCell`s and libraries that log.
const PANICS: [&str; 6] = [
    "4core9panicking",
    "panic_already",
    "unwrap_failed",
    "expect_failed",
    "index_fail",
    "_defmt_panic",
];

/// A call of a function that panics.
pub struct Call {
    /// Its address.
    pub at: u64,
    /// The function's own name.
    pub of: String,
}

/// The calls of functions that panic.
pub fn calls(file: &object::File) -> object::read::Result<Vec<Call>> {
    let mut panics = BTreeMap::new();
    let mut functions = BTreeMap::new();
    // Where code begins and where data does.
    let mut maps = BTreeMap::new();
    for symbol in file.symbols() {
        let (Ok(name), address) = (symbol.name(), symbol.address() & !1) else {
            continue;
        };
        match name.get(..2) {
            Some("$t") => _ = maps.insert(symbol.address(), true),
            Some("$d") => _ = maps.insert(symbol.address(), false),
            _ if symbol.kind() == SymbolKind::Text => {
                functions.insert(address, symbol.size());
                if is_panic(name) {
                    panics.insert(address, own_name(name));
                }
            }
            _ => {}
        }
    }
    let inside: BTreeSet<u64> = panics.keys().copied().collect();
    let is_inside = |at: u64| {
        let function = functions.range(..=at).next_back();
        function.is_some_and(|(start, size)| at < start + size && inside.contains(start))
    };
    let mut calls = Vec::new();
    for section in file
        .sections()
        .filter(|section| section.kind() == object::SectionKind::Text)
    {
        for (at, target) in branches(section.address(), section.data()?, &maps) {
            if let Some(of) = panics.get(&target)
                && !is_inside(at)
            {
                calls.push(Call { at, of: of.clone() });
            }
        }
    }
    Ok(calls)
}

fn is_panic(name: &str) -> bool {
    PANICS.iter().any(|part| name.contains(part))
}

/// The last identifier of a mangled path: in both manglings each stands behind its length.
fn own_name(mangled: &str) -> String {
    let mut found = mangled;
    let mut before = ' ';
    for (at, first) in mangled.char_indices() {
        let is_inside = std::mem::replace(&mut before, first).is_ascii_digit();
        if is_inside || !first.is_ascii_digit() {
            continue;
        }
        let digits: String = mangled[at..].chars().take_while(char::is_ascii_digit).collect();
        let rest = mangled[at + digits.len()..].trim_start_matches('_');
        let length: usize = digits.parse().unwrap_or(0);
        let hash = length == 17 && rest.starts_with('h');
        if length > 2
            && !hash
            && let Some(identifier) = rest.get(..length)
        {
            found = identifier;
        }
    }
    found.into()
}

/// Branches that name their target, with where they stand.
fn branches(base: u64, code: &[u8], maps: &BTreeMap<u64, bool>) -> Vec<(u64, u64)> {
    let half = |at: u64| -> Option<u32> {
        let at = usize::try_from(at - base).ok()?;
        Some(u16::from_le_bytes(*code.get(at..)?.first_chunk()?).into())
    };
    let mut found = Vec::new();
    let mut at = base;
    while let Some(first) = half(at) {
        let is_code = maps.range(..=at).next_back().is_none_or(|(_, code)| *code);
        let is_wide = first >> 11 > 0b11100;
        if !is_code {
            at += 2;
            continue;
        }
        let second = if is_wide { half(at + 2).unwrap_or(0) } else { 0 };
        if let Some(offset) = offset(first, second) {
            found.push((at, at.wrapping_add(4).wrapping_add_signed(offset)));
        }
        at += if is_wide { 4 } else { 2 };
    }
    found
}

/// What a branch adds to the address four bytes behind it.
fn offset(first: u32, second: u32) -> Option<i64> {
    let signed = |value: u32, bits: u32| i64::from((value << (32 - bits)) as i32 >> (32 - bits));
    match (first >> 11, second >> 14, second >> 12 & 1) {
        // B, encoding T2.
        (0b11100, ..) => Some(signed((first & 0x7FF) << 1, 12)),
        // BL and B.W: encodings T1 and T4.
        (0b11110, 0b11 | 0b10, 1) => {
            let sign = first >> 10 & 1;
            let [i1, i2] = [13, 11].map(|bit| !(second >> bit ^ sign) & 1);
            let offset = sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3FF) << 12 | (second & 0x7FF) << 1;
            Some(signed(offset, 25))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As `llvm-mc` encodes them.
    #[test]
    fn calls_and_branches_are_found_and_data_is_passed_over() {
        // 0: bl +0x100 (to 0x104); 4: b.w -8 (to 0); 8: nop; 10: b . (to 10); 12: a word that looks like BL.
        let code = [
            0x00, 0xF0, 0x80, 0xF8, 0xFF, 0xF7, 0xFC, 0xBF, 0x00, 0xBF, 0xFE, 0xE7, 0x00, 0xF0, 0x80, 0xF8,
        ];
        let maps = BTreeMap::from([(0x1000, true), (0x100C, false)]);
        assert_eq!(
            branches(0x1000, &code, &maps),
            [(0x1000, 0x1104), (0x1004, 0x1000), (0x100A, 0x100A)]
        );
    }

    #[test]
    fn a_function_is_called_by_its_own_name_in_both_manglings() {
        let v0 = "_RNvNtNtCs7ldSeZOOJos_4core9panicking11panic_const24panic_const_add_overflow";
        assert_eq!(own_name(v0), "panic_const_add_overflow");
        let legacy = "_ZN4core9panicking18panic_bounds_check17h0123456789abcdefE";
        assert_eq!(own_name(legacy), "panic_bounds_check");
        assert_eq!(own_name("_defmt_panic"), "_defmt_panic");
        assert!(is_panic(v0) && is_panic(legacy) && !is_panic("_RNvCs_5emems3run"));
    }
}
