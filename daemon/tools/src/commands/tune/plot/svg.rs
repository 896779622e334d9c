//! The plot as an SVG document.

use super::{Anchor, Canvas, Colour};

/// An SVG document under construction.
#[derive(Debug)]
pub struct Svg {
    text: String,
}

impl Svg {
    pub fn new(width: u32, height: u32) -> Self {
        let head = format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\"");
        let font = "font-family=\"sans-serif\" font-size=\"15\"";
        let text = format!("{head} {font}>\n<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n");
        Self { text }
    }

    pub fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }
}

fn hex([r, g, b]: Colour) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

impl Canvas for Svg {
    fn line(&mut self, (x1, y1): (f64, f64), (x2, y2): (f64, f64), width: f64, colour: Colour) {
        let colour = hex(colour);
        let ends = format!("x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"");
        self.text.push_str(&format!("<line {ends} stroke=\"{colour}\" stroke-width=\"{width}\"/>\n"));
    }

    fn disc(&mut self, (x, y): (f64, f64), radius: f64, colour: Colour) {
        let colour = hex(colour);
        self.text.push_str(&format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{colour}\"/>\n"));
    }

    fn ring(&mut self, (x, y): (f64, f64), radius: f64, colour: Colour) {
        let style = format!("fill=\"none\" stroke=\"{}\" stroke-width=\"2\"", hex(colour));
        self.text.push_str(&format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" {style}/>\n"));
    }

    fn text(&mut self, (x, y): (f64, f64), anchor: Anchor, colour: Colour, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let text = text.replace('&', "&amp;").replace('<', "&lt;");
        let style = format!("text-anchor=\"{anchor}\" fill=\"{}\" dominant-baseline=\"central\"", hex(colour));
        self.text.push_str(&format!("<text x=\"{x:.1}\" y=\"{y:.1}\" {style}>{text}</text>\n"));
    }
}
