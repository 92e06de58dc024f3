// Linked from mis.wesl.

fn share(part: f32, total: f32) -> f32 {
    if part > 0.0 {
        return min(part / min(total, package_lightshed_float__1F32_MAX), 1.0);
    }
    return 0.0;
}

fn balance_weight(confidence: f32, density: f32, total: f32) -> f32 {
    return share(confidence * density, total);
}

struct Pairwise {
    alpha: f32,
    kappa: f32,
    canonical_confidence: f32,
    neighbour_confidence: f32
}

fn pairwise_defensive(canonical: f32, neighbours: f32) -> Pairwise {
    return Pairwise(min(neighbours / canonical, package_lightshed_float__1F32_MAX), share(neighbours, canonical + neighbours), canonical, neighbours);
}

fn pairwise_uniform(canonical: f32, neighbours: f32) -> Pairwise {
    return Pairwise(min(neighbours / canonical, package_lightshed_float__1F32_MAX), select(0.0, 1.0, neighbours > 0.0), canonical, neighbours);
}

fn pairwise_neighbour(pairwise: Pairwise, confidence: f32, p: f32, q: f32) -> f32 {
    let mine = min(pairwise.alpha * q, package_lightshed_float__1F32_MAX);
    return pairwise.kappa * share(confidence, pairwise.neighbour_confidence) * share(mine, p + mine);
}

fn pairwise_kept(pairwise: Pairwise, confidence: f32, p: f32, q: f32) -> f32 {
    let theirs = min(pairwise.alpha * q, package_lightshed_float__1F32_MAX);
    var fraction = 1.0;
    if theirs > 0.0 {
        fraction = share(p, p + theirs);
    }
    return share(confidence, pairwise.neighbour_confidence) * fraction;
}

fn pairwise_canonical(pairwise: Pairwise, confidence: f32, kept: f32) -> f32 {
    return share(confidence, pairwise.canonical_confidence) * ((1.0 - pairwise.kappa) + pairwise.kappa * kept);
}

const package_lightshed_float__1F32_MAX: f32 = 3.4028235e38;
