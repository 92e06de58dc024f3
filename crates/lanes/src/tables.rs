//! Tables by masks of eight lanes.

/// For each mask of eight lanes, the lanes of its set bits in their order, then zeros.
pub static COMPRESS: [[u32; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut place) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask][place] = lane as u32;
                place += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

/// `FLIPPED[flip][mask]`: `mask` with bit `i` moved to place `i ^ flip`.
static FLIPPED: [[u8; 256]; 8] = {
    let mut table = [[0; 256]; 8];
    let mut flip = 0;
    while flip < 8 {
        let mut mask = 0;
        while mask < 256 {
            let mut bit = 0;
            while bit < 8 {
                table[flip][mask] |= ((mask >> bit & 1) << (bit ^ flip)) as u8;
                bit += 1;
            }
            mask += 1;
        }
        flip += 1;
    }
    table
};

/// `mask` with bit `i` moved to place `i ^ flip`.
#[inline(always)]
pub fn flip_mask(mask: u32, flip: u32) -> u32 {
    u32::from(FLIPPED[flip as usize & 7][mask as usize & 255])
}

/// For each mask of eight lanes, all bits set in the lanes of its set bits.
pub static SELECT: [[u32; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let mut lane = 0;
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask][lane] = u32::MAX;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};
