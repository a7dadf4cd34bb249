//! Which channels of an EXR file are its picture.

use ::exr::meta::header::Header;
use exr::prelude as exr;

/// The channels of a picture: three, or one where it is grey.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    /// What it is called: the text before its channels' last point, else its part's name; may be empty.
    name: String,
    /// Channels without a point before them.
    top: bool,
    pub part: Option<exr::Text>,
    pub channels: Vec<Vec<u8>>,
}

/// The layer, and what there is to say of the choice.
pub(super) struct Choice {
    pub layer: Layer,
    pub remark: Option<String>,
}

/// Names of red, green and blue.
const COLOURS: [[&str; 3]; 3] = [["R", "G", "B"], ["r", "g", "b"], ["red", "green", "blue"]];

fn layers(headers: &[Header], sets: &[&[&str]]) -> Vec<Layer> {
    let mut found = Vec::new();
    for header in headers.iter().filter(|h| !h.deep) {
        let names: Vec<String> =
            header.channels.list.iter().map(|c| String::from_utf8_lossy(c.name.as_slice()).into_owned()).collect();
        let part = header.own_attributes.layer_name.clone();
        let mut prefixes: Vec<&str> = names.iter().map(|n| &n[..n.rfind('.').map_or(0, |at| at + 1)]).collect();
        prefixes.sort_unstable();
        prefixes.dedup();
        for prefix in prefixes {
            let has = |name: &str| names.iter().any(|n| n.strip_prefix(prefix) == Some(name));
            // X and Z beside Y are a direction or a colour of another kind, not a grey.
            let Some(set) =
                sets.iter().find(|set| set.iter().all(|n| has(n)) && (set.len() > 1 || !(has("X") || has("Z"))))
            else {
                continue;
            };
            let own = part.as_ref().map(|p| String::from_utf8_lossy(p.as_slice()).into_owned());
            found.push(Layer {
                name: if prefix.is_empty() { own.unwrap_or_default() } else { prefix.trim_end_matches('.').into() },
                top: prefix.is_empty(),
                part: part.clone(),
                channels: set.iter().map(|name| format!("{prefix}{name}").into_bytes()).collect(),
            });
        }
    }
    found
}

/// The picture: R, G and B, else those of the only layer that has them, else a luminance Y alone. With `wanted`, that layer.
/// An error is a text, empty where there are no such channels.
pub(super) fn choose(headers: &[Header], wanted: Option<&str>) -> Result<Choice, String> {
    let colours: Vec<&[&str]> = COLOURS.iter().map(|set| set.as_slice()).collect();
    for sets in [colours, vec![["Y"].as_slice()]] {
        let found = layers(headers, &sets);
        let grey = (sets.len() == 1).then_some("it has no colours but a luminance (Y), and is taken as grey");
        if let Some(wanted) = wanted {
            // A part of that name comes after channels of that name.
            let mut named = found.iter().filter(|layer| layer.name == wanted);
            if let Some(layer) = named.clone().find(|layer| !layer.top).or_else(|| named.next()) {
                return Ok(Choice { layer: layer.clone(), remark: grey.map(String::from) });
            }
            continue;
        }
        let names = |layers: &[&Layer]| {
            let names: Vec<String> = layers.iter().map(|layer| format!("`{}`", layer.name)).collect();
            names.join(", ")
        };
        let top: Vec<&Layer> = found.iter().filter(|layer| layer.top).collect();
        let (layer, remark) = match (top.as_slice(), found.as_slice()) {
            ([only], _) => (*only, None),
            ([first, ..], _) => {
                let all = names(&top);
                (
                    *first,
                    Some(format!("it holds {} pictures ({all}); `{}`, the first, is taken", top.len(), first.name)),
                )
            }
            ([], [only]) => (only, Some(format!("its layer `{}` is taken, the only one with a picture", only.name))),
            ([], []) => continue,
            ([], several) => {
                let all = names(&several.iter().collect::<Vec<_>>());
                return Err(format!(
                    "it has no channels R, G, B, but {} layers that do: {all}; name one (layer = \"...\" in [environment], --layer \
                     of `marmor diff`), or save it alone",
                    several.len()
                ));
            }
        };
        let remark: Vec<String> = remark.into_iter().chain(grey.map(String::from)).collect();
        return Ok(Choice { layer: layer.clone(), remark: (!remark.is_empty()).then(|| remark.join("; ")) });
    }
    Err(String::new())
}
