//! Bytes, bits and numbers coded by range asymmetric numeral systems (rANS).

use super::{CUT_SHORT, Fault, INVALID, Spend};
use crate::import::limits::LoadResource;

/// Reads bytes from the front.
pub(super) struct Reader<'a> {
    data: &'a [u8],
}

impl<'a> Reader<'a> {
    pub(super) fn new(data: &'a [u8]) -> Self {
        Self { data }
    }

    /// Bytes that are left.
    pub(super) fn left(&self) -> usize {
        self.data.len()
    }

    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], Fault> {
        let (taken, rest) = self.data.split_at_checked(count).ok_or(CUT_SHORT)?;
        self.data = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let (taken, rest) = self.data.split_first_chunk().ok_or(CUT_SHORT)?;
        self.data = rest;
        Ok(*taken)
    }

    pub(super) fn u8(&mut self) -> Result<u8, Fault> {
        Ok(self.array::<1>()?[0])
    }

    pub(super) fn u16(&mut self) -> Result<u16, Fault> {
        Ok(u16::from_le_bytes(self.array()?))
    }

    pub(super) fn i32(&mut self) -> Result<i32, Fault> {
        Ok(i32::from_le_bytes(self.array()?))
    }

    pub(super) fn f32(&mut self) -> Result<f32, Fault> {
        Ok(f32::from_le_bytes(self.array()?))
    }

    /// A number of up to 32 bits, seven bits a byte, the lowest first.
    pub(super) fn variable(&mut self) -> Result<u32, Fault> {
        let mut value = 0_u64;
        for shift in (0..35).step_by(7) {
            let byte = self.u8()?;
            value |= u64::from(byte & 127) << shift;
            if byte < 128 {
                return u32::try_from(value).map_err(|_| INVALID.into());
            }
        }
        Err(INVALID.into())
    }

    /// The bytes whose number stands before them.
    pub(super) fn sized(&mut self) -> Result<&'a [u8], Fault> {
        let count = self.variable()?;
        self.take(count as usize)
    }

    /// What is left, bit by bit; [`skip_bits`](Self::skip_bits) goes on behind.
    pub(super) fn bits(&self) -> Bits<'a> {
        Bits::new(self.data)
    }

    /// Passes over the bytes that `bits` has begun.
    pub(super) fn skip_bits(&mut self, bits: &Bits) -> Result<(), Fault> {
        self.take(bits.next.div_ceil(8))?;
        Ok(())
    }

    /// Bits that are coded by the probability of zero.
    pub(super) fn coded_bits(&mut self) -> Result<CodedBits<'a>, Fault> {
        let zero = self.u8()?;
        CodedBits::new(zero, self.sized()?)
    }

    /// `count` coded numbers, of which `together` have one number of bits where that is stored.
    pub(super) fn symbols(
        &mut self,
        count: usize,
        together: usize,
        spend: &Spend,
    ) -> Result<Vec<u32>, Fault> {
        let bytes = 4 * count as u64;
        spend(LoadResource::Bytes, bytes)?;
        match self.u8()? {
            0 => self.tagged(count, together),
            1 => {
                let bits = u32::from(self.u8()?);
                if !(1..=18).contains(&bits) {
                    return Err(INVALID.into());
                }
                let mut coded = CodedSymbols::read(self, (3 * bits / 2).clamp(12, 20), count)?;
                Ok((0..count).map(|_| coded.next()).collect())
            }
            _ => Err(INVALID.into()),
        }
    }

    /// Numbers of bits are coded, the bits themselves follow.
    fn tagged(&mut self, count: usize, together: usize) -> Result<Vec<u32>, Fault> {
        let mut lengths = CodedSymbols::read(self, 12, count)?;
        let mut bits = self.bits();
        let mut values = Vec::with_capacity(count);
        for _ in 0..count / together.max(1) {
            let length = lengths.next();
            if length > 32 {
                return Err(INVALID.into());
            }
            for _ in 0..together {
                values.push(bits.take(length)?);
            }
        }
        self.skip_bits(&bits)?;
        Ok(values)
    }
}

/// Reads bits, the lowest of a byte first.
pub(super) struct Bits<'a> {
    data: &'a [u8],
    next: usize,
}

impl<'a> Bits<'a> {
    pub(super) fn new(data: &'a [u8]) -> Self {
        Self { data, next: 0 }
    }

    /// A number of so many bits.
    pub(super) fn take(&mut self, count: u32) -> Result<u32, Fault> {
        let mut value = 0;
        for bit in 0..count {
            let byte = self.data.get(self.next / 8).ok_or(CUT_SHORT)?;
            value |= u32::from(byte >> (self.next % 8) & 1) << bit;
            self.next += 1;
        }
        Ok(value)
    }
}

/// Stream of rANS, which is read from its end.
struct Stream<'a> {
    data: &'a [u8],
    state: u32,
    /// The state is at least this after a byte was added.
    least: u32,
}

impl<'a> Stream<'a> {
    /// The last byte says how many bytes the first state has.
    fn new(data: &'a [u8], least: u32, most_bytes: usize) -> Result<Self, Fault> {
        let last = *data.last().ok_or(CUT_SHORT)?;
        let bytes = usize::from(last >> 6) + 1;
        if bytes > most_bytes {
            return Err(INVALID.into());
        }
        let start = data.len().checked_sub(bytes).ok_or(CUT_SHORT)?;
        let state = data[start..]
            .iter()
            .rev()
            .fold(0, |state, &byte| state << 8 | u32::from(byte));
        let state = (state & !(3 << (8 * bytes - 2)))
            .checked_add(least)
            .ok_or(INVALID)?;
        Ok(Self {
            data: &data[..start],
            state,
            least,
        })
    }

    fn refill(&mut self) {
        while self.state < self.least
            && let Some((&byte, rest)) = self.data.split_last()
        {
            self.state = self.state << 8 | u32::from(byte);
            self.data = rest;
        }
    }
}

/// Bits of which zeros have a given probability.
pub(super) struct CodedBits<'a> {
    stream: Stream<'a>,
    /// Of 256, the probability of a one.
    one: u32,
}

impl<'a> CodedBits<'a> {
    fn new(zero: u8, data: &'a [u8]) -> Result<Self, Fault> {
        Ok(Self {
            stream: Stream::new(data, 4096, 3)?,
            one: 256 - u32::from(zero),
        })
    }

    pub(super) fn next(&mut self) -> bool {
        self.stream.refill();
        let (quotient, rest) = (self.stream.state / 256, self.stream.state % 256);
        let bit = rest < self.one;
        self.stream.state = if bit {
            quotient * self.one + rest
        } else {
            self.stream.state - quotient * self.one - self.one
        };
        bit
    }
}

/// Numbers of which each has a given probability.
struct CodedSymbols<'a> {
    stream: Stream<'a>,
    precision: u32,
    /// By remainder the number.
    table: Vec<u32>,
    /// By number the probability, and the sum of those before.
    shares: Vec<[u32; 2]>,
}

impl<'a> CodedSymbols<'a> {
    /// Probabilities are of `1 << bits`.
    fn read(reader: &mut Reader<'a>, bits: u32, count: usize) -> Result<Self, Fault> {
        let precision = 1_u32 << bits;
        let symbol_count = reader.variable()? as usize;
        // Each probability is of one at least, but for runs of up to 64 zeros a byte.
        if symbol_count / 64 > reader.left() || (symbol_count == 0 && count > 0) {
            return Err(INVALID.into());
        }
        let mut shares = Vec::with_capacity(symbol_count);
        let (mut table, mut sum) = (Vec::with_capacity(precision as usize), 0);
        while shares.len() < symbol_count {
            let byte = u32::from(reader.u8()?);
            if byte & 3 == 3 {
                let zeros = (byte >> 2) as usize + 1;
                if zeros > symbol_count - shares.len() {
                    return Err(INVALID.into());
                }
                shares.resize(shares.len() + zeros, [0, sum]);
                continue;
            }
            let mut share = byte >> 2;
            for extra in 0..byte & 3 {
                share |= u32::from(reader.u8()?) << (8 * extra + 6);
            }
            let symbol = shares.len() as u32;
            shares.push([share, sum]);
            sum += share;
            if sum > precision {
                return Err(INVALID.into());
            }
            table.resize(sum as usize, symbol);
        }
        if sum != precision {
            return Err(INVALID.into());
        }
        Ok(Self {
            stream: Stream::new(reader.sized()?, 4 * precision, 4)?,
            precision,
            table,
            shares,
        })
    }

    fn next(&mut self) -> u32 {
        self.stream.refill();
        let (quotient, rest) = (
            self.stream.state / self.precision,
            self.stream.state % self.precision,
        );
        let symbol = self.table[rest as usize];
        let [share, before] = self.shares[symbol as usize];
        self.stream.state = quotient * share + rest - before;
        symbol
    }
}

/// The signed number of an unsigned one: even ones are not negative.
pub(super) fn signed(value: u32) -> i32 {
    let half = (value >> 1) as i32;
    if value & 1 == 1 { -half - 1 } else { half }
}
