// Linked from markov_state.wesl.

const SMALLEST_WEIGHT: f32 = 1.1754944e-38;

const LARGEST: f32 = 3.4028235e38;

struct MarkovState {
    mean_place: vec3f,
    mean_cosine: f32,
    weight: f32,
    count: u32,
    score: f32,
    brightness: f32
}

struct MarkovOptions {
    prior_count: f32,
    prior_cosine: f32,
    prior_normal: f32,
    decay: f32,
    count_limit: u32,
    survival: f32,
    balanced: u32,
    padding: u32
}

struct TargetLobe {
    place: vec3f,
    concentration: f32,
    peak: f32,
    span: f32,
    tilt: f32,
    padding: u32
}

struct MarkovChain {
    state: MarkovState,
    kept: MarkovState
}

struct Finding {
    place: vec3f,
    estimate: f32,
    brightness: f32
}

fn no_state() -> MarkovState {
    return MarkovState(vec3f(0.0), 0.0, 0.0, 0u, 0.0, 0.0);
}

fn is_valid_state(state: MarkovState) -> bool {
    return state.weight > 0.0;
}

fn with_score(state: MarkovState, score: f32) -> MarkovState {
    var scored = state;
    scored.score = select(0.0, min(score, LARGEST), score > 0.0);
    return scored;
}

fn markov_target(state: MarkovState, options: MarkovOptions) -> TargetLobe {
    if !is_valid_state(state) {
        return TargetLobe(vec3f(0.0), 0.0, 0.0, 0.0, 0.0, 0u);
    }
    let squared = f32(state.count) * f32(state.count);
    let count = squared + options.prior_count;
    let known = squared * state.mean_cosine;
    let r = (known + options.prior_count * options.prior_cosine) / count;
    let gap = (squared * (1.0 - state.mean_cosine) + options.prior_count * (1.0 - options.prior_cosine)) / count;
    var tilt = 0.0;
    if options.prior_normal > 0.0 {
        tilt = options.prior_normal / (known + options.prior_normal);
    }
    let lobe = package_lightshed_vmf__1vmf_lobe(vec3f(0.0), package_lightshed_vmf__1vmf_concentration(r, gap));
    return TargetLobe(state.mean_place, lobe.concentration, lobe.peak, lobe.span, tilt, 0u);
}

fn target_lobe_at(lobe: TargetLobe, from_point: vec3f, normal: vec3f) -> package_lightshed_vmf_VmfLobe {
    let towards = package_lightshed_vector__1normalized_or(lobe.place - from_point, normal);
    var mean = towards;
    if lobe.tilt > 0.0 {
        mean = package_lightshed_vector__1normalized_or(towards * (1.0 - lobe.tilt) + normal * lobe.tilt, towards);
    }
    return package_lightshed_vmf_VmfLobe(mean, lobe.concentration, lobe.peak, lobe.span);
}

fn is_finite3(v: vec3f) -> bool {
    return package_lightshed_vector__1is_finite(v.x) && package_lightshed_vector__1is_finite(v.y) && package_lightshed_vector__1is_finite(v.z);
}

fn newest_share(count: u32, options: MarkovOptions) -> f32 {
    return max(1.0 / f32(count), options.decay);
}

fn markov_learn(state: ptr<function, MarkovState>, from_point: vec3f, place: vec3f, estimate: f32, options: MarkovOptions) {
    let direction = package_lightshed_vector__1normalized_or(place - from_point, vec3f(0.0));
    if !(estimate >= 0.0 && package_lightshed_vector__1is_finite(estimate) && is_finite3(place)) || all(direction == vec3f(0.0)) {
        return;
    }
    (*state).count = min((*state).count + 1u, options.count_limit);
    let alpha = newest_share((*state).count, options);
    let kept = (1.0 - alpha) * (*state).weight;
    let weight = kept + alpha * estimate;
    if !(weight > 0.0) {
        return;
    }
    let old = min(kept / weight, 1.0);
    let share = min(alpha * estimate / weight, 1.0);
    let mean = package_lightshed_vector__1normalized_or((*state).mean_place - from_point, vec3f(0.0)) * (*state).mean_cosine;
    (*state).mean_place = old * (*state).mean_place + share * place;
    (*state).mean_cosine = min(package_lightshed_vector_length3(old * mean + share * direction), 1.0);
    (*state).weight = clamp(weight, SMALLEST_WEIGHT, LARGEST);
}

fn markov_miss(state: ptr<function, MarkovState>, options: MarkovOptions) {
    (*state).count = min((*state).count + 1u, options.count_limit);
    (*state).weight *= 1.0 - newest_share((*state).count, options);
}

fn markov_advance(chain: MarkovChain, from_point: vec3f, by_lobe: bool, found: Finding, u: f32, options: MarkovOptions) -> MarkovChain {
    var next = chain;
    let finds = found.estimate > 0.0 && is_finite3(found.place);
    let estimate = min(found.estimate, LARGEST);
    var state = chain.state;
    if options.balanced == 1u {
        let brightness = state.brightness * state.score;
        if finds && (by_lobe || !is_valid_state(state) || u * brightness < found.brightness) {
            if !by_lobe {
                state = no_state();
            }
            markov_learn(&state, from_point, found.place, estimate, options);
            state = with_score(state, 1.0);
            state.brightness = clamp(found.brightness, 0.0, LARGEST);
            next.kept = state;
        }
        else if by_lobe && is_valid_state(state) {
            markov_miss(&state, options);
        }
        else if !is_valid_state(chain.kept) {
            next.kept = state;
        }
        next.state = state;
        return next;
    }
    if !finds {
        if by_lobe && is_valid_state(state) {
            markov_miss(&state, options);
        }
        next.state = state;
        return next;
    }
    let accepted = !is_valid_state(chain.kept) || u * chain.kept.score < estimate;
    if accepted {
        if !by_lobe {
            state = no_state();
        }
        state = with_score(state, estimate);
    }
    if accepted || by_lobe {
        markov_learn(&state, from_point, found.place, estimate, options);
    }
    if accepted {
        next.kept = state;
    }
    next.state = state;
    return next;
}

fn markov_finish(chain: MarkovChain, options: MarkovOptions) -> MarkovState {
    if is_valid_state(chain.kept) {
        return chain.kept;
    }
    let score = options.survival * chain.state.score;
    if score > 0.0 {
        return with_score(chain.state, score);
    }
    return no_state();
}

const package_lightshed_exponential__1LN_2: f32 = 0.6931472;

const package_lightshed_exponential__1VANISHES_FROM: f32 = 126.0;

fn package_lightshed_exponential__1exp2_negative(y: f32) -> f32 {
    if !(y < package_lightshed_exponential__1VANISHES_FROM) {
        return 0.0;
    }
    let whole = u32(y);
    let t = (0.5 - (y - f32(whole))) * package_lightshed_exponential__1LN_2;
    var series = 0.0001984127;
    series = series * t + 0.0013888889;
    series = series * t + 0.008333334;
    series = series * t + 0.041666668;
    series = series * t + 0.16666667;
    series = series * t + 0.5;
    series = series * t + 1.0;
    series = series * t + 1.0;
    return series * 0.70710677 * bitcast<f32>((127u - whole) << 23u);
}

fn package_lightshed_vector__1is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 2139095040u) != 2139095040u;
}

fn package_lightshed_vector__1normalized_or(v: vec3f, otherwise: vec3f) -> vec3f {
    let inverse = 1.0 / package_lightshed_vector_length3(v);
    if package_lightshed_vector__1is_finite(inverse) && inverse > 0.0 {
        return v * inverse;
    }
    return otherwise;
}

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

fn package_lightshed_vector_length3(v: vec3f) -> f32 {
    return sqrt(package_lightshed_vector_dot3(v, v));
}

struct package_lightshed_vmf_VmfLobe {
    mean: vec3f,
    concentration: f32,
    peak: f32,
    span: f32
}

const package_lightshed_vmf__1INVERSE_TAU: f32 = 0.15915494;

const package_lightshed_vmf__1LOG2_E: f32 = 1.442695;

const package_lightshed_vmf__1MAX_CONCENTRATION: f32 = 1000000.0;

const package_lightshed_vmf__1UNIFORM_BELOW: f32 = 1e-7;

fn package_lightshed_vmf__1exp_negative(y: f32) -> f32 {
    return package_lightshed_exponential__1exp2_negative(y * package_lightshed_vmf__1LOG2_E);
}

fn package_lightshed_vmf__1vmf_concentration(r: f32, gap: f32) -> f32 {
    let bounded = max(gap, 1.0 / package_lightshed_vmf__1MAX_CONCENTRATION);
    return min(r * (3.0 - r * r) / (bounded * (2.0 - bounded)), package_lightshed_vmf__1MAX_CONCENTRATION);
}

fn package_lightshed_vmf__1vmf_lobe(mean: vec3f, concentration: f32) -> package_lightshed_vmf_VmfLobe {
    let span = package_lightshed_vmf__3one_minus_exp_negative(2.0 * concentration);
    return package_lightshed_vmf_VmfLobe(mean, concentration, package_lightshed_vmf__1vmf_peak(concentration), span);
}

fn package_lightshed_vmf__1vmf_peak(concentration: f32) -> f32 {
    if concentration > package_lightshed_vmf__1UNIFORM_BELOW {
        return package_lightshed_vmf__1INVERSE_TAU * concentration / package_lightshed_vmf__3one_minus_exp_negative(2.0 * concentration);
    }
    return package_lightshed_warp__2INVERSE_FOUR_PI;
}

fn package_lightshed_vmf__3one_minus_exp_negative(y: f32) -> f32 {
    if y > 1.0 {
        return 1.0 - package_lightshed_vmf__1exp_negative(y);
    }
    var series = 1.0;
    for (var n = 11.0; n > 1.0; n -= 1.0) {
        series = 1.0 - y / n * series;
    }
    return y * series;
}

const package_lightshed_warp__2INVERSE_FOUR_PI: f32 = 0.07957747;
