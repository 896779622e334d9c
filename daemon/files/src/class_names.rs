//! A file with names and colours of classes.

use scenecast_core::UserError;
use scenecast_labels::{Content, Item, MAX_HEADER_BYTES};
use std::path::Path;

/// Reads a file with names of classes: an item of the kind `classes`, without names.
///
/// # Errors
/// The file cannot be read, or it is another item.
pub fn read_class_names(path: &Path) -> Result<Item, UserError> {
    let header = scenecast_config::read_regular(path, MAX_HEADER_BYTES as u64)?;
    let item = Item::read(header.trim_ascii(), &[]).map_err(|why| UserError::file(path, why))?;
    match item.content {
        Content::Classes => Ok(item),
        _ => Err(UserError::file(path, "it takes the kind \"classes\" alone")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_classes_is_read_or_refused_by_name() {
        let path = std::env::temp_dir().join(format!("scenecast-{}-classes.json", std::process::id()));
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            read_class_names(&path).map(|item| item.classes.len()).map_err(|e| e.to_string())
        };
        let named = r#"{"kind":"classes","classes":[{"class":0,"name":"sand"},{"class":1,"name":"rock"}]}"#;
        assert_eq!(read(&format!("{named}\n")), Ok(2));
        let wrong = read(r#"{"kind":"classes","classes":[{"class":0,"name":""}]}"#).unwrap_err();
        assert!(wrong.contains("-classes.json") && wrong.contains("class 0"), "{wrong}");
        assert!(read("[]").is_err());
        std::fs::remove_file(&path).unwrap();
    }
}
