//! What is said of paths that came where no light can be.

use crate::scene::{ObstacleKind, Scene};
use crate::tally::{Cause, WalkTally};
use crate::words::{counted, digits, either};

/// A sentence for each object and cause: number, name, cause and remedy.
pub fn lost(walk: &WalkTally, scene: &Scene) -> Vec<String> {
    let (losses, paths) = (&walk.losses, walk.walks);
    let share = |n: u64| format!("{} %", digits(100.0 * n as f64 / paths.max(1) as f64, 2));
    let mut said: Vec<String> = losses
        .each()
        .map(|loss| {
            let name = scene.objects.get(loss.object as usize).map_or("?", |o| o.name.as_str());
            let (n, why) = (loss.paths, why(scene, name, loss.cause));
            format!(
                "{n} of {paths} {} ({}) {} lost at object {name:?}: {why}; they carry nothing",
                either(paths, "path", "paths"),
                share(n),
                either(n, "was", "were")
            )
        })
        .collect();
    if losses.others() > 0 {
        let n = losses.others();
        said.push(format!(
            "{n} of {paths} {} ({}) {} lost at other objects; they carry nothing",
            either(paths, "path", "paths"),
            share(n),
            either(n, "was", "were")
        ));
    }
    said
}

/// Cause and remedy.
fn why(scene: &Scene, name: &str, cause: Cause) -> String {
    match cause {
        Cause::Hole => {
            let edges = scene.objects.iter().find(|o| o.name == name).map_or(0, |o| o.findings.open_edges);
            let edges = counted(edges, "edge belongs", "edges belong");
            format!("they came through holes of its mesh ({edges} to one triangle alone): close them")
        }
        Cause::WrongSide => "they met backs of faces that disagree about the outside: --repair turns faces".into(),
        Cause::Blemish => "its surface passes through itself: a union of the mesh with itself mends that".into(),
        Cause::OtherMedium => {
            let overlaps = |kind: ObstacleKind| {
                matches!(
                    kind,
                    ObstacleKind::Crossing | ObstacleKind::Nested | ObstacleKind::Hidden | ObstacleKind::Touching
                )
            };
            let with = scene.obstacles().iter().filter(|o| overlaps(o.kind) && o.objects.len() == 2);
            let others: Vec<String> = with
                .filter(|o| o.objects.iter().any(|other| other == name))
                .flat_map(|o| o.objects.iter().filter(|other| *other != name))
                .map(|other| format!("{other:?}"))
                .collect();
            if others.is_empty() {
                "they met another medium inside it, put there by rounding: leave a larger gap between the two".into()
            } else {
                format!(
                    "they met {} inside it: move them apart, make one mesh of both, or take --method volume_path",
                    others.join(", ")
                )
            }
        }
        Cause::Endless => {
            "nothing absorbed them on thousands of surfaces in a row: an albedo below 1, some sigma_a or an opening lets them end"
                .into()
        }
        Cause::Rounding => {
            "rounding put them on the other side of its surface: make what is thinnest thicker, or bring \
                            what is far away nearer"
                .into()
        }
    }
}
