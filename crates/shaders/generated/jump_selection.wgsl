// Linked from jump_selection.wesl.

struct JumpSelection {
    item: vec2u,
    weight_sum: f32,
    weight_sum_low: f32,
    threshold: f32
}

fn no_jump_selection() -> JumpSelection {
    return JumpSelection(vec2u(0u), 0.0, 0.0, 0.0);
}

fn jump_counts(weight: f32) -> bool {
    return weight > 0.0 && package_lightshed_vector__1is_finite(weight);
}

fn jump_added(selection: JumpSelection, weight: f32) -> JumpSelection {
    if !jump_counts(weight) {
        return selection;
    }
    let larger = max(selection.weight_sum, weight);
    let smaller = min(selection.weight_sum, weight);
    let sum = min(larger + smaller, package_lightshed_float__1F32_MAX);
    let low = min(selection.weight_sum_low + ((larger - sum) + smaller), package_lightshed_float__1F32_MAX);
    let total = min(sum + low, package_lightshed_float__1F32_MAX);
    var next = selection;
    next.weight_sum_low = low - (total - sum);
    next.weight_sum = total;
    return next;
}

fn jump_is_due(selection: JumpSelection, weight: f32) -> bool {
    return jump_counts(weight) && selection.weight_sum > selection.threshold;
}

fn jump_number(words: vec2u) -> f32 {
    return (f32(~words.y) + (1.0 - f32(words.x) * 2.3283064e-10)) * 2.3283064e-10;
}

fn jump_selected(selection: JumpSelection, item: vec2u, u: f32) -> JumpSelection {
    var next = selection;
    next.item = item;
    next.threshold = min(selection.weight_sum / u, package_lightshed_float__1F32_MAX);
    return next;
}

const package_lightshed_float__1F32_MAX: f32 = 3.4028235e38;

fn package_lightshed_vector__1is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 2139095040u) != 2139095040u;
}
