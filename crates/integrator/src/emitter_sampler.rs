//! Selection of emitters for a point that they light.

use lightshed_lanes::{LANES, Lanes, Vec3Lanes};
use lightshed_lights::ShadingPoint;
use lightshed_sampling::{Density, SolidAngle};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{
    EmitterConnection, EmitterEndpoint, EmitterLanes, EmitterSample, EmittersByPower, EnvironmentChoice,
    SurfacePoint,
};

/// Selects emitters of a scene: every method that samples emitters is generic over it.
///
/// With `p_sel(i | x)` the probability of selecting emitter `i` for the point `x`, and `p_i` the
/// density of sampling it once it is selected, directions have the density `p = p_sel p_i` (in the
/// solid-angle measure at `x`) and endpoints `p_sel p_i` in their own measure
/// ([`EmitterEndpoint`]). Densities that this trait reports include `p_sel`.
///
/// **Unbiased** if `p_sel` is positive wherever the emitter sends light that `x` scatters, and if
/// the reported density is that of the actual samples. Lights that are points or directions must
/// have a positive probability wherever they contribute; emitters that a BSDF sample can hit may
/// have none.
///
/// All functions are pure: the same arguments give the same result, bit for bit.
pub trait EmitterSampler: Sync {
    /// Data of a point that the selection uses besides its position: nothing, or a normal and a
    /// reflectance.
    type Site: Copy + Default + Send + Sync;

    /// Whether the selection reads the data of points. If not, callers may hand over default values
    /// and need not store any.
    #[inline(always)]
    fn uses_site(&self) -> bool {
        size_of::<Self::Site>() > 0
    }

    /// Whether the selection reads the gloss of points. If not, callers need not look for it.
    #[inline(always)]
    fn uses_gloss(&self) -> bool {
        false
    }

    /// The data of a point that the selection uses. `at` computes it on request.
    fn site(&self, at: impl FnOnce() -> ShadingPoint) -> Self::Site;

    /// Selects an emitter by `u_select` and a direction towards it by `u`. `None` counts as a
    /// sample of value zero.
    fn sample(&self, from: Vec3, site: &Self::Site, u_select: u64, u: [f32; 2]) -> Option<EmitterSample>;

    /// Density with which [`sample`](Self::sample) chooses the direction to `point`, which lies on
    /// an area emitter; zero if it does not.
    fn pdf(&self, from: Vec3, site: &Self::Site, point: &SurfacePoint) -> Density<SolidAngle>;

    /// Density with which [`sample`](Self::sample) chooses `direction` towards the environment.
    fn pdf_environment(&self, from: Vec3, site: &Self::Site, direction: Vec3) -> Density<SolidAngle>;

    /// How the environment is sampled, if that is the same at all points: who looks up radiance
    /// and density together needs no [`pdf_environment`](Self::pdf_environment). `None` unless
    /// overridden.
    #[inline(always)]
    fn environment_choice(&self) -> Option<EnvironmentChoice> {
        None
    }

    /// Selects an emitter by `u_select` and a place on it by `u`; returns it with its
    /// [`endpoint_probability`](Self::endpoint_probability). `None` counts as a sample of value
    /// zero.
    fn sample_endpoint(
        &self,
        from: Vec3,
        site: &Self::Site,
        u_select: u64,
        u: [f32; 2],
    ) -> Option<(EmitterEndpoint, f32)>;

    /// Density with which [`sample_endpoint`](Self::sample_endpoint) chooses `point`, which lies on
    /// an area emitter, per solid angle at `from`; zero if it does not. Endpoints may be sampled by
    /// area where directions are sampled by solid angle.
    fn endpoint_pdf(&self, from: Vec3, site: &Self::Site, point: &SurfacePoint) -> Density<SolidAngle>;

    /// Probability of choosing the emitter of `endpoint`; of one at infinity that of choosing any
    /// of those.
    fn endpoint_probability(&self, from: Vec3, site: &Self::Site, endpoint: &EmitterEndpoint) -> f32;

    /// The contribution of `endpoint` at `from`, with its densities if its emitter is selected with
    /// `probability`, which is [`endpoint_probability`](Self::endpoint_probability). `None` if
    /// there is none.
    fn connect_chosen(
        &self,
        from: Vec3,
        endpoint: &EmitterEndpoint,
        probability: f32,
    ) -> Option<EmitterConnection>;

    /// [`connect_chosen`](Self::connect_chosen) that also computes the probability.
    #[inline]
    fn connect(
        &self,
        from: Vec3,
        site: &Self::Site,
        endpoint: &EmitterEndpoint,
    ) -> Option<EmitterConnection> {
        self.connect_chosen(from, endpoint, self.endpoint_probability(from, site, endpoint))
    }

    /// Samples for one point, each by a number of `u_select`: `take` gets those that are not
    /// `None`, in order. Each draws two numbers from `u`; samples that select nothing may draw
    /// none.
    #[inline]
    fn sample_many(
        &self,
        from: Vec3,
        site: &Self::Site,
        u_select: &[u64],
        mut u: impl FnMut() -> [f32; 2],
        mut take: impl FnMut(EmitterSample),
    ) {
        for &u_select in u_select {
            if let Some(sample) = self.sample(from, site, u_select, u()) {
                take(sample);
            }
        }
    }

    /// [`sample`](Self::sample) for eight points, those in the lanes `wanted`, bit for bit;
    /// `u_select` are the low and the high halves. One after the other unless overridden.
    #[inline(always)]
    fn sample_lanes<L: Lanes>(
        &self,
        from: Vec3Lanes<L>,
        sites: &[Self::Site; LANES],
        u_select: [L::Words; 2],
        u: [L; 2],
        wanted: u32,
    ) -> EmitterLanes<L> {
        let numbers = LaneNumbers::new(from, u_select, u);
        EmitterLanes::one_by_one(wanted, |lane| {
            let (from, u_select, u) = numbers.get(lane);
            self.sample(from, &sites[lane], u_select, u)
        })
    }

    /// Selects emitters for several samples at each of eight points, those in the lanes `wanted`,
    /// before they are sampled: `chosen[n]` for the numbers `u_select[n]`, the low and the high
    /// halves. Returns whether it did; then
    /// [`sample_chosen_lanes`](Self::sample_chosen_lanes) is [`sample_lanes`](Self::sample_lanes)
    /// for the same numbers, bit for bit. For samplers to which several samples at one point are
    /// less work.
    #[inline(always)]
    fn choose_lanes(
        &self,
        _sites: &[Self::Site; LANES],
        _u_select: &[[[u32; LANES]; 2]],
        _wanted: u32,
        _chosen: &mut [ChosenLanes],
    ) -> bool {
        false
    }

    /// Samples for the emitters that [`choose_lanes`](Self::choose_lanes) has selected.
    #[inline(always)]
    fn sample_chosen_lanes<L: Lanes>(
        &self,
        _from: Vec3Lanes<L>,
        _chosen: &ChosenLanes,
        _u: [L; 2],
    ) -> EmitterLanes<L> {
        EmitterLanes::one_by_one(0, |_| None)
    }
}

/// Emitters selected for eight points.
#[derive(Clone, Copy, Debug)]
pub struct ChosenLanes {
    /// Finite emitters, with their probabilities in the lanes of the bits `finite`.
    pub(crate) emitter: [u32; LANES],
    pub(crate) probability: [f32; LANES],
    pub(crate) finite: u32,
    /// Numbers that choose one at infinity, in the lanes of the bits `infinite`.
    pub(crate) u: [u64; LANES],
    pub(crate) infinite: u32,
}

impl ChosenLanes {
    /// None in any lane.
    pub const NONE: Self = Self {
        emitter: [0; LANES],
        probability: [1.0; LANES],
        finite: 0,
        u: [0; LANES],
        infinite: 0,
    };
}

/// Points and random numbers of eight lanes, in memory.
pub(crate) struct LaneNumbers {
    from: [[f32; LANES]; 3],
    u_select: [[u32; LANES]; 2],
    u: [[f32; LANES]; 2],
}

impl LaneNumbers {
    #[inline(always)]
    pub fn new<L: Lanes>(from: Vec3Lanes<L>, u_select: [L::Words; 2], u: [L; 2]) -> Self {
        use lightshed_lanes::LaneWords;
        Self {
            from: from.store(),
            u_select: [u_select[0].store(), u_select[1].store()],
            u: [u[0].store(), u[1].store()],
        }
    }

    /// Those of one lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> (Vec3, u64, [f32; 2]) {
        let [low, high] = self.u_select.map(|words| words[lane]);
        (
            self.from.map(|row| row[lane]).into(),
            u64::from(high) << 32 | u64::from(low),
            self.u.map(|row| row[lane]),
        )
    }
}

/// By power, whatever the point.
impl EmitterSampler for EmittersByPower<'_> {
    type Site = ();

    #[inline(always)]
    fn site(&self, _at: impl FnOnce() -> ShadingPoint) {}

    #[inline(always)]
    fn sample(&self, from: Vec3, (): &(), u_select: u64, u: [f32; 2]) -> Option<EmitterSample> {
        self.sample(from, u_select, u)
    }

    #[inline(always)]
    fn pdf(&self, from: Vec3, (): &(), point: &SurfacePoint) -> Density<SolidAngle> {
        self.pdf(from, point)
    }

    #[inline(always)]
    fn pdf_environment(&self, _from: Vec3, (): &(), direction: Vec3) -> Density<SolidAngle> {
        self.pdf_environment(direction)
    }

    #[inline(always)]
    fn environment_choice(&self) -> Option<EnvironmentChoice> {
        Some(self.environment_choice())
    }

    #[inline]
    fn sample_endpoint(
        &self,
        from: Vec3,
        (): &(),
        u_select: u64,
        u: [f32; 2],
    ) -> Option<(EmitterEndpoint, f32)> {
        let endpoint = self.sample_endpoint(from, u_select, u)?;
        Some((endpoint, self.endpoint_probability(&endpoint)))
    }

    #[inline(always)]
    fn endpoint_pdf(&self, from: Vec3, (): &(), point: &SurfacePoint) -> Density<SolidAngle> {
        self.pdf(from, point)
    }

    #[inline]
    fn endpoint_probability(&self, _from: Vec3, (): &(), endpoint: &EmitterEndpoint) -> f32 {
        self.endpoint_probability(endpoint)
    }

    #[inline]
    fn connect_chosen(
        &self,
        from: Vec3,
        endpoint: &EmitterEndpoint,
        _probability: f32,
    ) -> Option<EmitterConnection> {
        self.connect(from, endpoint)
    }

    #[inline]
    fn connect(&self, from: Vec3, (): &(), endpoint: &EmitterEndpoint) -> Option<EmitterConnection> {
        self.connect(from, endpoint)
    }

    #[inline(always)]
    fn sample_lanes<L: Lanes>(
        &self,
        from: Vec3Lanes<L>,
        _sites: &[(); LANES],
        u_select: [L::Words; 2],
        u: [L; 2],
        wanted: u32,
    ) -> EmitterLanes<L> {
        self.sample_lanes(from, u_select, u, wanted)
    }
}

/// Samplers may be shared.
impl<S: EmitterSampler> EmitterSampler for &S {
    type Site = S::Site;

    #[inline(always)]
    fn uses_site(&self) -> bool {
        S::uses_site(self)
    }

    #[inline(always)]
    fn site(&self, at: impl FnOnce() -> ShadingPoint) -> S::Site {
        S::site(self, at)
    }

    #[inline(always)]
    fn sample(&self, from: Vec3, site: &S::Site, u_select: u64, u: [f32; 2]) -> Option<EmitterSample> {
        S::sample(self, from, site, u_select, u)
    }

    #[inline(always)]
    fn pdf(&self, from: Vec3, site: &S::Site, point: &SurfacePoint) -> Density<SolidAngle> {
        S::pdf(self, from, site, point)
    }

    #[inline(always)]
    fn pdf_environment(&self, from: Vec3, site: &S::Site, direction: Vec3) -> Density<SolidAngle> {
        S::pdf_environment(self, from, site, direction)
    }

    #[inline(always)]
    fn environment_choice(&self) -> Option<EnvironmentChoice> {
        S::environment_choice(self)
    }

    #[inline(always)]
    fn sample_endpoint(
        &self,
        from: Vec3,
        site: &S::Site,
        u_select: u64,
        u: [f32; 2],
    ) -> Option<(EmitterEndpoint, f32)> {
        S::sample_endpoint(self, from, site, u_select, u)
    }

    #[inline(always)]
    fn endpoint_pdf(&self, from: Vec3, site: &S::Site, point: &SurfacePoint) -> Density<SolidAngle> {
        S::endpoint_pdf(self, from, site, point)
    }

    #[inline(always)]
    fn endpoint_probability(&self, from: Vec3, site: &S::Site, endpoint: &EmitterEndpoint) -> f32 {
        S::endpoint_probability(self, from, site, endpoint)
    }

    #[inline(always)]
    fn connect_chosen(
        &self,
        from: Vec3,
        endpoint: &EmitterEndpoint,
        probability: f32,
    ) -> Option<EmitterConnection> {
        S::connect_chosen(self, from, endpoint, probability)
    }

    #[inline(always)]
    fn connect(&self, from: Vec3, site: &S::Site, endpoint: &EmitterEndpoint) -> Option<EmitterConnection> {
        S::connect(self, from, site, endpoint)
    }

    #[inline(always)]
    fn sample_many(
        &self,
        from: Vec3,
        site: &S::Site,
        u_select: &[u64],
        u: impl FnMut() -> [f32; 2],
        take: impl FnMut(EmitterSample),
    ) {
        S::sample_many(self, from, site, u_select, u, take);
    }

    #[inline(always)]
    fn sample_lanes<L: Lanes>(
        &self,
        from: Vec3Lanes<L>,
        sites: &[S::Site; LANES],
        u_select: [L::Words; 2],
        u: [L; 2],
        wanted: u32,
    ) -> EmitterLanes<L> {
        S::sample_lanes(self, from, sites, u_select, u, wanted)
    }

    #[inline(always)]
    fn choose_lanes(
        &self,
        sites: &[S::Site; LANES],
        u_select: &[[[u32; LANES]; 2]],
        wanted: u32,
        chosen: &mut [ChosenLanes],
    ) -> bool {
        S::choose_lanes(self, sites, u_select, wanted, chosen)
    }

    #[inline(always)]
    fn sample_chosen_lanes<L: Lanes>(
        &self,
        from: Vec3Lanes<L>,
        chosen: &ChosenLanes,
        u: [L; 2],
    ) -> EmitterLanes<L> {
        S::sample_chosen_lanes(self, from, chosen, u)
    }
}
