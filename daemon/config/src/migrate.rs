//! Rewriting of files with old names of keys.

use crate::Key;
use crate::load::{line_of, plain};
use crate::move_to_section::{Edit, move_to_section};
use crate::old_keys::{OldKey, as_table};
use scenecast_core::UserError;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A file with the present names of keys.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Migration {
    /// The whole file; comments, order and blanks are those of the old one.
    pub text: String,
    /// One line for each change, for people; empty if nothing had to change.
    pub changes: Vec<String>,
}

/// Gives the keys of a file their present names and forms. `path` is for messages only.
///
/// # Errors
/// A file that is not TOML, that has a key under its old and its new name, or a list that has no new form.
pub fn migrate(path: &Path, text: &str) -> Result<Migration, UserError> {
    let at_line =
        |at: usize, what: String| UserError::Input(format!("{}:{}: {what}", path.display(), line_of(text, at)));
    let table = DeTable::parse(text).map_err(|e| at_line(e.span().map_or(0, |s| s.start), e.message().to_owned()))?;
    let mut migration = Migration { text: text.to_owned(), changes: Vec::new() };
    let mut edits = Vec::new();
    for (section, value) in table.get_ref() {
        let DeValue::Table(keys) = value.get_ref() else { continue };
        for (name, value) in keys {
            let full = format!("{}.{}", section.get_ref(), name.get_ref());
            let at = name.span();
            let line = line_of(text, at.start);
            let renamed = OldKey::find(&full);
            if let Some(OldKey { new, .. }) = renamed {
                let (present, leaf) = new.split_once('.').unwrap_or(("", new));
                let others = table.get_ref().get(present).and_then(|others| others.get_ref().as_table());
                if others.is_some_and(|others| others.contains_key(leaf)) {
                    return Err(at_line(at.start, format!("{full} is now called {new}, which the file has too")));
                }
                if present == section.get_ref() {
                    edits.push(Edit { at: at.clone(), by: leaf.to_owned() });
                } else {
                    let key = at.start..value.span().end;
                    let moved = move_to_section(text, table.get_ref(), &key, at.len(), (present, leaf));
                    let by_hand = || at_line(at.start, format!("{full} is now called {new}: move it to [{present}]"));
                    edits.extend(moved.ok_or_else(by_hand)?);
                }
                migration.changes.push(format!("line {line}: {full} -> {new}"));
            }
            let Some(key) = Key::find(renamed.map_or(&full, |key| key.new)) else { continue };
            if let Some(table) = new_form(key, value).map_err(|what| at_line(at.start, what))? {
                migration.changes.push(format!("line {line}: {} = {table}", key.name));
                edits.extend(replace_list(text, at.start, value.span(), table));
            }
        }
    }
    edits.sort_by_key(|edit| edit.at.start);
    for Edit { at, by } in edits.into_iter().rev() {
        migration.text.replace_range(at, &by);
    }
    Ok(migration)
}

/// The table for a list by position; `None` for a value that has the present form.
fn new_form(key: &Key, value: &Spanned<DeValue<'_>>) -> Result<Option<String>, String> {
    if !key.is_table() || !matches!(value.get_ref(), DeValue::Array(_)) {
        return Ok(None);
    }
    let list = plain(value).and_then(|value| as_table(value.as_array()?, key.name));
    list.map(Some).ok_or_else(|| format!("{} takes {}", key.name, key.allowed()))
}

/// Puts `table` in place of a list; comments within the list move above the line of its key.
fn replace_list(text: &str, key: usize, list: Range<usize>, table: String) -> Vec<Edit> {
    let lines = text.get(list.clone()).unwrap_or_default().lines();
    let comments: String =
        lines.filter_map(|l| l.find('#').and_then(|at| l.get(at..))).map(|c| format!("{c}\n")).collect();
    let line_start = text.get(..key).and_then(|before| before.rfind('\n')).map_or(0, |at| at + 1);
    let above = Edit { at: line_start..line_start, by: comments };
    let value = Edit { at: list, by: table };
    if above.by.is_empty() { vec![value] } else { vec![above, value] }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn migrated(text: &str) -> Result<Migration, String> {
        migrate(Path::new("x.toml"), text).map_err(|e| e.to_string())
    }

    #[test]
    fn names_and_lists_change_and_comments_stay() {
        let old = "# ours\n[link]\n spend = [] # none\nshares = [ 10, 5,\n  5, # fixes\n  60, 20 ]\n\n[map]\n\"planes\" = [\"depth\"]\n\
                   plane_shares = [0, 10, 0]\n";
        let new = "# ours\n[link]\n background = [] # none\n# fixes\nshares = { directive = 10, status = 5, fix = 5, \
                   map = 60, exemplar = 20 }\n\n[map]\nlayers = [\"depth\"]\n\
                   layer_shares = { confidence = 0, depth = 10, curiosity = 0 }\n";
        let migration = migrated(old).unwrap();
        assert_eq!(migration.text, new);
        assert_eq!(migration.changes.len(), 5);
        assert_eq!(migration.changes[0], "line 3: link.spend -> link.background");
        let again = migrated(new).unwrap();
        assert_eq!((again.text.as_str(), again.changes.len()), (new, 0));
    }

    #[test]
    fn a_key_moves_to_its_section_with_its_comments() {
        let old = "[labels]\nvotes = \"all\"\n# Ours.\n# 8 %.\n band_share = 9 # more\n\n[survey]\nspeed_m_s = 1";
        let rest = "[labels]\nvotes = \"all\"\n\n[survey]\nspeed_m_s = 1";
        let new = format!("{rest}\n\n[bands]\n# Ours.\n# 8 %.\n share = 9 # more\n");
        let migration = migrated(old).unwrap();
        assert_eq!((migration.text, migration.changes), (new, vec!["line 5: labels.band_share -> bands.share".into()]));
        let with_section = migrated("[bands] # ours\nranges = []\n[labels]\nband_share = 9").unwrap();
        assert_eq!(with_section.text, "[bands] # ours\nshare = 9\nranges = []\n[labels]\n");
        for by_hand in
            ["labels.band_share = 9\n", "labels = { band_share = 9 }\n", "bands = {}\n[labels]\nband_share = 9\n"]
        {
            let refused = migrated(by_hand).unwrap_err();
            assert!(refused.ends_with("labels.band_share is now called bands.share: move it to [bands]"), "{refused}");
        }
        let refused = migrated("[labels]\nband_share = 9\n[bands]\nshare = 9\n").unwrap_err();
        assert!(refused.starts_with("x.toml:2: ") && refused.ends_with("which the file has too"), "{refused}");
    }

    #[test]
    fn dotted_keys_and_inline_tables_are_found() {
        let migration = migrated("link.spend = []\nmap = { settle_s = 1 }\n").unwrap();
        assert_eq!(migration.text, "link.background = []\nmap = { debounce_s = 1 }\n");
    }

    #[test]
    fn ambiguous_files_are_refused_with_the_line() {
        let refused = migrated("[link]\nspend = []\nbackground = []\n").unwrap_err();
        assert!(refused.starts_with("x.toml:2: link.spend is now called link.background"), "{refused}");
        let refused = migrated("[link]\nshares = [1, 2]\n").unwrap_err();
        assert!(refused.starts_with("x.toml:2: link.shares takes a whole number"), "{refused}");
        assert!(migrated("[link\n").unwrap_err().starts_with("x.toml:1: "));
    }

    #[test]
    fn a_migrated_file_loads_with_the_same_values() {
        let old = "[link]\nshares = [20, 5, 5, 40, 20]\ncall_every_s = 60\n[position]\nmost_sigma_m = 12\n";
        let path = std::env::temp_dir().join(format!("scenecast-migrate-{}.toml", std::process::id()));
        std::fs::write(&path, migrated(old).unwrap().text).unwrap();
        let config = crate::load(Some(&path), &[]).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!(config.link.shares.0, [20, 5, 5, 40, 20]);
        assert_eq!((config.link.discovery_period_s, config.position.max_sigma_m), (60.0, 12.0));
    }
}
