//! The Markdown pages of the project, read as far as the tests of the documents need.

use crate::workspace;
use clap::error::ErrorKind;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

pub struct Page {
    /// Path from the project's folder.
    pub path: PathBuf,
    pub text: String,
}

impl Page {
    /// The blocks between fences, each with the language behind its first fence.
    pub fn blocks(&self) -> Vec<(String, String)> {
        let parts = self.text.split("\n```").skip(1).step_by(2);
        parts.filter_map(|p| p.split_once('\n')).map(|(tag, body)| (tag.to_owned(), body.to_owned())).collect()
    }

    /// The text outside of the blocks.
    pub fn prose(&self) -> String {
        self.text.split("\n```").step_by(2).collect::<Vec<_>>().join("\n")
    }

    /// The anchors of the headings, as common hosts make them.
    pub fn anchors(&self) -> BTreeSet<String> {
        let prose = self.prose();
        let headings = prose.lines().filter(|l| l.starts_with('#'));
        headings.filter_map(|l| l.trim_start_matches('#').strip_prefix(' ').map(anchor)).collect()
    }

    /// The spans of code in the prose, each on one line.
    pub fn code(&self) -> Vec<String> {
        let prose = self.prose();
        let spans = prose.split("\n\n").flat_map(|paragraph| paragraph.split('`').skip(1).step_by(2));
        spans.map(|span| span.split_whitespace().collect::<Vec<_>>().join(" ")).collect()
    }

    /// Command lines in blocks for a shell, without comments, with continued lines joined.
    pub fn command_lines(&self) -> Vec<String> {
        let shell = self.blocks().into_iter().filter(|(tag, _)| tag == "sh" || tag == "console");
        let joined = shell.map(|(tag, body)| (tag, body.replace("\\\n", " ")));
        let lines = joined.flat_map(|(tag, body)| {
            let lines = body.lines().filter(|l| tag == "sh" || l.starts_with("$ "));
            lines.map(|l| uncommented(l.trim_start_matches("$ "))).collect::<Vec<_>>()
        });
        lines.filter(|l| !l.is_empty()).collect()
    }
}

fn uncommented(line: &str) -> String {
    let code = if line.starts_with('#') { "" } else { line.split(" #").next().unwrap_or_default() };
    code.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The words of a command line; quotes hold words together, and a redirection ends them.
pub fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quote = None;
    for c in line.chars() {
        match c {
            '\'' | '"' if quote.is_none() => quote = Some(c),
            _ if Some(c) == quote => quote = None,
            ' ' if quote.is_none() => words.push(String::new()),
            _ => words.last_mut().expect("there is a word").push(c),
        }
    }
    words.into_iter().take_while(|w| w != ">").collect()
}

/// The arguments of `program` in a command line, if it is one; `cargo run` runs `scenecast` unless `-p` names another.
pub fn arguments(program: &str, line: &str) -> Option<Vec<String>> {
    let words = words(line);
    let (named, behind) = match words.first()?.as_str() {
        "cargo" if words.get(1).is_some_and(|word| word == "run") => {
            let dashes = words.iter().position(|w| w == "--")?;
            let package = words.windows(2).find(|pair| pair[0] == "-p").map_or("scenecast", |pair| &pair[1]);
            (package, dashes + 1)
        }
        first => (first, 1),
    };
    (named == program).then(|| words[behind..].to_vec())
}

/// The faults of the command lines of a program on all pages: one in a block must parse; one in prose may lack what it
/// needs to run, but has no flag that does not exist.
pub fn command_faults<P: clap::Parser>(program: &str) -> Vec<String> {
    let error = |line: &str| {
        let arguments = arguments(program, line)?;
        P::try_parse_from(std::iter::once(program.to_owned()).chain(arguments)).err()
    };
    let wrong = [ErrorKind::UnknownArgument, ErrorKind::InvalidSubcommand];
    let mut faults = Vec::new();
    for page in pages() {
        let of_blocks = page.command_lines().into_iter().map(|line| (error(&line), line));
        let of_prose = page.code().into_iter().map(|span| (error(&span).filter(|e| wrong.contains(&e.kind())), span));
        for (error, line) in of_blocks.chain(of_prose) {
            faults.extend(error.map(|e| format!("{}: {line}\n{e}", page.path.display())));
        }
    }
    faults
}

fn files_below(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(dir).expect("a folder can be read").flatten() {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        let is_own = !["target", "node_modules", ".git"].contains(&name.as_str());
        match path.is_dir() {
            true if is_own => files_below(&path, found),
            true => (),
            false => found.push(path),
        }
    }
}

/// Every file of the project, in order of its path.
pub fn all_files() -> Vec<PathBuf> {
    let mut found = Vec::new();
    files_below(&workspace(), &mut found);
    found.sort();
    found
}

/// Every Markdown file of the project.
pub fn all_pages() -> Vec<Page> {
    let markdown = all_files().into_iter().filter(|f| f.extension().is_some_and(|e| e == "md"));
    let page = |f: PathBuf| Page {
        text: std::fs::read_to_string(&f).expect("a page can be read"),
        path: f.strip_prefix(workspace()).expect("below the project's folder").to_owned(),
    };
    markdown.map(page).collect()
}

/// The pages for users and contributors; the changelog tells of names that are no more.
pub fn pages() -> Vec<Page> {
    let top = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "SECURITY.md", "RELEASING.md"];
    let all = all_pages().into_iter();
    all.filter(|p| p.path.starts_with("docs") || top.iter().any(|t| p.path == Path::new(t))).collect()
}

/// The anchor that a heading has on common hosts.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().to_lowercase().replace(' ', "-");
    kept.chars().filter(|c| c.is_alphanumeric() || *c == '-' || *c == '_').collect()
}
