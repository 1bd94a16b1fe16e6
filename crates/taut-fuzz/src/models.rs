//! Files of fitted models are refused, or carry paths and fields.

use serde::Deserialize;
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::{Atlas, Header, Model, ModelChart};
use taut_io::read_json_lines;

use crate::clouds::{check_field, check_path};
use crate::readers::in_file;

/// The first line of a model's file, as far as it matters here.
#[derive(Deserialize)]
struct FirstLine {
    #[serde(rename = "atlas")]
    header: Header,
}

pub fn model(bytes: &[u8]) {
    let read = in_file(".taut", bytes, |file| {
        read_json_lines::<FirstLine, ModelChart>(file, "fit it again")
    });
    match read {
        Ok((first, charts)) => through(&Model {
            header: first.header,
            charts,
        }),
        Err(error) => assert!(error.to_string().contains(".taut"), "{error}"),
    }
}

/// A model's surface, a path and a field on it.
pub fn through(model: &Model) {
    let Ok(atlas) = Atlas::<3>::from_model(model) else {
        return;
    };
    let nodes = atlas.nodes();
    assert_eq!(nodes.len(), model.charts.len());
    let geodesics = Geodesics::of_atlas(atlas);
    let surface = geodesics.surface();
    let (first, last) = (nodes[0], nodes[nodes.len() - 1]);
    let centre = surface.cloud().centre;
    if let (Ok(from), Ok(to)) = (
        surface.node_near(&(first.point + centre)),
        surface.node_near(&(last.point + centre)),
    ) {
        check_path(&geodesics, &from, &to);
        check_field(&geodesics, &from, None);
    }
}
