//! How the light of one translucent object is cached and gathered: its budget, what is known before the first pass, and the
//! way of a pass.

use super::{
    Balance, Cache, CacheBuilder, CachedBody, CachedSample, Columns, Density, Detail, Directions, Envelope,
    GatherPoint, Gatherer, NearField, Scratch, Seen, Survey, Tuning,
};
use crate::bssrdf::{Entry, Exit, Partition};
use crate::error::Result;
use crate::light::Lights;
use crate::math::{DVec3, Rgb, Vec3};
use crate::optics::Medium;
use crate::sampling::{CacheStream, Points, Turn};
use crate::scene::{EntrySampling, Estimator, Scene, Shape, Spread, View};
use crate::tally::{Clock, Tally};
use std::sync::OnceLock;

/// Options of the method `subsurface`.
#[derive(Clone, Copy, Debug)]
pub struct SubsurfaceOptions {
    /// Cached samples per pass and translucent object.
    pub cache_samples: u32,
    /// How the sum over the cache is estimated.
    pub estimator: Estimator,
    /// The largest share of the sum that one node of a `cut` may be wrong by; by the noise of the cache if absent.
    pub cut_error: Option<f32>,
    /// How directions of entering light are picked.
    pub entry: EntrySampling,
    /// What numbers pick the points on the surface.
    pub points: Points,
    /// How the points are spread over the surface.
    pub spread: Spread,
    /// Whether smooth surfaces mirror lights and environment.
    pub specular: bool,
    /// Whether light scattered once is added to models that leave it out.
    pub single: bool,
    /// Samples of each kind of light per diffuse point.
    pub light_samples: u32,
    /// Surfaces that light may go over on its way to a body and between bodies; 0: straight from the lights alone.
    pub bounces: u32,
    /// What decides how much light leaves where.
    pub shape: Shape,
    /// Seed of the render.
    pub seed: u64,
}

impl Default for SubsurfaceOptions {
    fn default() -> Self {
        let estimator = Estimator::Cut;
        Self {
            cache_samples: estimator.default_samples(),
            estimator,
            cut_error: None,
            entry: EntrySampling::Light,
            points: Points::Sobol,
            spread: Spread::Seen,
            specular: true,
            single: true,
            light_samples: 1,
            bounces: u32::MAX,
            shape: Shape::HalfSpace,
            seed: 0,
        }
    }
}

impl SubsurfaceOptions {
    /// The same where paths through the body say how much leaves: what is left to the sum needs fewer samples.
    fn under_walks(&self) -> Self {
        Self { cache_samples: (self.cache_samples / SHARE_UNDER_WALKS).max(1), ..*self }
    }

    /// Whether sums may be cut in a near part and the rest, and exits share work; the lecture's law takes the cache alone, exit
    /// by exit.
    pub fn splits(&self) -> bool {
        matches!(self.estimator, Estimator::All | Estimator::Cut | Estimator::Cluster)
    }
}

/// Of the samples asked for, one in so many is cached where walks bring what the others would.
const SHARE_UNDER_WALKS: u32 = 4;
/// A sum over the cached samples whose relative variance would be above this, if they were independent, gets a near field.
const NOISY: f64 = 1.0 / 8.0;
/// Radius of the near field in distances between cached samples.
const NEAR_RADIUS: f32 = 3.0;
/// Relative variance that the cache may add to a near field: the fewest samples that keep to it are taken.
const FAR_NOISE: f64 = 2e-3;
/// Where the cache adds less than this, the near field is made smaller.
const FAR_NOTHING: f64 = 1e-5;
/// A cache beside a near field has at least so many samples.
const FEWEST: u32 = 4096;
/// Sums below this share of what is typical for the object are held to the accuracy of one of this size.
const DARK: f32 = 0.1;
/// A cut whose nodes may be wrong by a share e adds a relative variance of about 0.001 e: with this factor a third of the
/// cache's.
const CUT_SHARE: f64 = 300.0;
/// The finest cut.
const FINEST: f64 = 0.01;
/// The coarsest cut.
const COARSEST: f64 = 0.2;

/// The light of one body of the world.
pub struct Plan {
    options: SubsurfaceOptions,
    /// The body, by its model.
    pub body: CachedBody,
    medium: Medium,
    envelope: Envelope,
    directions: Directions,
    /// Of even passes and of odd ones.
    streams: [CacheStream; Turn::STREAMS],
    /// For media whose light does not come as far as the next sample of the cache.
    pub near: Option<NearField>,
    /// Cached samples a pass.
    pub samples: u32,
    survey: OnceLock<Survey>,
    balance: OnceLock<Option<Balance>>,
}

impl Plan {
    /// Of object number `object`; `None` where it is not translucent or has no area. `walked`: paths through the body say how much leaves where.
    ///
    /// # Errors
    /// A translucent material whose model does not exist for its medium.
    pub fn new(
        scene: &Scene,
        lights: &Lights,
        object: u32,
        walked: bool,
        options: SubsurfaceOptions,
    ) -> Result<Option<Self>> {
        let (Some(t), Some(_)) = (&scene.surface(object).inside, scene.body(object)) else { return Ok(None) };
        let (model, options) = if walked { (t.model_under_walks(), options.under_walks()) } else { (t.model, options) };
        let Some(body) = CachedBody::new(scene, object, model.build(&t.medium, &t.options())?) else { return Ok(None) };
        let envelope = Envelope::new(&*body.model, &t.medium);
        let streams = Turn::seeds(options.seed).map(|seed| CacheStream::new(options.points, seed, object.into()));
        let directions = match options.entry {
            EntrySampling::Light => Directions::Lights { cosine_share: lights.cosine_share(body.body.bounds) },
            EntrySampling::Cosine => Directions::Cosine,
        };
        let (near, samples) = near_field(&envelope, body.table().area(), &options);
        let (survey, balance) = (OnceLock::new(), OnceLock::new());
        let medium = t.medium;
        Ok(Some(Self { options, body, medium, envelope, directions, streams, near, samples, survey, balance }))
    }

    /// The object's medium.
    pub fn medium(&self) -> &Medium {
        &self.medium
    }

    /// What samples this object, by the numbers of `stream`.
    pub fn builder<'a>(
        &'a self,
        view: View<'a>,
        lights: &'a Lights,
        stream: &'a CacheStream,
        density: &'a Density,
    ) -> CacheBuilder<'a> {
        CacheBuilder { view, lights, body: &self.body, directions: self.directions, stream, density }
    }

    /// What is known before the first pass, from the points of the object that the camera sees. A function of scene and seed: the
    /// same for any pass that asks first.
    pub fn survey(&self, view: View<'_>, lights: &Lights, seen: &[Seen]) {
        self.survey.get_or_init(|| {
            // With directions by the cosine most trials would miss the lights.
            let blind = self.options.entry == EntrySampling::Cosine || self.options.estimator == Estimator::Notes;
            if blind || seen.is_empty() {
                return Survey::none();
            }
            let stream = CacheStream::new(self.options.points, !self.options.seed, self.body.object().into());
            let even = Density::even();
            let builder = self.builder(view, lights, &stream, &even);
            Survey::new(&builder, &self.envelope, seen, self.options.spread, self.samples)
        });
    }

    /// Fills the cache of pass number `pass` with light straight from the lights.
    pub fn fill(&self, view: View<'_>, lights: &Lights, pass: u32, tally: &mut Tally) -> Cache {
        let turn = Turn::of(self.options.seed, pass);
        let builder = self.builder(view, lights, &self.streams[turn.stream], self.density());
        let first = u64::from(turn.number) * u64::from(self.samples);
        let start = std::time::Instant::now();
        let mut cache = builder.fill(first, self.samples, tally);
        tally.clock.fill += start.elapsed().as_secs_f64();
        let all = cache.lit.len();
        cache.lit.retain(CachedSample::is_finite);
        tally.gather.non_finite += (all - cache.lit.len()) as u64;
        tally.gather.samples += u64::from(self.samples);
        tally.gather.lit += cache.lit.len() as u64;
        cache
    }

    /// From here on sums are balanced by what `make` gives, the first time.
    pub fn balanced_by(&self, make: impl FnOnce() -> Option<Balance>) {
        // Not while it is made: that takes sums as they are.
        if self.balance.get().is_none() {
            let _ = self.balance.set(make());
        }
    }

    /// Where samples are spent, as the survey says.
    pub fn density(&self) -> &Density {
        &self.survey.get_or_init(Survey::none).density
    }

    /// Makes a cache of pass number `pass` ready for gathering.
    pub fn ready(&self, cache: Cache, pass: u32, tally: &mut Tally) -> Gatherer {
        let tuning = self.tuning(self.survey.get_or_init(Survey::none), pass);
        let ready = || Gatherer::new(self.options.estimator, cache, &*self.body.model, tuning);
        Clock::time(&mut tally.clock.tree, ready)
    }

    /// How fine the sums of pass number `pass` are.
    fn tuning(&self, survey: &Survey, pass: u32) -> Tuning {
        let passes = f64::from(pass) + 1.0;
        let noise2 = survey.noise2(passes * f64::from(self.samples));
        // Draws of a cut are new in each pass, and average as its number; the cache's stream goes on and averages faster.
        let error = self.options.cut_error.unwrap_or((CUT_SHARE * passes * noise2).clamp(FINEST, COARSEST) as f32);
        Tuning {
            error,
            floor: DARK * survey.typical,
            partition: self.near.as_ref().map_or(Partition::NONE, |near| near.rest),
        }
    }

    /// The sum over the cache at each of `points`, balanced, into `sums`.
    pub fn sum(
        &self,
        cache: (&Gatherer, Detail),
        points: &[GatherPoint],
        scratch: &mut Scratch,
        tally: &mut Tally,
        sums: &mut Vec<Rgb>,
    ) {
        self.unbalanced_sum(cache, points, scratch, tally, sums);
        self.balance(points, sums);
    }

    /// [`Self::sum`] as the model has it.
    pub(super) fn unbalanced_sum(
        &self,
        (gatherer, detail): (&Gatherer, Detail),
        points: &[GatherPoint],
        scratch: &mut Scratch,
        tally: &mut Tally,
        sums: &mut Vec<Rgb>,
    ) {
        let exits: Vec<Exit> = points.iter().map(|p| p.exit).collect();
        let keys: Vec<u64> = points.iter().map(|p| p.stream.key()).collect();
        let kernel = (&*self.body.model, &self.envelope);
        Clock::time(&mut tally.clock.gather, || {
            gatherer.gather(kernel, (&exits, detail), &keys, scratch, &mut tally.gather, sums);
        });
    }

    fn balance(&self, points: &[GatherPoint], sums: &mut [Rgb]) {
        if let Some(Some(balance)) = self.balance.get() {
            points.iter().zip(sums).for_each(|(p, sum)| *sum = *sum * balance.at(p.place, p.exit.n));
        }
    }

    /// What the near part of light that leaves at a place with normal `n` is multiplied by.
    pub fn balance_at(&self, place: DVec3, n: Vec3) -> Rgb {
        self.balance.get().and_then(Option::as_ref).map_or(Rgb::WHITE, |balance| balance.at(place, n))
    }

    /// ∫∫ S_d T12 L_i cosθ_i dω dA at each of `points`, into `sums`.
    pub fn gather(
        &self,
        (view, lights): (View<'_>, &Lights),
        cache: (&Gatherer, Detail),
        points: &[GatherPoint],
        scratch: &mut Scratch,
        tally: &mut Tally,
        sums: &mut Vec<Rgb>,
    ) {
        self.unbalanced_sum(cache, points, scratch, tally, sums);
        if let Some(near) = &self.near {
            let even = Density::even();
            near.add(&self.builder(view, lights, &self.streams[0], &even), points, tally, sums);
        }
        self.balance(points, sums);
    }
}

impl Plan {
    /// What the near part of S_d leaves of light that enters by `sample`, whose own place is nowhere, and leaves by `exit`, the way
    /// from the exit to the entry being `way` [unit]: radiance under the boundary for a flux, not balanced.
    pub fn near_part(&self, near: &NearField, exit: &Exit, sample: &CachedSample, way: Vec3, tally: &mut Tally) -> Rgb {
        let model = &*self.body.model;
        let moved = CachedSample { entry: Entry { x: way, ..sample.entry }, ..*sample };
        let mut columns = Columns::new(model.layout());
        columns.refill(model, std::iter::once(&moved));
        let mut value = [[0.0; 3]];
        tally.gather.clamped += columns.sum(model, &[Exit { x: Vec3::ZERO, ..*exit }], near.partition, &mut value);
        Rgb::from_fn(|c| value[0][c] as f32)
    }
}

/// The near field that `count` or fewer cached samples on a surface of `area` [unit²] need, and how many they then are.
/// Both follow from how fast S_d falls; the lecture's estimators have none.
fn near_field(envelope: &Envelope, area: f64, options: &SubsurfaceOptions) -> (Option<NearField>, u32) {
    let most = options.cache_samples;
    let apart2 = |samples: u32| area / f64::from(samples.max(1));
    let noise = |samples, part| apart2(samples) * envelope.variance_per_area(part);
    let cosine = options.entry == EntrySampling::Cosine;
    if !options.splits() || cosine || noise(most, Partition::NONE) <= NOISY {
        return (None, most);
    }
    let radius = |samples| NEAR_RADIUS * apart2(samples).sqrt() as f32;
    let mut samples = FEWEST.min(most);
    while samples < most && noise(samples, Partition::beyond(radius(samples))) > FAR_NOISE {
        samples = samples.saturating_mul(2).min(most);
    }
    // Short lines meet fewer surfaces that do not matter.
    let mut radius = radius(samples);
    while noise(samples, Partition::beyond(0.7 * radius)) <= FAR_NOTHING {
        radius *= 0.7;
    }
    (Some(NearField::new(envelope, radius)), samples)
}
