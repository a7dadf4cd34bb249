//! `marmor render --pixel x,y --pass n`: one sample again, with what it met.

use super::setup::Prepared;
use marmor::Result;
use marmor::integrator::View;
use marmor::render::{self, Job};
use marmor::sampling::{PixelStream, Turn};
use marmor::words::counted;
use std::process::ExitCode;

/// Prints the sample, its ray and the first thing it meets.
pub fn run(prepared: &Prepared, view: View<'_>, job: &Job<'_>, pixel: [u32; 2], pass: u32) -> Result<ExitCode> {
    let [x, y] = pixel;
    let [width, height] = view.scene.camera.resolution;
    if x >= width || y >= height {
        let what = format!("--pixel {x},{y} is not in the picture of {width}x{height} pixels");
        return Err(marmor::Error::usage(what));
    }
    let (radiance, tally) = render::replay(&prepared.method, view, job, pixel, pass);
    let turn = Turn::of(job.seed, pass);
    let number = u64::from(y) * u64::from(width) + u64::from(x);
    let ray = view.scene.camera.ray(pixel, PixelStream::new(turn.seed, number, turn.number).next_2d());
    println!("pixel {x},{y}, pass {pass}, seed {}: radiance {:?}", job.seed, radiance.0);
    println!("ray from {:?} towards {:?}", ray.origin.to_array(), ray.direction.to_array());
    match view.rays.closest(&ray) {
        None => println!("meets nothing"),
        Some(hit) => {
            let object = &view.scene.objects[hit.mesh as usize];
            let at = object.mesh.point(hit.triangle, hit.u, hit.v);
            println!(
                "meets object {:?}, triangle {} at ({}, {}), t {}: point {:?}, normal {:?}",
                object.name,
                hit.triangle,
                hit.u,
                hit.v,
                hit.t,
                at.x.to_array(),
                at.n.to_array()
            );
        }
    }
    let gather = tally.gather;
    println!(
        "cache of the pass: {}, {} with light, {} left out as not finite; {} of S_d clamped at this pixel",
        counted(gather.samples, "sample", "samples"),
        gather.lit,
        gather.non_finite,
        counted(gather.clamped, "value", "values")
    );
    Ok(ExitCode::SUCCESS)
}
