//! What `scenecast scene run` labels, and how.

use crate::scene::Intrinsics;
use clap::{Args, ValueEnum};
use scenecast_core::Takes;
use std::path::PathBuf;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Labels {
    /// The topics of visual words, as in the paper
    Topics,
    /// Cells that look alike over all their images, as on the vehicle
    Habitats,
}

/// The input: words, a mosaic or a sequence of images.
#[derive(Debug, Args)]
pub(super) struct Input {
    #[command(flatten)]
    pub(super) which: Which,
    /// Poses of a frames source, as of scenecast scene register [default: poses.csv of its folder]
    #[arg(long, value_name = "FILE.csv", requires = "source")]
    pub(super) poses: Option<PathBuf>,
    /// Size of a pixel on the ground, mosaic and frames [default: 0.01]
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub(super) metres_per_pixel: Option<f64>,
    /// Topics: vocabulary of scenecast vocabulary train, for images
    #[arg(long, value_name = "FILE", conflicts_with = "words")]
    pub(super) vocabulary: Option<PathBuf>,
    /// Number of different words in a words file [default: largest id + 1]
    #[arg(long, value_name = "V", requires = "words", value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(super) vocabulary_size: Option<u32>,
    /// Camera of a tum source, pixels [default: 525,525,319.5,239.5 at a width of 640]
    #[arg(long, value_name = "FX,FY,CX,CY", requires = "source")]
    pub(super) intrinsics: Option<Intrinsics>,
    /// Depth units per metre of a tum source
    #[arg(long, value_name = "N", default_value_t = 5000.0, allow_negative_numbers = true)]
    pub(super) depth_scale: f64,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub(super) struct Which {
    /// Words at places: lines t,x,y,z,w1,w2,... (seconds, metres, word ids)
    #[arg(long, value_name = "FILE.csv")]
    pub(super) words: Option<PathBuf>,
    /// Image of the ground; its top left corner is the origin
    #[arg(long, value_name = "IMG")]
    pub(super) mosaic: Option<PathBuf>,
    /// tum:DIR: an RGB-D sequence with rgb.txt, depth.txt and groundtruth.txt;
    /// frames:DIR: downward images and poses.csv; bag:FILE or bag:FILE#TOPIC: images and odometry in MCAP
    #[arg(long, value_name = "KIND:PLACE")]
    pub(super) source: Option<String>,
}

/// Parameters of the labels, with which a scene model begins.
#[derive(Debug, Args)]
pub(super) struct Parameters {
    /// Topics: prior count of each label in each cell [default: 0.01]
    #[arg(long, allow_negative_numbers = true)]
    pub(super) alpha: Option<f64>,
    /// Topics: prior count of each word under each label [default: 0.1]
    #[arg(long, allow_negative_numbers = true)]
    pub(super) beta: Option<f64>,
    /// Topics: weight of a new label [default: 0.0001]
    #[arg(long, allow_negative_numbers = true)]
    pub(super) gamma: Option<f64>,
    /// Topics: interpretation of gamma: literal (gamma), collapsed (gamma / V) or rost (alpha gamma / V) [default: literal]
    #[arg(long, value_parser = ["literal", "collapsed", "rost"])]
    pub(super) birth: Option<String>,
    /// Maximum number of labels at a time
    #[arg(long, value_name = "K", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=254))]
    pub(super) max_labels: u32,
    /// Topics: seed of every random choice
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(super) seed: u64,
}

/// Edges of a cell in x, y, z, metres; `z` is `None` if one number was given for all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Edges {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) z: Option<f64>,
}

pub(super) fn edges(text: &str) -> Result<Edges, Takes> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|field| field.trim().parse().ok()).collect();
    let numbers = numbers.filter(|all| all.iter().all(|edge| (1e-6..=1e6).contains(edge)));
    match numbers.as_deref() {
        Some(&[edge]) => Ok(Edges { x: edge, y: edge, z: None }),
        Some(&[x, y, z]) => Ok(Edges { x, y, z: Some(z) }),
        _ => Err(Takes("it takes metres from 0.000001 to 1000000, one number or three as in 0.5,0.5,1")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_has_one_edge_or_three() {
        assert_eq!(edges("0.5"), Ok(Edges { x: 0.5, y: 0.5, z: None }));
        assert_eq!(edges("1, 2,3"), Ok(Edges { x: 1.0, y: 2.0, z: Some(3.0) }));
        for wrong in ["", "0", "-1", "nan", "1,2", "1,2,3,4", "inf"] {
            assert!(edges(wrong).is_err(), "{wrong}");
        }
    }
}
