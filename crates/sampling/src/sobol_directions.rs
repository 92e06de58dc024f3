//! Direction numbers of Sobol's sequence.

/// Dimensions that are stratified together.
pub(crate) const GROUP: usize = 4;

/// Direction numbers of four dimensions, with their bits reversed: `[bit of the index][dimension]`.
/// Reversed, because the scrambling hash works from the highest bit of a coordinate down and
/// integer arithmetic carries upwards.
pub(crate) const REVERSED_DIRECTIONS: [[u32; GROUP]; 32] = {
    // (degree s, inner coefficients a_1 … a_{s−1} of the primitive polynomial, initial m_1 …
    // m_s)
    const POLYNOMIALS: [(usize, u32, [u32; 3]); 3] =
        [(1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1])];
    let mut directions = [[0; GROUP]; 32];
    let mut dimension = 0;
    while dimension < GROUP {
        let mut m = [1u32; 32];
        let mut k = 0;
        while k < 32 {
            if dimension > 0 {
                let (degree, coefficients, initial) = POLYNOMIALS[dimension - 1];
                m[k] = if k < degree {
                    initial[k]
                } else {
                    // m_k = 2 a_1 m_{k−1} ⊕ 4 a_2 m_{k−2} ⊕ … ⊕ 2^s m_{k−s} ⊕
                    // m_{k−s}
                    let mut value = m[k - degree] ^ (m[k - degree] << degree);
                    let mut i = 1;
                    while i < degree {
                        if coefficients >> (degree - 1 - i) & 1 == 1 {
                            value ^= m[k - i] << i;
                        }
                        i += 1;
                    }
                    value
                };
            }
            directions[k][dimension] = (m[k] << (31 - k)).reverse_bits();
            k += 1;
        }
        dimension += 1;
    }
    directions
};
