//! Numbers in public signatures that should be of a type that says what they are.

use lightshed_house::{Interface, Signature};

/// Words in names of what has a measure or a space: densities and weights.
const TYPED: [&str; 6] = ["pdf", "pdfs", "density", "densities", "weight", "weights"];

fn is_named_so(name: &str) -> bool {
    let name = name.rsplit("::").next().unwrap();
    name.split('_').any(|word| TYPED.contains(&word))
}

fn is_bare(of: &str) -> bool {
    let mut words = of.split(|c: char| !(c.is_alphanumeric() || c == '_'));
    words.any(|word| word == "f32" || word == "f64") && !of.contains("Density<") && !of.contains("Weight<")
}

/// Functions and fields with a bare number that is named as a density or a weight.
pub fn bare(interface: &Interface) -> Vec<String> {
    let mut found = Vec::new();
    for Signature {
        name,
        parameters,
        result,
    } in &interface.signatures
    {
        let parameters = parameters
            .iter()
            .filter(|(name, of)| is_named_so(name) && is_bare(of));
        found.extend(parameters.map(|(parameter, of)| format!("{name}({parameter}: {of})")));
        if let Some(result) = result
            .as_ref()
            .filter(|result| is_named_so(name) && is_bare(result))
        {
            found.push(format!("{name} -> {result}"));
        }
    }
    found.sort();
    found.dedup();
    found
}

/// Crate, why bare numbers are right there, and where.
const REASONS: &[(&str, &str, &str)] = &[
    (
        "bvh",
        "a weight in a split cost or a choice among primitives",
        "Extent::cost_of Extent::sampling_weight Extent::weight sample",
    ),
    ("caching", "a number of samples", "CellMoments::weight"),
    (
        "guiding",
        "a statistical weight, for which any unit will do",
        "GuidingSample::weight MarkovState::weight TrainingSample::weight VmfLobe::weight VmfSample::weight",
    ),
    (
        "guiding",
        "a trait over samples of any model; their densities are typed where they are recorded",
        "TrainingSample::pdf TrainingSample::scattering_pdf",
    ),
    ("guiding", "the oracle in f64", "VmfMixture::naive_density"),
    (
        "lights",
        "a weight in a sum that is one",
        "BlendingFunctions::weight",
    ),
    (
        "resampling",
        "in f64, in which merges compute, in the domain's own `Space`",
        "ChainTile::density ChainTile::other_density Domain::tractable_density Pulled::density Technique::density",
    ),
    (
        "resampling",
        "a resampling weight, and sums of these: they have no measure",
        "Contribution::weight JumpSelection::offer JumpSelection::weight_sum Kept::weight MergeReport::weight_square_sum MergeReport::weight_sum \
         Mis::weights spread_copies Selection::offer Selection::offer_with Selection::resume Selection::weight_sum Selections::offer_with \
         Selections::weight_sum WithoutReplacement::offer WithoutReplacement::weight_sum",
    ),
    (
        "resampling",
        "storage as a GPU reads it",
        "ReservoirRecord::weight SelectionRecord::offer SelectionRecord::weight_sum SelectionRecord::weight_sum_low",
    ),
    (
        "sampling",
        "weights of a choice, in any unit",
        "choose choose_pmf",
    ),
    (
        "sampling",
        "the distribution of normals `D`, which is no density of directions",
        "MicrofacetDistribution::normal_density",
    ),
    (
        "scene",
        "in the measure of its endpoint: an area, a solid angle, or a probability",
        "EmitterConnection::pdf_endpoint",
    ),
    (
        "scene",
        "eight lanes in memory, per solid angle",
        "GlossyScattering::direction_pdf_solid_angle GlossyScattering::pdf_solid_angle",
    ),
    (
        "scene",
        "storage as a GPU reads it",
        "ComponentRow::weight FlatEmitter::pdf_area",
    ),
    (
        "testkit",
        "a crate that knows no type of the others",
        "Chooser::choose_weighted DirectionConformance::pdf GaussLegendre::weights",
    ),
    (
        "volume",
        "the density of a medium, not of a probability",
        "DensityAccessor::density DensityField::density Homogeneous::new KnownFlight::density SpectralFlight::density_ratio densities_at \
         homogeneous_flight",
    ),
    (
        "volume",
        "by the ray's parameter, or the probability that nothing is met",
        "KnownFlight::pdf",
    ),
    (
        "volume",
        "a factor of an estimate",
        "GuidedFlight::weight WeightedFlight::weight",
    ),
];

/// Those of `found` in `package` that have no reason, and reasons without any.
pub fn without_reason(package: &str, found: &[String]) -> Vec<String> {
    let place = |line: &String| line.split(['(', ' ']).next().unwrap().to_owned();
    let reasons: Vec<&str> = REASONS
        .iter()
        .filter(|(of, ..)| *of == package)
        .flat_map(|(.., places)| places.split_whitespace())
        .collect();
    let unreasoned = found
        .iter()
        .filter(|line| !reasons.contains(&place(line).as_str()));
    let mut wrong: Vec<String> = unreasoned.map(|line| format!("{package}: {line}")).collect();
    let places: Vec<String> = found.iter().map(place).collect();
    let idle = reasons
        .iter()
        .filter(|reason| !places.iter().any(|place| place == *reason));
    wrong.extend(idle.map(|reason| format!("{package}: {reason} needs no reason")));
    wrong
}
