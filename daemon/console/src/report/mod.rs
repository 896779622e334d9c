//! The report of a dive: what a record of the surface says, as one page that needs no other file.

mod archive;
mod areas;
mod chart;
mod dive;
mod doubts;
mod effects;
mod extent;
mod floor_figure;
mod frames;
mod gaps;
mod images;
mod in_force;
mod link;
mod log;
mod map_cells;
mod map_figure;
mod maps;
mod order_step;
mod orders;
mod page;
mod read;
mod restart;
mod round_trip;
mod settings;
mod summary;
mod times;
mod track;
mod track_point;
mod trouble;
mod uncertainty;
mod way;
mod words;

pub use dive::Dive;

use scenecast_messages::builtin_interfaces::Time;
use scenecast_surface::Reply;
use std::path::PathBuf;

/// The content type of a report.
pub(crate) const HTML: &str = "text/html; charset=utf-8";

/// The report of the records of a mission, which may go on.
pub fn report_reply(records: &[PathBuf]) -> Reply {
    if records.is_empty() {
        return Reply::Refused("this mission is not recorded (record.enabled)".to_owned());
    }
    match Dive::read(records) {
        Ok(mut dive) => {
            // The chunk that is being written is no damage.
            dive.damage = None;
            Reply::File(HTML, dive.html().into_bytes())
        }
        Err(error) => Reply::Refused(error.to_string()),
    }
}

use std::fmt;

fn seconds(nanos: u64) -> f64 {
    nanos as f64 / 1e9
}

/// A time of a message, seconds since 1970.
fn unix_s(time: &Time) -> f64 {
    time.nanos() as f64 / 1e9
}

/// Displays a text as part of HTML: special characters escaped, control and invisible characters left out.
struct Escaped<'a>(&'a str);

impl fmt::Display for Escaped<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for character in self.0.chars() {
            match character {
                '&' => f.write_str("&amp;")?,
                '<' => f.write_str("&lt;")?,
                '>' => f.write_str("&gt;")?,
                '"' => f.write_str("&quot;")?,
                // Characters that nobody sees, or that turn the direction of the text.
                c if c.is_control()
                    || matches!(c, '\u{200B}'..='\u{200F}' | '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}') => {}
                c => write!(f, "{c}")?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_from_outside_are_no_html() {
        let text = Escaped("<script>a & \"b\"</script>\u{202E}\u{7}").to_string();
        assert_eq!(text, "&lt;script&gt;a &amp; &quot;b&quot;&lt;/script&gt;");
    }
}
