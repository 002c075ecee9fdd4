//! One source file with all its mutants in it, each asleep until the environment names it (mutant schemata: Untch, Offutt and
//! Harrold, "Mutation analysis using mutant schemata", ISSTA 1993).
//!
//! `a + b` becomes `match (a, b) { (l, r) => if on(7) { l - r } else { l + r } }`, a function's value an early `return`, a match arm
//! that is deleted a guard. Operators are changed in the tree, where cargo-mutants changes the text: `a + b + c` with its second
//! `+` a `*` is `(a + b) * c` here and `a + b * c` there.
//!
//! Comments mark what belongs to which mutant, so that an error of the compiler tells which one cannot be: `/*<7*/ l - r /*7>*/`.
//!
//! Not woven: what is evaluated by the compiler (`const`, `static`, lengths), and a place that is assigned to (`a[i + 1] += b`).

use std::collections::{BTreeMap, BTreeSet, HashMap};

use proc_macro2::LineColumn;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{BinOp, Block, Expr, UnOp};

use crate::list::{Mutant, Place};

/// The text with its mutants, and the numbers of those that are in it.
pub struct Woven {
    /// The text.
    pub text: String,
    /// The mutants in it.
    pub mutants: BTreeSet<usize>,
}

/// Weaves `mutants` (number and mutant) into `text`, without those `left` out and keeping the functions in `keep` const.
///
/// # Errors
/// When the text is no Rust.
pub fn woven(
    text: &str,
    mutants: &[(usize, &Mutant)],
    left: &BTreeSet<usize>,
    keep: &BTreeSet<String>,
) -> Result<Woven, String> {
    let tree = syn::parse_file(text).map_err(|error| error.to_string())?;
    let mut starts = vec![0];
    starts.extend(text.match_indices('\n').map(|(at, _)| at + 1));
    let mut at: HashMap<(String, Place), Vec<(usize, String)>> = HashMap::new();
    for (number, mutant) in mutants.iter().filter(|(number, _)| !left.contains(number)) {
        let key = (mutant.genre.clone(), mutant.at);
        at.entry(key).or_default().push((*number, mutant.replacement.clone()));
    }
    let mut weaver = Weaver {
        text,
        starts,
        at,
        keep,
        edits: Vec::new(),
        depth: 0,
        mutants: BTreeSet::new(),
    };
    weaver.visit_file(&tree);
    let mutants = std::mem::take(&mut weaver.mutants);
    Ok(Woven {
        text: weaver.written(),
        mutants,
    })
}

/// The innermost mutant at the byte `at` of a woven text; else the mutants of the innermost place that was changed there.
pub fn blamed(text: &str, at: usize) -> (Option<usize>, Vec<usize>) {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = 0;
    while let Some(begin) = text[rest..at].find("/*").map(|found| rest + found) {
        let Some(end) = text[begin..].find("*/").map(|found| begin + found) else {
            break;
        };
        let mark = &text[begin + 2..end];
        if mark.starts_with(['<', '(']) {
            open.push(mark);
        } else if mark.ends_with(['>', ')']) && mark.trim_end_matches(['>', ')']).parse::<usize>().is_ok() {
            open.pop();
        }
        rest = (end + 2).min(at);
    }
    let numbers = |mark: &str| {
        mark[1..]
            .split(',')
            .filter_map(|one| one.parse().ok())
            .collect::<Vec<usize>>()
    };
    match open.last() {
        Some(mark) if mark.starts_with('<') => (numbers(mark).first().copied(), Vec::new()),
        Some(mark) => (None, numbers(mark)),
        None => (None, Vec::new()),
    }
}

struct Edit {
    at: usize,
    end: usize,
    text: String,
    depth: usize,
    closes: bool,
}

struct Weaver<'a> {
    text: &'a str,
    starts: Vec<usize>,
    at: HashMap<(String, Place), Vec<(usize, String)>>,
    keep: &'a BTreeSet<String>,
    edits: Vec<Edit>,
    depth: usize,
    mutants: BTreeSet<usize>,
}

impl Weaver<'_> {
    fn byte(&self, place: LineColumn) -> usize {
        let start = self.starts[place.line - 1];
        let line = &self.text[start..];
        start + line.char_indices().nth(place.column).map_or(line.len(), |(at, _)| at)
    }

    fn range(&self, of: &impl Spanned) -> (usize, usize) {
        let span = of.span();
        (self.byte(span.start()), self.byte(span.end()))
    }

    fn raw(&self, of: &impl Spanned) -> &str {
        let (start, end) = self.range(of);
        &self.text[start..end]
    }

    /// The mutants of a genre that begin where `of` does; they count as woven.
    fn take(&mut self, genre: &str, of: &impl Spanned) -> Vec<(usize, String)> {
        let start = of.span().start();
        let found = self
            .at
            .remove(&(genre.to_string(), (start.line, start.column + 1)))
            .unwrap_or_default();
        self.mutants.extend(found.iter().map(|(number, _)| *number));
        found
    }

    fn open(&mut self, at: usize, end: usize, text: String) {
        self.edits.push(Edit {
            at,
            end,
            text,
            depth: self.depth,
            closes: false,
        });
    }

    fn close(&mut self, at: usize, text: String) {
        self.edits.push(Edit {
            at,
            end: at,
            text,
            depth: self.depth,
            closes: true,
        });
    }

    fn written(mut self) -> String {
        self.edits.sort_by_key(|edit| {
            let depth = edit.depth as isize;
            (edit.at, !edit.closes, if edit.closes { -depth } else { depth })
        });
        let (mut text, mut from) = (String::new(), 0);
        for edit in &self.edits {
            if edit.at > from {
                text += &self.text[from..edit.at];
            }
            text += &edit.text;
            from = from.max(edit.end).max(edit.at);
        }
        text + &self.text[from..]
    }

    fn body(&mut self, block: &Block) {
        let Some(first) = block.stmts.first() else { return };
        let found = self.take("FnValue", first);
        let at = self.range(first).0;
        let returns = |(number, value): &(usize, String)| {
            format!("if crate::mutants::on({number}) {{ return /*<{number}*/ {value} /*{number}>*/; }} ")
        };
        self.open(at, at, found.iter().map(returns).collect());
    }

    fn binary(&mut self, binary: &syn::ExprBinary) {
        let found = self.take("BinaryOperator", &binary.op);
        let (start, left_end) = self.range(&*binary.left);
        let (right_start, end) = self.range(&*binary.right);
        let op = self.raw(&binary.op).to_string();
        let assigns = op.ends_with('=') && !["==", "!=", "<=", ">="].contains(&op.as_str());
        let marks = marks(&found);
        let last = found.first().map_or(0, |(number, _)| *number);
        let either = |with: &dyn Fn(&str) -> String| {
            let mut text = BTreeMap::new();
            for (number, other) in &found {
                text.insert(
                    number,
                    format!(
                        "if crate::mutants::on({number}) {{ /*<{number}*/ {} /*{number}>*/ }} else ",
                        with(other)
                    ),
                );
            }
            format!("{}{{ {} }}", text.into_values().collect::<String>(), with(&op))
        };
        if assigns {
            let place = self.raw(&*binary.left).to_string();
            let text = either(&|op| format!("{place} {op} r;"));
            self.open(start, right_start, format!("(match {marks}("));
            self.close(end, format!(") {{ r => {{ {text} }} }} /*{last})*/)"));
        } else if matches!(binary.op, BinOp::And(_) | BinOp::Or(_)) {
            let on = format!("crate::mutants::on({last})");
            let same = if op == "&&" { on } else { format!("!{on}") };
            self.open(start, start, format!("(match {marks}("));
            self.open(
                left_end,
                right_start,
                format!(") {{ l => if l == {same} {{ l }} else {{ "),
            );
            self.close(end, format!(" }} }} /*{last})*/)"));
        } else {
            let compares = ["==", "!=", "<=", ">=", "<", ">"].contains(&op.as_str());
            let (borrow, star) = if compares { ("&", "*") } else { ("", "") };
            let text = either(&|op| format!("{star}l {op} {star}r"));
            self.open(start, start, format!("(match {marks}({borrow}("));
            self.open(left_end, right_start, format!("), {borrow}("));
            self.close(end, format!(")) {{ (l, r) => {text} }} /*{last})*/)"));
        }
    }
}

fn marks(found: &[(usize, String)]) -> String {
    let numbers: Vec<String> = found.iter().map(|(number, _)| number.to_string()).collect();
    format!("/*({}*/", numbers.join(","))
}

fn has_let(expr: &Expr) -> bool {
    match expr {
        Expr::Let(_) => true,
        Expr::Binary(binary) => has_let(&binary.left) || has_let(&binary.right),
        _ => false,
    }
}

impl<'ast> Visit<'ast> for Weaver<'_> {
    fn visit_item_const(&mut self, _: &'ast syn::ItemConst) {}
    fn visit_impl_item_const(&mut self, _: &'ast syn::ImplItemConst) {}
    fn visit_trait_item_const(&mut self, _: &'ast syn::TraitItemConst) {}
    fn visit_item_static(&mut self, _: &'ast syn::ItemStatic) {}
    fn visit_type(&mut self, _: &'ast syn::Type) {}
    fn visit_pat(&mut self, _: &'ast syn::Pat) {}
    fn visit_generics(&mut self, _: &'ast syn::Generics) {}
    fn visit_item_enum(&mut self, _: &'ast syn::ItemEnum) {}
    fn visit_macro(&mut self, _: &'ast syn::Macro) {}
    fn visit_path(&mut self, _: &'ast syn::Path) {}
    fn visit_expr_const(&mut self, _: &'ast syn::ExprConst) {}

    fn visit_expr_repeat(&mut self, repeat: &'ast syn::ExprRepeat) {
        self.visit_expr(&repeat.expr);
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.function(&item.sig, &item.block, |weaver| visit::visit_block(weaver, &item.block));
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        self.function(&item.sig, &item.block, |weaver| visit::visit_block(weaver, &item.block));
    }

    fn visit_trait_item_fn(&mut self, item: &'ast syn::TraitItemFn) {
        if let Some(block) = &item.default {
            self.function(&item.sig, block, |weaver| visit::visit_block(weaver, block));
        }
    }

    fn visit_expr_binary(&mut self, binary: &'ast syn::ExprBinary) {
        let start = binary.op.span().start();
        let key = ("BinaryOperator".to_string(), (start.line, start.column + 1));
        let lets = has_let(&binary.left) || has_let(&binary.right);
        let found = self.at.contains_key(&key) && !lets;
        let assigns = self.raw(&binary.op).ends_with('=')
            && !matches!(binary.op, BinOp::Eq(_) | BinOp::Ne(_) | BinOp::Le(_) | BinOp::Ge(_));
        if found {
            self.binary(binary);
        }
        self.depth += 1;
        if !(found && assigns) {
            self.visit_expr(&binary.left);
        }
        self.visit_expr(&binary.right);
        self.depth -= 1;
    }

    fn visit_expr_unary(&mut self, unary: &'ast syn::ExprUnary) {
        if !matches!(unary.op, UnOp::Deref(_)) {
            let found = self.take("UnaryOperator", &unary.op);
            if let Some((number, _)) = found.first() {
                let op = self.raw(&unary.op).to_string();
                let (at, (start, end)) = (self.range(&unary.op).0, self.range(&*unary.expr));
                self.open(at, start, format!("(match /*({number}*/("));
                let text =
                    format!("if crate::mutants::on({number}) {{ /*<{number}*/ x /*{number}>*/ }} else {{ {op}x }}");
                self.close(end, format!(") {{ x => {text} }} /*{number})*/)"));
            }
        }
        self.depth += 1;
        self.visit_expr(&unary.expr);
        self.depth -= 1;
    }

    /// A match of whose arms one may be away is no longer complete without a guess: the compiler blames what is matched.
    fn visit_expr_match(&mut self, matched: &'ast syn::ExprMatch) {
        let arms = matched.arms.iter().filter_map(|arm| {
            let start = arm.span().start();
            self.at.get(&("MatchArm".to_string(), (start.line, start.column + 1)))
        });
        let found: Vec<(usize, String)> = arms.flatten().cloned().collect();
        if let Some((last, _)) = found.first() {
            let (start, end) = self.range(&*matched.expr);
            self.open(start, start, marks(&found));
            self.close(end, format!("/*{last})*/"));
        }
        self.depth += 1;
        self.visit_expr(&matched.expr);
        self.depth -= 1;
        for arm in &matched.arms {
            self.visit_arm(arm);
        }
    }

    fn visit_arm(&mut self, arm: &'ast syn::Arm) {
        let deleted = self.take("MatchArm", arm);
        let absent: String = deleted
            .iter()
            .map(|(number, _)| format!("!crate::mutants::on({number})"))
            .collect();
        match &arm.guard {
            None if !absent.is_empty() => {
                let end = self.range(&arm.pat).1;
                self.close(end, format!(" if {absent}"));
            }
            Some((_, guard)) => {
                let (start, end) = self.range(&**guard);
                let mut text = if absent.is_empty() {
                    String::new()
                } else {
                    format!("{absent} && ")
                };
                text += "(";
                for (number, value) in self.take("MatchArmGuard", &**guard) {
                    let on = format!("crate::mutants::on({number})");
                    text += &if value == "true" {
                        format!("{on} || ")
                    } else {
                        format!("!{on} && ")
                    };
                }
                self.open(start, start, text + "(");
                self.close(end, "))".into());
            }
            None => {}
        }
        self.depth += 1;
        if let Some((_, guard)) = &arm.guard {
            self.visit_expr(guard);
        }
        self.visit_expr(&arm.body);
        self.depth -= 1;
    }

    fn visit_expr_struct(&mut self, made: &'ast syn::ExprStruct) {
        for field in &made.fields {
            let found = made
                .rest
                .as_ref()
                .map(|rest| (self.raw(&**rest).to_string(), self.take("StructField", field)));
            if let Some((rest, found)) = found
                && let Some((number, _)) = found.first()
            {
                let name = self.raw(&field.member).to_string();
                let (start, end) = self.range(&field.expr);
                let colon = if field.colon_token.is_some() {
                    String::new()
                } else {
                    format!("{name}: ")
                };
                let other =
                    format!("if crate::mutants::on({number}) {{ /*<{number}*/ ({rest}).{name} /*{number}>*/ }}");
                self.open(start, start, format!("{colon}({other} else {{ "));
                self.close(end, " })".into());
            }
            self.depth += 1;
            self.visit_expr(&field.expr);
            self.depth -= 1;
        }
        if let Some(rest) = &made.rest {
            self.visit_expr(rest);
        }
    }
}

impl Weaver<'_> {
    fn function(&mut self, signature: &syn::Signature, block: &Block, inside: impl FnOnce(&mut Self)) {
        if let Some(word) = &signature.constness {
            if self.keep.contains(&signature.ident.to_string()) {
                return;
            }
            let (start, end) = self.range(word);
            self.open(start, end, String::new());
        }
        self.body(block);
        self.depth += 1;
        inside(self);
        self.depth -= 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mutant(genre: &str, at: Place, replacement: &str) -> Mutant {
        Mutant {
            name: String::new(),
            file: String::new(),
            genre: genre.into(),
            at,
            replacement: replacement.into(),
        }
    }

    /// The woven text is Rust, has each mutant behind its number, and an error of the compiler at one is blamed on it.
    #[test]
    fn mutants_stand_asleep_in_the_text_and_are_found_there() {
        let text = "fn f(a: u32, b: u32) -> u32 {\n    a + b\n}\n";
        let value = mutant("FnValue", (2, 5), "0");
        let operator = mutant("BinaryOperator", (2, 7), "-");
        let mutants = [(3, &value), (7, &operator)];
        let woven = woven(text, &mutants, &BTreeSet::new(), &BTreeSet::new()).expect("Rust");
        assert_eq!(woven.mutants, BTreeSet::from([3, 7]));
        assert!(syn::parse_file(&woven.text).is_ok(), "{}", woven.text);
        assert!(
            woven
                .text
                .contains("if crate::mutants::on(3) { return /*<3*/ 0 /*3>*/; }")
        );
        assert!(
            woven
                .text
                .contains("if crate::mutants::on(7) { /*<7*/ l - r /*7>*/ } else { l + r }"),
            "{}",
            woven.text
        );
        let at = |what: &str| woven.text.find(what).expect("there");
        assert_eq!(blamed(&woven.text, at("l - r")).0, Some(7));
        assert_eq!(blamed(&woven.text, at("0 /*3>")).0, Some(3));
        assert_eq!(blamed(&woven.text, at("l + r")), (None, vec![7]));
    }

    #[test]
    fn what_is_left_out_is_not_woven() {
        let text = "fn f(a: u32, b: u32) -> u32 {\n    a + b\n}\n";
        let operator = mutant("BinaryOperator", (2, 7), "-");
        let woven = woven(text, &[(7, &operator)], &BTreeSet::from([7]), &BTreeSet::new()).expect("Rust");
        assert!(woven.mutants.is_empty() && woven.text == text);
    }
}
