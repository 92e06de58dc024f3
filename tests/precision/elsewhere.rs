//! Public functions of real numbers that have no row, and where they are held to account.

/// Crate, reason, functions.
pub const ELSEWHERE: &[(&str, &str, &str)] = &[
    (
        "lightshed-lanes",
        "moves or combines lanes by single operations of IEEE 754; all kinds of lanes are compared bit for bit by the crate's tests",
        "AnyLanes::abs AnyLanes::compress AnyLanes::equal AnyLanes::flipped AnyLanes::least_of AnyLanes::less AnyLanes::less_equal AnyLanes::max AnyLanes::min AnyLanes::pick \
         AnyLanes::read AnyLanes::select AnyLanes::splat AnyLanes::sqrt AnyLanes::write Column::get Column::load \
         Column::load_words Column::read Column::set Column::splat Column::store Column::store_compressed \
         Column::store_words_compressed Column::write LaneKernel::run Lanes::copysign Lanes::count_at_most \
         Lanes::delayed Lanes::evens_and_odds Lanes::first Lanes::from_bits Lanes::from_integers Lanes::lane \
         Lanes::load Lanes::load_pairs Lanes::load_transposed Lanes::running_sums Lanes::store Lanes::to_bits \
         Lanes::to_integers Lanes::total Vec3Lanes::dot Vec3Lanes::length Vec3Lanes::max_element Vec3Lanes::new Vec3Lanes::normalize_or Vec3Lanes::select \
         Vec3Lanes::splat Vec3Lanes::store",
    ),
    (
        "lightshed-sampling",
        "gives what it holds, or checks and stores",
        "AliasTable::new AliasTable::pmfs Beckmann::alpha Beckmann::new CompensatedSum::new Density::is_positive Density::new Density::value \
         FreeFlight::new Ggx::alpha Ggx::new PiecewiseConstant1d::new PiecewiseConstant2d::new SphericalRectangle::new \
         SphericalTriangle::new VonMisesFisher::concentration VonMisesFisher::mean VonMisesFisher::new",
    ),
    (
        "lightshed-sampling",
        "called by the rows of the same type, which measure what comes of it",
        "CompensatedSum::value MicrofacetDistribution::lambda MicrofacetDistribution::sample_visible_normal UniformCone::from_one_minus_cos \
         UniformCone::one_minus_cos_theta_max octahedral_decode octahedral_unpack16 octahedral_unpack32 pairwise_sum_iter",
    ),
    (
        "lightshed-sampling",
        "the same bits as the function of one number, by the crate's tests",
        "ConcentricDisk::sample_lanes CosineHemisphere::sample_lanes CounterRng::block_lanes PointSet::block_lanes PointSet::block_lanes_by PointSet::common_lanes SobolSampler::block_lanes SobolSampler::block_lanes_by SobolScrambles::new BlueNoiseSampler::block_lanes FrameLanes::from_normal FrameLanes::to_local FrameLanes::to_world GgxLanes::masking GgxLanes::new GgxLanes::normal_density \
         GgxLanes::sample_visible_normal GgxLanes::visible_normal_density \
         PathSeed::block_lanes PiecewiseConstant2d::pdf_lanes PiecewiseConstant2d::sample_lanes UniformSphere::sample_lanes UniformTriangle::sample_lanes f32_from_u32_lanes power_heuristic_lanes sin_cos_turns_lanes turn_of_lanes",
    ),
    (
        "lightshed-sampling",
        "exact integers, or those words as numbers; held to by known answers",
        "CounterRng::next_2d CounterRng::next_f32 PointStream::next_2d PointStream::next_f32 SobolSampler::next_2d SobolSampler::next_f32 BlueNoiseSampler::next_2d BlueNoiseSampler::next_f32",
    ),
    (
        "lightshed-sampling",
        "through the trait, the functions of the same type that have rows, with the density of the rounded direction; held to it bit for bit",
        "DirectionDistribution::pdf DirectionDistribution::sample Oriented::new with_density",
    ),
    (
        "lightshed-sampling",
        "sums of integers, the same in any order, by the crate's tests",
        "FixedMean::add FixedMean::value FixedSum::add FixedSum::value",
    ),
    (
        "lightshed-spatial",
        "called by the rows of the same type, which measure what comes of it",
        "Bounds::contains Bounds::is_valid Bounds::union",
    ),
    (
        "lightshed-spatial",
        "gives what it holds, or checks and stores",
        "AdaptiveOctree::min AdaptiveOctree::new AdaptiveOctree::side Bounds::new Bounds::of_point CubicGrid::cell CubicGrid::new CurveCube::around LevelGrid::new LevelGridOptions::new PointGrid::cell_side PointGrid::new PointGrid::rebuild \
         Nearest::new Nearest::reach_squared SiteMetric::new SurfaceSite::new SurfaceSite::with_eye_distance",
    ),
    (
        "lightshed-spatial",
        "cells and what lies within a radius, held to exact quotients and to a look at every point by the crate's tests",
        "AdaptiveOctree::bounds AdaptiveOctree::leaf_side AdaptiveOctree::slot AdaptiveOctree::slot_moved AdaptiveOctree::slots_of_pair CubicGrid::in_cells CubicGrid::key CubicGrid::vertex Curve::encode CurveCube::cell CurveOrder::encode LevelGrid::jittered LevelGrid::jittered_at LevelGrid::level LevelGrid::side Occupancy::load PointGrid::for_each_within \
         Nearest::offer SiteMetric::distance_squared SpatialIndex::locate for_each_row_within",
    ),
    (
        "lightshed-resampling",
        "called by the rows of the same type, which measure what comes of it",
        "Jacobian::value JumpSelection::weight_sum MixtureRis::finish MixtureRis::target_integral Moments::push Reservoir::confidence Reservoir::empty \
         Reservoir::estimate Reservoir::with_confidence_cap Ris::finish Ris::target_integral RisMany::finish Selection::offer_with Selection::resume \
         Selection::weight_sum Selections::weight_sum Tractable::weight WithoutReplacement::weight_sum",
    ),
    (
        "lightshed-resampling",
        "gives what it holds, or checks and stores",
        "Carried::pulled Carried::shifted ContributionWeight::given ContributionWeight::new ContributionWeight::value Input::canonical Input::neighbour Pairwise::new \
         NeighbourLists::new Pattern::disk Pulled::density PrefixWeight::resampled Reservoir::given Reservoir::is_empty Reservoir::map Reservoir::new Reservoir::sample Reservoir::weight Reservoir::weighted_sample \
         History::new MergeRule::new MergeRule::with_confidence_cap Reuse::new Storage::from_f64 Storage::to_f64 Moments::count Moments::new Reservoir::within",
    ),
    (
        "lightshed-resampling",
        "held to exact enumeration of all outcomes, to 10⁻¹², by the crate's tests",
        "Choose::accept MergeRule::merge MergeRule::merge_and_integrate MergeReport::effective_count PairwiseStream::exchanged PairwiseStream::finish PairwiseStream::neighbour PairwiseStream::new \
         Reuse::paired Reuse::spatial Reuse::spatial_integrated Reuse::spatial_rounds Reuse::temporal Ris::drawn Ris::reservoir integrate merge \
         merge_and_integrate merge_several round_trip MergeRule::merge_several Reuse::linked Reuse::linked_integrated SetWeight::merged SetWeight::of_set \
         Carried::new FinalGather::own_share FinalGather::survival FinalGather::surviving Reservoir::mutated spread_copies",
    ),
    (
        "lightshed-resampling",
        "a trait's function, written by a user",
        "ChainTile::density ChainTile::other_density Domain::target Domain::tractable_density ShiftMapping::pull ShiftMapping::shift",
    ),
    (
        "lightshed-shift",
        "gives what it holds, or checks and stores",
        "Connection::to_delta Connectability::hybrid Connectability::min_distance Connectability::min_roughness \
         Connectability::reconnection Footprint::area Footprint::new Footprint::solid_angle ConnectionReach::least_length LobeDirection::of_single_lobe \
         MeasuredJacobian::determinant MeasuredJacobian::new PathDomain::behind PathDomain::first \
         PathSample::contribution PathSample::target PathShift::with_jacobian_limit PrefixDomain::behind \
         PrefixDomain::first PrefixSample::target PrefixSample::throughput PrefixSample::wo VolumePath::connect \
         VolumePath::direction VolumePath::first_distance VolumePath::held VolumePath::shown_by \
         VolumePath::with_endpoint",
    ),
    (
        "lightshed-shift",
        "proposes steps, which the crate's tests hold to the expectations without them",
        "PathMutator::propose",
    ),
    (
        "lightshed-shift",
        "a trait's function, written by a user",
        "VolumeWorld::emitted VolumeWorld::environment VolumeWorld::environment_direction VolumeWorld::first \
         VolumeWorld::lit VolumeWorld::next VolumeWorld::phase VolumeWorld::position VolumeWorld::reflected \
         VolumeWorld::scattered VolumeWorld::scattering VolumeWorld::set_position \
         VolumeWorld::transmittance_to_environment WorldGeometry::geometric_normal WorldGeometry::occluded \
         WorldGeometry::occluded_many WorldGeometry::position WorldGeometry::ray WorldGeometry::segment \
         WorldGeometry::sensor_ray WorldGeometry::trace WorldGeometry::trace_many WorldLighting::connect \
         WorldLighting::connect_delta WorldLighting::emitted WorldLighting::emitter_pdf \
         WorldLighting::environment WorldLighting::environment_pdf WorldLighting::sample_emitter \
         WorldLighting::trace_suffixes WorldScattering::evaluate WorldScattering::evaluate_lobe \
         WorldScattering::lobe_roughness WorldScattering::sample_lobe",
    ),
    (
        "lightshed-shift",
        "held to densities and determinants of whole paths by the crate's tests and the integrator's",
        "FollowPaths::estimate FollowPaths::settled check_world held_directions path_target trace_suffix",
    ),
    (
        "lightshed-lights",
        "called by the rows of the same type, which measure what comes of it",
        "LightBvh::pmf_factored LightBvh::sample_each_factored LightBvh::sample_factored \
         LightSampler::sample_each LightSampler::sample_for LightSampler::sample_many LightSubtrees::sample_subtrees \
         OrientationCone::is_valid",
    ),
    (
        "lightshed-lights",
        "gives what it holds, or checks and stores",
        "Light::check Light::cone_or_all LightBvh::new LightBvh::rebuild LightBvh::with_build LightRecord::new \
         LightingGrid::bounds LightingGrid::cell_size PerfectTree::new PerfectTree::rebuild PerfectTree::with_options PointLight::isotropic \
         PointLight::lambertian PowerLights::new RaySegment::direction RaySegment::length RaySegment::new RaySegment::start ShadingPoint::new \
         ShadingPoint::without_normal TwoLevelTree::new check_lights",
    ),
    (
        "lightshed-lights",
        "statistical, or a choice that any answer of leaves unbiased; by the crate's tests",
        "LightingGrid::represented_light PerfectTree::drift PerfectTree::update",
    ),
    (
        "lightshed-volume",
        "called by the rows of the same type, which measure what comes of it",
        "DensityAccessor::densities DensityAccessor::densities_of EquiAngular::sample FieldRay::at KnownFlight::pdf KnownFlight::transmittance MajorantGrid::cell_size MajorantGrid::whole_segment \
         RegularDepth::transmittance unbiased_ray_marching_lookups",
    ),
    (
        "lightshed-volume",
        "gives what it holds, or checks and stores",
        "Blend::new DenseGrid::from_fn DenseGrid::new DensityField::bounds Draine::new EquiAngular::new ScatteredDirections::new FieldBounds::max \
         FieldBounds::min FieldBounds::new FieldRay::new FlightGuiding::defence FlightGuiding::new MipLevel::ray ScatteringAngle::reversed HenyeyGreenstein::asymmetry HenyeyGreenstein::new Homogeneous::new MajorantGrid::new \
         Procedural::new TentativeCollisions::new VoxelGrid::corners VoxelGrid::voxel",
    ),
    (
        "lightshed-volume",
        "held to sums over the segments of single rays, to 10⁻⁴, by the crate's tests",
        "MajorantGrid::depths MajorantGrid::majorants_at",
    ),
    (
        "lightshed-volume",
        "statistical: means and densities by the crate's tests",
        "TentativeCollisions::majorant_depth decomposition_tracking delta_transmittance spectral_delta_tracking spectral_ratio_tracking \
         spectral_residual_ratio_tracking guided_homogeneous_flight guided_tracking",
    ),
    (
        "lightshed-scene",
        "called by the rows of the same type, which measure what comes of it",
        "Bsdf::albedo_hint Bsdf::lobe_roughness",
    ),
    (
        "lightshed-scene",
        "gives what it holds, or checks and stores",
        "Channel::of DiffuseLanes::origin_towards DiffuseLanes::seen_from EmitterOutline::radiance Environment::constant_radiance FlatScene::corners GlossyColumns::load GlossyColumns::splat MeshInstances::box_corners GridField::clip \
         GridField::field_ray HitBatch::get HitBatch::set Image::from_linear Image::texels LoadLimits::set Material::at Medium::albedo Medium::albedo_at Medium::emission_per_collision \
         Medium::extinction MediumEmission::radiance MediumSides::towards Ray::new Ray::segment RayBatch::fill RayBatch::get RayBatch::load RayBatch::read RayBatch::set \
         RayBatch::store RayBatch::store_compressed Scene::bounds Scene::bsdf Scene::coordinates Scene::diffuse_lanes Scene::extent \
         Scene::medium_around Checkerboard::at",
    ),
    (
        "lightshed-scene",
        "the same bits as brute force, or as the function of one ray, by the crate's tests",
        "Accelerator::build Accelerator::intersect Accelerator::intersect_many Accelerator::occluded Accelerator::occluded_many Camera::ray_lanes \
         EmitterLanes::chosen_with EmitterLanes::one_by_one EmitterLanes::shadow_rays Emitters::sample_on_lanes Emitters::sample_at_infinity_lanes EmittersByPower::sample_lanes Environment::light_by Environment::light_lanes Environment::sample_lanes EnvironmentChoice::pdf_lanes GlossyLanes::evaluate Scene::intersect_emitting_many Scene::occluded \
         Scene::nearest Scene::passes_grid_alone Scene::scatter_glossy Scene::settled",
    ),
    (
        "lightshed-scene",
        "densities integrate to one, histograms match them, rays leave and reach surfaces; by the crate's tests",
        "Camera::moved EmitterConnection::chosen_with EmitterConnection::shadow_ray EmitterConnection::shadow_ray_from \
         EmitterSample::chosen_with EmitterSample::shadow_ray EmitterSample::shadow_ray_from EnvironmentChoice::chosen_with EnvironmentChoice::new EnvironmentChoice::pdf \
         Emitters::connect Emitters::connect_by Environment::pdf_by Environment::sample_by Emitters::endpoint_at_infinity Emitters::endpoint_on Emitters::endpoint_pdf_on Emitters::pdf_at_infinity \
         Emitters::pdf_on Emitters::radiance Emitters::sample_at_infinity Emitters::sample_on EmittersByPower::connect \
         EmittersByPower::endpoint_probability EmittersByPower::pdf EmittersByPower::pdf_environment EmittersByPower::probability \
         EmittersByPower::sample_endpoint \
         Scene::locate Scene::sample_emission \
         SurfacePoint::segment_to ",
    ),
    (
        "lightshed-scene",
        "bounds: no camera ray meets an emitter outside of its outline, by a test of the integrator with random cameras and emitters",
        "EmitterOutline::corners Emitters::outline",
    ),
    (
        "lightshed-scene",
        "chooses numbers of blocks, by the crate's tests",
        "ImageBlocks::spread",
    ),
    (
        "lightshed-scene",
        "makes meshes of built-in scenes",
        "icosphere lighthouse_at pool_at quad signed_volume tetrahedron",
    ),
    (
        "lightshed-film",
        "called by the rows of the same type, which measure what comes of it",
        "Film::add PixelStatistics::add PixelStatistics::count PixelStatistics::merge PixelStatistics::non_finite",
    ),
    (
        "lightshed-film",
        "gives what it holds, or checks and stores",
        "Film::get FilmTile::pixels_mut OutputTarget::with_exposure RgbImage::from_fn RgbImage::get RgbImage::height RgbImage::new \
         RgbImage::pixels RgbImage::width process_cpu_seconds",
    ),
    (
        "lightshed-film",
        "a trait's function, written by a user",
        "FrameMethod::figures FrameMethod::render_frame PixelEstimator::sample PixelEstimator::sample_many",
    ),
    (
        "lightshed-film",
        "reads or writes a file; values are read back by the crate's tests",
        "OutputTarget::write read_exr write_exr write_png",
    ),
    (
        "lightshed-film",
        "another's implementation behind a feature, compared with published values by the crate's tests",
        "flip",
    ),
    (
        "lightshed-integrator",
        "gives what it holds, or checks and stores",
        "CachedPaths::cache CameraMotion::orbit CameraMotion::translation FieldRecorder::new GuidedPaths::last_variance SceneField::arrival_worth SceneField::mean_share SceneField::worth MethodValues::temporal_cap MethodValues::vpl_min_distance RestirPtOptions::thresholds SceneVertex::point SceneVertices::new SceneVertices::vertex VplBrute::new VplGridOptions::new \
         scene_lights shading_point ShortGain::both",
    ),
    (
        "lightshed-integrator",
        "estimators: held to closed forms, to each other and to another renderer's images",
        "EmitterSampler::choose_lanes EmitterSampler::connect EmitterSampler::connect_chosen EmitterSampler::endpoint_pdf EmitterSampler::endpoint_probability \
         EmitterSampler::pdf EmitterSampler::pdf_environment EmitterSampler::sample EmitterSampler::sample_chosen_lanes EmitterSampler::sample_endpoint \
         EmitterSampler::sample_lanes EmitterSampler::sample_many EmitterSampler::site \
         GuidedPaths::render_frame_elsewhere LightSelection::probability ObservedPath::arrived ObservedPath::from_sampled_emitter \
         PathTracer::radiance RestirVolume::animated SceneWorld::arrive Trial::merit VolumePathTracer::radiance",
    ),
    (
        "lightshed-integrator",
        "a trait's function, written by a user",
        "DirectionGuide::arrival_worth DirectionGuide::guide DirectionGuide::survival PathEnding::at PathObserver::observe",
    ),
];
