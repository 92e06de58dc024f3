//! Runs a function on the device and here, over many inputs, and compares the words that come out.

pub(crate) use crate::tests::support::gpu;
use crate::{Access, Buffer, Gpu};
use lightshed_sampling::CounterRng;
use lightshed_shaders::Linker;
use std::cell::Cell;

/// Inputs of a function.
pub const COUNT: usize = 1 << 16;

/// A function as the device runs it: what it imports, and the body of `fn run(i: u32)`, which reads
/// `word(k)` and `number(k)` and writes by `put(k, word)` and `put_f(k, number)`.
pub struct Shader<'a> {
    pub imports: &'a str,
    pub host: &'a str,
    pub body: &'a str,
    /// Buffers that the host's functions read, from binding 2 on.
    pub buffers: &'a [&'a Buffer],
    /// Buffers that they write, after those.
    pub written: &'a [&'a Buffer],
    /// A fault: a part of the linked text, and what stands in its place.
    pub planted: Option<[&'a str; 2]>,
}

impl<'a> Shader<'a> {
    pub fn new(imports: &'a str, body: &'a str) -> Self {
        Self {
            imports,
            host: "",
            body,
            buffers: &[],
            written: &[],
            planted: None,
        }
    }

    /// Asserts that the shader agrees with the library, and with none of these faults planted. On a
    /// device that rounds otherwise faults are not planted: some change less than its rounding.
    pub fn check_with_faults(
        &self,
        faults: &[[&str; 2]],
        agree: impl for<'s> Fn(&Shader<'s>) -> Result<(), String>,
    ) {
        let Some(gpu) = gpu() else { return };
        if !held(gpu, || agree(self)) {
            return;
        }
        for &fault in faults {
            let planted = Shader {
                planted: Some(fault),
                ..*self
            };
            assert!(agree(&planted).is_err(), "{fault:?}");
        }
    }

    /// The words that come out for each input.
    pub fn run<const I: usize, const O: usize>(&self, gpu: &Gpu, inputs: &[[u32; I]]) -> Vec<[u32; O]> {
        let main = format!(
            "{imports}
            @group(0) @binding(0) var<storage, read> inputs: array<u32>;
            @group(0) @binding(1) var<storage, read_write> outputs: array<u32>;
            var<private> place: u32;
            fn word(k: u32) -> u32 {{ return inputs[place * {I}u + k]; }}
            fn number(k: u32) -> f32 {{ return bitcast<f32>(word(k)); }}
            fn put(k: u32, x: u32) {{ outputs[place * {O}u + k] = x; }}
            fn put_f(k: u32, x: f32) {{ put(k, bitcast<u32>(x)); }}
            fn put_2(k: u32, x: vec2f) {{ put_f(k, x.x); put_f(k + 1u, x.y); }}
            fn put_3(k: u32, x: vec3f) {{ put_f(k, x.x); put_f(k + 1u, x.y); put_f(k + 2u, x.z); }}
            @compute @workgroup_size(64)
            fn main(@builtin(global_invocation_id) id: vec3u) {{
                place = id.x;
                if id.x < {count}u {{ run(); }}
            }}
            fn run() {{ {body} }}",
            imports = self.imports,
            body = self.body,
            count = inputs.len(),
        );
        let mut wgsl = Linker::new()
            .module("package::main", main)
            .module("package::host", self.host)
            .link("package::main")
            .expect("the shader links");
        if let Some([right, wrong]) = self.planted {
            assert!(wgsl.contains(right), "{right}");
            wgsl = wgsl.replace(right, wrong);
        }
        let mut access = vec![Access::Read, Access::Write];
        access.resize(2 + self.buffers.len(), Access::Read);
        access.resize(access.len() + self.written.len(), Access::Write);
        let kernel = gpu
            .kernel("parity", &wgsl, "main", &access, &[])
            .unwrap_or_else(|error| panic!("{error}\n{wgsl}"));
        let words: Vec<u32> = inputs.iter().flatten().copied().collect();
        let inputs_buffer = gpu.buffer("inputs", &words).expect("inputs are few");
        let outputs = gpu
            .zeros("outputs", (inputs.len() * O * 4) as u64)
            .expect("outputs are few");
        let mut buffers = vec![&inputs_buffer, &outputs];
        buffers.extend(self.buffers);
        buffers.extend(self.written);
        let mut work = gpu.work();
        work.dispatch(&kernel, &buffers, [inputs.len().div_ceil(64) as u32, 1, 1]);
        work.submit();
        let words: Vec<u32> = gpu.read(&outputs, inputs.len() * O).expect("the device answers");
        words
            .chunks_exact(O)
            .map(|words| core::array::from_fn(|k| words[k]))
            .collect()
    }
}

/// How far two words may be apart.
#[derive(Clone, Copy, Debug)]
pub enum Tier {
    /// The same words, whatever they mean.
    Words,
    /// The same bits; any NaN is equal to any other.
    Exact,
    /// Numbers that differ by at most `absolute + relative · |truth|`; infinities and NaN as they
    /// are.
    Bounded { absolute: f32, relative: f32 },
}

thread_local! {
    /// Whether this thread compares as [`held`] says.
    static IS_ROUNDED: Cell<bool> = const { Cell::new(false) };
}

/// Asserts a comparison, and says whether faults can be told from rounding. On a device that rounds
/// otherwise ([`Gpu::is_exact`]) numbers may be a thousandth apart, and one input in twenty more
/// than that: there rounding decides otherwise, or a subnormal number is taken for zero.
pub fn held(gpu: &Gpu, comparison: impl FnOnce() -> Result<(), String>) -> bool {
    IS_ROUNDED.set(!gpu.is_exact());
    let found = comparison();
    IS_ROUNDED.set(false);
    assert_eq!(found, Ok(()));
    gpu.is_exact()
}

impl Tier {
    fn agree(self, found: u32, truth: u32) -> bool {
        let (a, b) = (f32::from_bits(found), f32::from_bits(truth));
        if found == truth {
            return true;
        }
        // Small integers are no numbers that rounding changes.
        if IS_ROUNDED.get() && found.max(truth) >= f32::MIN_POSITIVE.to_bits() {
            return a.is_nan() && b.is_nan() || a == b || (a - b).abs() <= 1e-3 * b.abs() + 1e-6;
        }
        match self {
            Self::Words => false,
            _ if a.is_nan() && b.is_nan() => true,
            Self::Exact => false,
            Self::Bounded { absolute, relative } => {
                a == b || (a.is_finite() && b.is_finite() && (a - b).abs() <= absolute + relative * b.abs())
            }
        }
    }
}

/// Compares word by word; the first difference as an error, with how many there are.
pub fn compare<const I: usize, const O: usize>(
    name: &str,
    tier: Tier,
    inputs: &[[u32; I]],
    found: &[[u32; O]],
    truth: impl Fn(&[u32; I]) -> [u32; O],
) -> Result<(), String> {
    assert_eq!(inputs.len(), found.len());
    let mut first = None;
    let mut count = 0;
    for (input, found) in inputs.iter().zip(found) {
        let truth = truth(input);
        let differs = (0..O).find(|&k| !tier.agree(found[k], truth[k]));
        if let Some(k) = differs {
            count += 1;
            first.get_or_insert_with(|| {
                let number = |words: &[u32]| -> Vec<(u32, f32)> {
                    words.iter().map(|&w| (w, f32::from_bits(w))).collect()
                };
                format!(
                    "word {k} at {:?}: found {:?}, truth {:?}",
                    number(input),
                    number(found),
                    number(&truth)
                )
            });
        }
    }
    let few = if IS_ROUNDED.get() { inputs.len() / 20 } else { 0 };
    match first.filter(|_| count > few) {
        Some(first) => Err(format!("{name}: {count} of {} differ; {first}", inputs.len())),
        None => Ok(()),
    }
}

/// Runs `shader` and `truth` on `inputs`; skipped where there is no device.
pub fn check<const I: usize, const O: usize>(
    name: &str,
    tier: Tier,
    shader: &Shader,
    inputs: &[[u32; I]],
    truth: impl Fn(&[u32; I]) -> [u32; O],
) {
    let Some(gpu) = gpu() else { return };
    let found = shader.run::<I, O>(gpu, inputs);
    held(gpu, || compare(name, tier, inputs, &found, truth));
}

/// Words that arithmetic may stumble over: zeros, subnormals, the largest, infinities, NaN, powers
/// of two, one and its neighbours.
pub const HOSTILE: [u32; 24] = [
    0x0000_0000,
    0x8000_0000,
    0x0000_0001,
    0x8000_0001,
    0x007f_ffff,
    0x0080_0000,
    0x8080_0000,
    0x7f7f_ffff,
    0xff7f_ffff,
    0x7f80_0000,
    0xff80_0000,
    0x7fc0_0000,
    0xffff_ffff,
    0x3f80_0000,
    0xbf80_0000,
    0x3f7f_ffff,
    0x3f80_0001,
    0x3f00_0000,
    0x3eff_ffff,
    0x3400_0000,
    0x4b80_0000,
    0x5f00_0000,
    0x2000_0000,
    0x4049_0fdb,
];

fn rng(salt: u32) -> CounterRng {
    CounterRng::new(0x7061_7269_7479, salt, 0)
}

/// All bit patterns alike, hostile ones in each place among them.
pub fn words<const I: usize>(salt: u32) -> Vec<[u32; I]> {
    let mut rng = rng(salt);
    let mut inputs: Vec<[u32; I]> = hostile();
    inputs.resize_with(COUNT, || core::array::from_fn(|_| rng.next_u32()));
    inputs
}

/// Numbers uniform in [0, 1), its ends among them.
pub fn unit_numbers<const I: usize>(salt: u32) -> Vec<[u32; I]> {
    const ENDS: [f32; 7] = [
        0.0,
        1.0 / (1 << 24) as f32,
        0.25,
        0.5,
        0.499_999_97,
        0.75,
        1.0 - 1.0 / (1 << 24) as f32,
    ];
    let mut rng = rng(salt);
    let mut inputs = Vec::with_capacity(COUNT);
    for first in 0..ENDS.len().pow(I.min(3) as u32) {
        inputs.push(core::array::from_fn(|k| {
            ENDS[first / ENDS.len().pow(k.min(2) as u32) % ENDS.len()].to_bits()
        }));
    }
    inputs.resize_with(COUNT, || core::array::from_fn(|_| rng.next_f32().to_bits()));
    inputs
}

/// Unit vectors, axes and nearly axes among them.
pub fn directions(salt: u32) -> Vec<[u32; 3]> {
    let mut rng = rng(salt);
    let mut inputs = Vec::new();
    for axis in 0..3 {
        for sign in [1.0f32, -1.0] {
            for tilt in [0.0f32, -0.0, 1e-7, -1e-4] {
                let mut v = glam::Vec3::splat(tilt);
                v[axis] = sign;
                inputs.push(v.normalize().to_array().map(f32::to_bits));
            }
        }
    }
    inputs.resize_with(COUNT, || {
        lightshed_sampling::UniformSphere::sample(rng.next_2d())
            .to_array()
            .map(f32::to_bits)
    });
    inputs
}

fn hostile<const I: usize>() -> Vec<[u32; I]> {
    let n = HOSTILE.len();
    (0..n.pow(I.min(2) as u32))
        .map(|first| core::array::from_fn(|k| HOSTILE[(first / n.pow(k as u32 % 2) + k / 2) % n]))
        .collect()
}

pub fn floats<const N: usize>(words: &[u32; N]) -> [f32; N] {
    words.map(f32::from_bits)
}

pub fn bits<const N: usize>(numbers: [f32; N]) -> [u32; N] {
    numbers.map(f32::to_bits)
}
