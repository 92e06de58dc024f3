// Linked from reservoir.wesl.

const TAG_EMPTY: u32 = 0u;

const TAG_SAMPLE: u32 = 1u;

struct Reservoir {
    sample: u32,
    tag: u32,
    weight: f32,
    confidence: f32
}

struct Selection {
    item: u32,
    tag: u32,
    weight_sum: f32,
    weight_sum_low: f32
}

struct Offered {
    selection: Selection,
    accepted: bool
}

fn offer(selection: Selection, item: u32, weight: f32, u: f32) -> Offered {
    if !(weight > 0.0) || !package_lightshed_vector__1is_finite(weight) {
        return Offered(selection, false);
    }
    let sum = min(selection.weight_sum + weight, package_lightshed_float__1F32_MAX);
    var lost: f32;
    if selection.weight_sum >= weight {
        lost = (selection.weight_sum - sum) + weight;
    }
    else {
        lost = (weight - sum) + selection.weight_sum;
    }
    let low = min(selection.weight_sum_low + lost, package_lightshed_float__1F32_MAX);
    let total = min(sum + low, package_lightshed_float__1F32_MAX);
    var next = selection;
    next.weight_sum_low = low - (total - sum);
    next.weight_sum = total;
    let accepted = u * next.weight_sum < weight || weight >= next.weight_sum;
    if accepted {
        next.item = item;
        next.tag = TAG_SAMPLE;
    }
    return Offered(next, accepted);
}

fn contribution_weight(selection: Selection, target_value: f32) -> f32 {
    if selection.tag == TAG_EMPTY || !(target_value > 0.0) {
        return 0.0;
    }
    return min(selection.weight_sum / target_value, package_lightshed_float__1F32_MAX);
}

fn with_confidence_cap(reservoir: Reservoir, cap: f32) -> Reservoir {
    var capped = reservoir;
    capped.confidence = min(reservoir.confidence, select(0.0, cap, cap > 0.0));
    return capped;
}

const package_lightshed_float__1F32_MAX: f32 = 3.4028235e38;

fn package_lightshed_vector__1is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 2139095040u) != 2139095040u;
}
