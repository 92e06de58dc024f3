//! Every operation against scalar code, and every kind of lanes against plain arrays, bit for bit.

use super::*;

/// What comparisons and arithmetic get wrong first.
const HOSTILE: [f32; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
    f32::MIN_POSITIVE,
    1e-45,
    -1e-45,
    f32::MAX,
    f32::MIN,
    0.1,
    -3.5,
    16_777_216.0,
    1.5e-20,
];

/// All NaNs count as equal: no kind of lanes promises which operand's payload survives.
fn bits(value: f32) -> u32 {
    if value.is_nan() { u32::MAX } else { value.to_bits() }
}

/// Rows of lanes in which each hostile value meets each.
fn pairs() -> Vec<[[f32; LANES]; 2]> {
    let all: Vec<[f32; 2]> = HOSTILE.iter().flat_map(|&a| HOSTILE.map(|b| [a, b])).collect();
    all.chunks_exact(LANES)
        .map(|chunk| [0, 1].map(|side| core::array::from_fn(|lane| chunk[lane][side])))
        .collect()
}

/// Everything that lanes do to `a` and `b`, one row each.
struct Everything<'a> {
    a: &'a [f32; LANES],
    b: &'a [f32; LANES],
    mask: u32,
}

/// Makes bounds that no `f32` is.
const ABOVE_ONE: f64 = 1.0 + 1e-9;

impl LaneKernel for Everything<'_> {
    const HOT: bool = true;
    type Output = (Vec<[f32; LANES]>, Vec<u32>);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let (a, b) = (L::load(self.a), L::load(self.b));
        let mask = L::Mask::from_bits(self.mask);
        let words = a.to_bits() + b.to_bits();
        let mixed = words.rotate::<13, 19>() ^ (a.to_bits() & b.to_bits());
        let rows = vec![
            (a + b).store(),
            (a - b).store(),
            (a * b).store(),
            (a / b).store(),
            (-a).store(),
            a.evens_and_odds(b)[0].store(),
            a.evens_and_odds(b)[1].store(),
            a.total().store(),
            a.running_sums().store(),
            a.min(b).store(),
            a.max(b).store(),
            a.sqrt().store(),
            a.abs().store(),
            a.copysign(b).store(),
            a.select(mask, b).store(),
            L::splat(self.a[3]).store(),
            L::from_bits(L::Words::load(&self.a.map(f32::to_bits))).store(),
            L::from_integers(mixed.shift_right::<8>()).store(),
            L::from_integers((mixed * words).shift_right::<8>()).store(),
            L::from_integers((L::from_integers(mixed.shift_right::<8>()) * L::splat(0.37)).to_integers())
                .store(),
            L::pick(&[1.0, 2.0, 3.0, 4.0], L::from_bits(mixed)).store(),
            L::from_integers(mixed.reverse_bits().shift_right::<8>()).store(),
            L::from_integers(L::Words::lookup(&[9, 8, 7, 6, 5, 4, 3, 2], mixed)).store(),
            [a.first(); LANES],
            [a.lane(self.mask as usize); LANES],
            a.delayed().store(),
        ];
        let masks = vec![
            a.equal(b).bits(),
            a.less(b).bits(),
            a.less_equal(b).bits(),
            a.count_at_most(f64::from(self.b[0]) * ABOVE_ONE) as u32,
            (a.less(b) & mask).bits(),
            (a.less(b) | mask).bits(),
            (!mask).bits(),
        ];
        (rows, masks)
    }
}

/// The sum of values up to `last`: of halves of halves, or zero where there is no half before.
fn running_sum(v: &[f32; LANES], last: usize) -> f32 {
    let pair = |i: usize| v[i] + if i % 2 == 1 { v[i - 1] } else { 0.0 };
    let four = |i: usize| pair(i) + if i % 4 >= 2 { pair(i / 4 * 4 + 1) } else { 0.0 };
    four(last) + if last >= 4 { four(3) } else { 0.0 }
}

/// The same by scalar code.
fn expected(a: [f32; LANES], b: [f32; LANES], mask: u32) -> (Vec<[f32; LANES]>, Vec<u32>) {
    let each = |f: &dyn Fn(f32, f32) -> f32| core::array::from_fn(|i| f(a[i], b[i]));
    let set = |i: usize| mask >> i & 1 == 1;
    let mixed =
        |x: f32, y: f32| x.to_bits().wrapping_add(y.to_bits()).rotate_left(13) ^ (x.to_bits() & y.to_bits());
    let rows = vec![
        each(&|x, y| x + y),
        each(&|x, y| x - y),
        each(&|x, y| x * y),
        each(&|x, y| x / y),
        each(&|x, _| -x),
        core::array::from_fn(|i| if i < 4 { a[2 * i] } else { b[2 * i - 8] }),
        core::array::from_fn(|i| if i < 4 { a[2 * i + 1] } else { b[2 * i - 7] }),
        [((a[0] + a[1]) + (a[2] + a[3])) + ((a[4] + a[5]) + (a[6] + a[7])); LANES],
        core::array::from_fn(|i| running_sum(&a, i)),
        each(&|x, y| if x < y { x } else { y }),
        each(&|x, y| if x > y { x } else { y }),
        each(&|x, _| x.sqrt()),
        each(&|x, _| x.abs()),
        each(&f32::copysign),
        core::array::from_fn(|i| if set(i) { a[i] } else { b[i] }),
        [a[3]; LANES],
        a,
        each(&|x, y| (mixed(x, y) >> 8) as f32),
        each(&|x, y| {
            let product = mixed(x, y).wrapping_mul(x.to_bits().wrapping_add(y.to_bits()));
            (product >> 8) as f32
        }),
        each(&|x, y| ((mixed(x, y) >> 8) as f32 * 0.37).floor()),
        each(&|x, y| (mixed(x, y) & 3) as f32 + 1.0),
        each(&|x, y| (mixed(x, y).reverse_bits() >> 8) as f32),
        each(&|x, y| 9.0 - (mixed(x, y) & 7) as f32),
        [a[0]; LANES],
        [a[mask as usize % LANES]; LANES],
        core::array::from_fn(|i| if i > 0 { a[i - 1] } else { 0.0 }),
    ];
    let bits = |f: &dyn Fn(usize) -> bool| (0..LANES).fold(0, |bits, i| bits | u32::from(f(i)) << i);
    let masks = vec![
        bits(&|i| a[i] == b[i]),
        bits(&|i| a[i] < b[i]),
        bits(&|i| a[i] <= b[i]),
        bits(&|i| f64::from(a[i]) <= f64::from(b[0]) * ABOVE_ONE).count_ones(),
        bits(&|i| a[i] < b[i] && set(i)),
        bits(&|i| a[i] < b[i] || set(i)),
        bits(&|i| !set(i)),
    ];
    (rows, masks)
}

fn assert_same(found: &(Vec<[f32; LANES]>, Vec<u32>), expected: &(Vec<[f32; LANES]>, Vec<u32>)) {
    assert_eq!(found.1, expected.1, "masks");
    for (number, (found, expected)) in found.0.iter().zip(&expected.0).enumerate() {
        assert_eq!(
            found.map(bits),
            expected.map(bits),
            "row {number}: {found:?} for {expected:?}"
        );
    }
}

#[test]
fn operations_are_those_of_scalars() {
    for (number, [a, b]) in (0u32..).zip(pairs()) {
        let mask = number.wrapping_mul(0x9e37_79b9) >> 24;
        for choice in LaneChoice::all() {
            let found = choice.run(Everything { a: &a, b: &b, mask });
            assert_same(&found, &expected(a, b, mask));
        }
    }
}

/// What lanes of any number do, to sixteen values of `a` and `b` in columns.
struct Long<'a> {
    a: &'a Column,
    b: &'a Column,
    mask: u32,
}

/// Rows of [`Long`].
const LONG_ROWS: usize = 17;

impl Long<'_> {
    #[inline(always)]
    fn run_on<L: AnyLanes>(self) -> Vec<Column> {
        let mut rows = vec![Column::splat(0.0); LONG_ROWS];
        for place in (0..MOST_LANES).step_by(L::COUNT) {
            let (a, b) = (self.a.read::<L>(place), self.b.read::<L>(place));
            let mask = L::Mask::from_bits(self.mask >> place);
            let (one, zero) = (L::splat(1.0), L::splat(0.0));
            let found: [L; LONG_ROWS] = [
                a + b,
                a - b,
                a * b,
                a / b,
                -a,
                a.min(b),
                a.max(b),
                a.sqrt(),
                a.abs(),
                a.times_sign(b),
                a.select(mask, b),
                L::pick(&[1.0, 2.0, 3.0, 4.0], a + b),
                one.select(a.equal(b), zero),
                one.select(a.less(b) & mask, zero),
                one.select(a.less_equal(b) | mask, zero),
                one.select(!mask, zero),
                one.select(L::Mask::from_bits(a.less(b).bits()), zero),
            ];
            for (row, found) in rows.iter_mut().zip(found) {
                row.write(place, found);
            }
        }
        rows
    }
}

impl LaneKernel for Long<'_> {
    const HOT: bool = true;
    type Output = [Vec<Column>; 2];

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { a, b, mask } = self;
        [Self { a, b, mask }.run_on::<L>(), self.run_on::<L::Long>()]
    }
}

#[test]
fn lanes_of_any_number_do_what_scalars_do() {
    for (number, [a, b]) in (0u32..).zip(pairs()) {
        let mask = number.wrapping_mul(0x9e37_79b9) >> 16;
        let set = |i: usize| mask >> i & 1 == 1;
        let (x, y) = (
            |i: usize| a[i % LANES],
            |i: usize| if i < LANES { b[i] } else { a[15 - i] },
        );
        let truth = |of: &dyn Fn(usize) -> bool| core::array::from_fn(|i| f32::from(u8::from(of(i))));
        let each = |f: &dyn Fn(f32, f32) -> f32| core::array::from_fn(|i| f(x(i), y(i)));
        let expected: [[f32; MOST_LANES]; LONG_ROWS] = [
            each(&|x, y| x + y),
            each(&|x, y| x - y),
            each(&|x, y| x * y),
            each(&|x, y| x / y),
            each(&|x, _| -x),
            each(&|x, y| if x < y { x } else { y }),
            each(&|x, y| if x > y { x } else { y }),
            each(&|x, _| x.sqrt()),
            each(&|x, _| x.abs()),
            each(&|x, y| if y.is_sign_negative() { -x } else { x }),
            core::array::from_fn(|i| if set(i) { x(i) } else { y(i) }),
            each(&|x, y| ((x + y).to_bits() & 3) as f32 + 1.0),
            truth(&|i| x(i) == y(i)),
            truth(&|i| x(i) < y(i) && set(i)),
            truth(&|i| x(i) <= y(i) || set(i)),
            truth(&|i| !set(i)),
            truth(&|i| x(i) < y(i)),
        ];
        let (mut columns, nan) = ([const { Column::splat(0.0) }; 2], |v: f32| v.is_nan());
        for i in 0..MOST_LANES {
            columns[0].set(i, x(i));
            columns[1].set(i, y(i));
        }
        for choice in LaneChoice::all() {
            let [a, b] = &columns;
            for found in choice.run(Long { a, b, mask }) {
                for (row, (found, expected)) in found.iter().zip(&expected).enumerate() {
                    for (lane, &expected) in expected.iter().enumerate() {
                        // A NaN's bits are not promised, so what is picked by them is not either.
                        let skip = row == 10 && nan(x(lane) + y(lane));
                        assert!(
                            skip || bits(found.get(lane)) == bits(expected),
                            "{choice:?}, row {row}, lane {lane}: {} for {expected}",
                            found.get(lane)
                        );
                    }
                }
            }
        }
    }
}

/// The lanes of a processor have names, by which they can be asked for, and the specification is
/// the first.
#[test]
fn lanes_have_names() {
    let names: Vec<&str> = LaneChoice::all().iter().map(|lanes| lanes.name()).collect();
    assert!(["array", "avx2", "avx512"].starts_with(&names), "{names:?}");
    assert!(names.contains(&LaneChoice::best().name()));
    for name in ["avx2", "avx512"] {
        if !names.contains(&name) {
            println!("SKIPPED: this processor has no lanes {name}");
        }
    }
}

/// Moves among lanes: flipped, compressed, and the least, as eight lanes and as the longest.
struct Moves {
    values: [f32; MOST_LANES],
    mask: u32,
    flip: u32,
}

impl Moves {
    /// Rows of the first lanes.
    #[inline(always)]
    fn run_on<L: AnyLanes>(&self) -> (usize, [[f32; MOST_LANES]; 3]) {
        let mask = self.mask & (u32::MAX >> (32 - L::COUNT));
        let values = L::read(&self.values.map(f32::to_bits));
        let moved = [
            values.flipped(self.flip % L::COUNT as u32),
            values.compress(mask),
            values.least_of(mask),
        ];
        let mut rows = [[0; MOST_LANES]; 3];
        for (row, moved) in rows.iter_mut().zip(moved) {
            moved.write(row);
        }
        (L::COUNT, rows.map(|row| row.map(f32::from_bits)))
    }
}

impl LaneKernel for Moves {
    const HOT: bool = true;
    type Output = [(usize, [[f32; MOST_LANES]; 3]); 2];

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        [self.run_on::<L>(), self.run_on::<L::Long>()]
    }
}

/// Every mask of eight lanes with every flip, and of sixteen with some.
#[test]
fn moves_keep_the_chosen_lanes_in_order() {
    let values = [
        5.0, -1.0, 3.0, 9.0, -7.0, 0.5, 2.0, 4.0, 8.0, -2.5, 6.0, -9.0, 1.0, 7.5, -0.25, 3.5,
    ];
    for choice in LaneChoice::all() {
        for case in 0..8_192u32 {
            // The lower half counts on, and the upper one changes with it.
            let (mask, flip) = ((case * 40_503) & 0xff00 | case & 0xff, case / 256 % 16);
            for (count, [flipped, compressed, least]) in choice.run(Moves { values, mask, flip }) {
                for lane in 0..count {
                    assert_eq!(flipped[lane], values[lane ^ (flip as usize % count)]);
                }
                let set = (0..count).filter(|lane| mask >> lane & 1 == 1);
                let chosen: Vec<f32> = set.map(|lane| values[lane]).collect();
                assert_eq!(compressed[..chosen.len()], chosen[..], "{choice:?}: {mask:b}");
                let smallest = chosen.iter().copied().fold(f32::INFINITY, f32::min);
                assert_eq!(least[..count], vec![smallest; count], "{choice:?}: {mask:b}");
            }
        }
    }
}

struct Transpose<'a>(&'a [[f32; LANES]; LANES]);

impl LaneKernel for Transpose<'_> {
    const HOT: bool = true;
    type Output = [[f32; LANES]; LANES];

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let [a, b, c, d, e, f, g, h] = self.0;
        let columns = L::load_transposed([a, b, c, d, e, f, g, h]);
        let mut rows = [[0.0; LANES]; LANES];
        for (row, column) in rows.iter_mut().zip(columns) {
            *row = column.store();
        }
        rows
    }
}

#[test]
fn transposes_exchange_rows_and_columns() {
    let rows: [[f32; LANES]; LANES] = core::array::from_fn(|i| core::array::from_fn(|j| (10 * i + j) as f32));
    for choice in LaneChoice::all() {
        let columns = choice.run(Transpose(&rows));
        for i in 0..LANES {
            for j in 0..LANES {
                assert_eq!(columns[j][i], rows[i][j]);
            }
        }
    }
}

struct Pairs<'a>(&'a [[f32; 2]; LANES]);

impl LaneKernel for Pairs<'_> {
    const HOT: bool = true;
    type Output = [[f32; LANES]; 2];

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let [a, b, c, d, e, f, g, h] = self.0;
        let [first, second] = L::load_pairs([a, b, c, d, e, f, g, h]);
        [first.store(), second.store()]
    }
}

#[test]
fn pairs_are_taken_apart() {
    let pairs: [[f32; 2]; LANES] = core::array::from_fn(|i| [i as f32, (10 + i) as f32]);
    for choice in LaneChoice::all() {
        let columns = choice.run(Pairs(&pairs));
        for j in 0..2 {
            assert_eq!(columns[j], pairs.map(|pair| pair[j]));
        }
    }
}

struct Append<'a> {
    column: &'a mut Column,
    place: usize,
    values: [f32; LANES],
    mask: u32,
}

impl LaneKernel for Append<'_> {
    const HOT: bool = true;
    type Output = [f32; LANES];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [f32; LANES] {
        self.column
            .store_compressed(self.place, L::load(&self.values), self.mask);
        self.column.load::<L>(self.place).store()
    }
}

#[test]
fn columns_are_filled_without_gaps() {
    for choice in LaneChoice::all() {
        let mut column = Column::splat(-1.0);
        let mut expected = Vec::new();
        let mut number = 0u32;
        while expected.len() < Column::CAPACITY {
            let left = Column::CAPACITY - expected.len();
            let mut mask = number.wrapping_mul(0x9e37_79b9) >> 24;
            while mask.count_ones() as usize > left {
                mask &= mask - 1;
            }
            let values: [f32; LANES] = core::array::from_fn(|lane| (8 * number) as f32 + lane as f32);
            let loaded = choice.run(Append {
                column: &mut column,
                place: expected.len(),
                values,
                mask,
            });
            let chosen: Vec<f32> = (0..LANES)
                .filter(|lane| mask >> lane & 1 == 1)
                .map(|lane| values[lane])
                .collect();
            assert_eq!(loaded[..chosen.len()], chosen[..]);
            expected.extend(chosen);
            number += 1;
        }
        let found: Vec<f32> = (0..Column::CAPACITY).map(|index| column.get(index)).collect();
        assert_eq!(found, expected);
        column.set_word(3, 0x7fa0_0001);
        assert_eq!(
            column.get_word(3),
            0x7fa0_0001,
            "words keep bits that are no number"
        );
    }
}

/// The comparison above can fail.
#[test]
fn a_wrong_bit_is_seen() {
    let [a, b] = pairs()[1];
    let mut found = expected(a, b, 7);
    found.0[0][2] = -found.0[0][2];
    let caught = std::panic::catch_unwind(|| assert_same(&found, &expected(a, b, 7)));
    assert!(caught.is_err());
}

/// Lists that begin and end within pages keep their values, and what is said to lie in huge pages
/// does, by the system's own account of this process.
#[test]
fn lists_move_into_huge_pages_and_keep_their_values() {
    assert_eq!(use_huge_pages::<u64>(&[]), 0);
    assert_eq!(use_huge_pages(&[1u8; 3000]), 0);
    assert_eq!(use_huge_pages(&[(); 1 << 40]), 0);
    let list: Vec<u64> = (0..(40 << 17) + 321).collect();
    let part = &list[77..];
    let before = in_huge_pages(part);
    let moved = use_huge_pages(part);
    assert!(list.iter().copied().eq(0..list.len() as u64));
    if moved == 0 {
        println!("SKIPPED: the system has no huge pages");
        return;
    }
    // All but what lies in the first and the last huge page.
    assert!(moved > 37 << 20 && moved <= size_of_val(part), "{moved}");
    let now = in_huge_pages(part);
    assert!(
        now >= moved && now > before,
        "{before}, then {now} of {moved} bytes"
    );
}

/// Resizing is that of `Vec`, and what memory it gets is asked for in huge pages once.
#[test]
fn lists_are_resized_as_vectors_are() {
    let (mut list, mut expected) = (vec![5u64; 3], vec![5u64; 3]);
    for (count, value) in [(0, 1), (9, 2), (4, 3), (6 << 18, 4), (7, 5), (5 << 18, 6)] {
        resize_in_huge_pages(&mut list, count, value);
        expected.resize(count, value);
        assert!(list == expected, "{count}");
    }
    let setting = std::fs::read_to_string("/sys/kernel/mm/transparent_hugepage/enabled");
    if !setting.is_ok_and(|setting| setting.contains("[madvise]") || setting.contains("[always]")) {
        println!("SKIPPED: the system has no huge pages");
        return;
    }
    let mut fresh = Vec::new();
    resize_in_huge_pages(&mut fresh, 40 << 20, 1u8);
    assert!(in_huge_pages(&fresh) >= 36 << 20, "{}", in_huge_pages(&fresh));
}

/// Bytes in huge pages of the mappings that a list lies in.
fn in_huge_pages<T>(list: &[T]) -> usize {
    let list = list.as_ptr_range();
    let maps = std::fs::read_to_string("/proc/self/smaps").unwrap_or_default();
    let number = |text: &str| usize::from_str_radix(text, 16).ok();
    let (mut inside, mut kib) = (false, 0);
    for line in maps.lines() {
        let mut words = line.split_whitespace();
        let first = words.next().unwrap_or_default();
        if let Some((start, end)) = first.split_once('-')
            && let (Some(start), Some(end)) = (number(start), number(end))
        {
            inside = start < list.end.addr() && list.start.addr() < end;
        } else if inside && first == "AnonHugePages:" {
            kib += words.next().and_then(|kib| kib.parse().ok()).unwrap_or(0);
        }
    }
    kib << 10
}
