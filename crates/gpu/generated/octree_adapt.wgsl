// Linked from octree_adapt.wesl.

struct OctreeState {
    nodes: u32,
    changed: u32,
    too_many: u32,
    padding: u32
}

struct Adaptation {
    thresholds: package_lightshed__1octree_adaptation_OctreeThresholds,
    stride: u32,
    padding0: u32,
    padding1: u32,
    padding2: u32
}

@group(0) @binding(0)
var<storage, read> adaptation: Adaptation;

@group(0) @binding(1)
var<storage, read> former_slots: array<u32>;

@group(0) @binding(2)
var<storage, read> former_state: OctreeState;

@group(0) @binding(3)
var<storage, read_write> octree_state: OctreeState;

@group(0) @binding(4)
var<storage, read_write> new_nodes: array<u32>;

@group(0) @binding(5)
var<storage, read_write> octree_parents: array<u32>;

@group(0) @binding(6)
var<storage, read_write> octree_depths: array<u32>;

@group(0) @binding(7)
var<storage, read_write> correspondences: array<u32>;

@group(0) @binding(8)
var<storage, read_write> origins: array<u32>;

fn load_octree_count(slot: u32) -> u32 {
    return former_slots[slot];
}

var<workgroup> of_level: u32;

var<workgroup> any_changed: atomic<u32>;

@compute @workgroup_size(256)
fn adapt(@builtin(local_invocation_index) lane: u32) {
    let thresholds = adaptation.thresholds;
    if lane == 0u {
        origins[0] = 0u;
        octree_parents[0] = 0u;
        octree_depths[0] = 0u;
        atomicStore(&any_changed, 0u);
    }
    storageBarrier();
    workgroupBarrier();
    var start = 0u;
    var end = 1u;
    var depth = 0u;
    var too_many = false;
    while (start < end) {
        let each = (end - start + package_group_GROUP - 1u) / package_group_GROUP;
        let first = min(start + lane * each, end);
        let last = min(first + each, end);
        var own = 0u;
        for (var slot = 8u * first; slot < 8u * last; slot++) {
            let rebuilt = package_lightshed__1octree_adaptation__1octree_rebuilt(origins[slot / 8u], slot % 8u, depth, thresholds);
            own += select(1u, 0u, rebuilt.is_leaf);
            if rebuilt.changed {
                atomicStore(&any_changed, 1u);
            }
        }
        let up_to = package_group__2sum_up_to(lane, own);
        if lane == package_group_GROUP - 1u {
            of_level = up_to;
        }
        let total = workgroupUniformLoad(&of_level);
        if end + total > thresholds.max_nodes {
            too_many = true;
            break;
        }
        var next = end + up_to - own;
        for (var node = first; node < last; node++) {
            let first_inner = next;
            var leaves = 0u;
            for (var child = 0u; child < 8u; child++) {
                let slot = 8u * node + child;
                let rebuilt = package_lightshed__1octree_adaptation__1octree_rebuilt(origins[node], child, depth, thresholds);
                if rebuilt.is_leaf {
                    leaves |= 1u << child;
                    correspondences[slot] = rebuilt.origin;
                }
                else {
                    correspondences[slot] = package_lightshed_ray_NOTHING;
                    origins[next] = rebuilt.origin;
                    octree_parents[next] = slot;
                    octree_depths[next] = depth + 1u;
                    next++;
                }
            }
            new_nodes[node] = (select(first_inner, 0u, leaves == 255u) << 8u) | leaves;
        }
        start = end;
        end += total;
        depth++;
        storageBarrier();
        workgroupBarrier();
    }
    if lane == 0u {
        octree_state = OctreeState(end, atomicLoad(&any_changed), u32(too_many), 0u);
    }
}

@compute @workgroup_size(256)
fn populate(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    let stride = adaptation.stride;
    let slot = i / stride;
    if slot >= 8u * octree_state.nodes {
        return;
    }
    let source = package_lightshed__1octree_adaptation__1octree_source(correspondences[slot]);
    var word = 0u;
    if source < 8u * former_state.nodes {
        word = former_slots[source * stride + i % stride];
    }
    origins[i] = word;
}

const package_group_GROUP: u32 = 256u;

fn package_group__1index_of(group: vec3u, groups: vec3u, lane: u32) -> u32 {
    return (group.y * groups.x + group.x) * package_group_GROUP + lane;
}

fn package_group__2sum_up_to(lane: u32, own: u32) -> u32 {
    package_group_parts[lane] = own;
    workgroupBarrier();
    for (var step = 1u; step < package_group_GROUP; step *= 2u) {
        var sum = package_group_parts[lane];
        if lane >= step {
            sum += package_group_parts[lane - step];
        }
        workgroupBarrier();
        package_group_parts[lane] = sum;
        workgroupBarrier();
    }
    return package_group_parts[lane];
}

var<workgroup> package_group_parts: array<u32, 256>;

struct package_lightshed__1octree_adaptation_OctreeThresholds {
    split_above: u32,
    collapse_below: u32,
    max_depth: u32,
    max_nodes: u32
}

struct package_lightshed__1octree_adaptation_RebuiltChild {
    is_leaf: bool,
    origin: u32,
    changed: bool
}

const package_lightshed__1octree_adaptation__1FROM_LEAF: u32 = 2147483648u;

const package_lightshed__1octree_adaptation__1KIND_SHIFT: u32 = 27u;

fn package_lightshed__1octree_adaptation__1octree_rebuilt(origin: u32, child: u32, depth: u32, thresholds: package_lightshed__1octree_adaptation_OctreeThresholds) -> package_lightshed__1octree_adaptation_RebuiltChild {
    if (origin & package_lightshed__1octree_adaptation__1FROM_LEAF) != 0u {
        return package_lightshed__1octree_adaptation_RebuiltChild(true, (origin & ~package_lightshed__1octree_adaptation__1FROM_LEAF) | (1u << package_lightshed__1octree_adaptation__1KIND_SHIFT), false);
    }
    let inner = package_memory_octree__2load_octree_node(origin);
    let slot = 8u * origin + child;
    if package_lightshed_octree__2is_octree_leaf(inner, child) {
        if load_octree_count(slot) > thresholds.split_above && depth + 1u < thresholds.max_depth {
            return package_lightshed__1octree_adaptation_RebuiltChild(false, slot | package_lightshed__1octree_adaptation__1FROM_LEAF, true);
        }
        return package_lightshed__1octree_adaptation_RebuiltChild(true, slot, false);
    }
    let below = package_lightshed_octree__1octree_inner(inner, child);
    if (package_memory_octree__2load_octree_node(below) & 255u) == 255u {
        var together = 0u;
        var most = 0u;
        var largest = 0u;
        for (var part = 0u; part < 8u; part++) {
            let count = load_octree_count(8u * below + part);
            together += min(count, ~together);
            if count > most {
                most = count;
                largest = part;
            }
        }
        if together < thresholds.collapse_below {
            return package_lightshed__1octree_adaptation_RebuiltChild(true, (8u * below + largest) | (2u << package_lightshed__1octree_adaptation__1KIND_SHIFT), true);
        }
    }
    return package_lightshed__1octree_adaptation_RebuiltChild(false, below, false);
}

fn package_lightshed__1octree_adaptation__1octree_source(was: u32) -> u32 {
    return select(was & ((1u << package_lightshed__1octree_adaptation__1KIND_SHIFT) - 1u), package_lightshed_ray_NOTHING, was == package_lightshed_ray_NOTHING);
}

fn package_lightshed_octree__1octree_inner(node: u32, child: u32) -> u32 {
    return (node >> 8u) + countOneBits(~node & 255u & ((1u << child) - 1u));
}

fn package_lightshed_octree__2is_octree_leaf(node: u32, child: u32) -> bool {
    return ((node >> child) & 1u) != 0u;
}

const package_lightshed_ray_NOTHING: u32 = 4294967295u;

@group(1) @binding(15)
var<storage, read> package_memory_octree__1octree_nodes: array<u32>;

fn package_memory_octree__2load_octree_node(index: u32) -> u32 {
    return package_memory_octree__1octree_nodes[index];
}
