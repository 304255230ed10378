//! Eight 32-bit floats at once: one trait, one implementation that any machine runs and one for AVX2 with FMA.
//!
//! Both round every operation alike (multiply-add is fused in both), so results do not depend on the machine.

use std::ops::{Add, Mul, Neg, Sub};

/// How many numbers are worked on at once.
pub const WIDTH: usize = 8;

/// Eight numbers as they lie in memory.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(32))]
pub struct Row(pub [f32; WIDTH]);

/// Eight numbers in a register.
pub trait Lanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> {
    /// The same number eight times.
    fn splat(x: f32) -> Self;
    /// From memory.
    fn load(row: &Row) -> Self;
    /// To memory.
    fn store(self, row: &mut Row);
    /// `self * a + b`, rounded once.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// The lesser of each pair.
    fn min(self, other: Self) -> Self;
    /// The greater of each pair.
    fn max(self, other: Self) -> Self;
    /// Without signs.
    fn abs(self) -> Self;
    /// Square roots.
    fn sqrt(self) -> Self;
    /// Towards minus infinity.
    fn floor(self) -> Self;
    /// A bit for every lane where `self < other`, the first one lowest.
    fn below(self, other: Self) -> u32;
    /// `yes` in the lanes where `self < other`, else `no`.
    fn pick_below(self, other: Self, yes: Self, no: Self) -> Self;
}

/// Something that runs on lanes, whichever they are.
pub trait Kernel {
    /// What comes of it.
    type Output;
    /// Runs it; must be inlined into its caller.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// Runs a kernel on the widest lanes this machine has.
#[inline]
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if avx::present() {
        return avx::run(kernel);
    }
    kernel.run::<Plain>()
}

/// Eight numbers one by one: what any machine runs.
#[derive(Clone, Copy)]
pub struct Plain([f32; WIDTH]);

impl Plain {
    #[inline(always)]
    fn each(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
}

impl Add for Plain {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.each(other, |a, b| a + b)
    }
}

impl Sub for Plain {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.each(other, |a, b| a - b)
    }
}

impl Mul for Plain {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.each(other, |a, b| a * b)
    }
}

impl Neg for Plain {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|a| -a))
    }
}

impl Lanes for Plain {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; WIDTH])
    }
    #[inline(always)]
    fn load(row: &Row) -> Self {
        Self(row.0)
    }
    #[inline(always)]
    fn store(self, row: &mut Row) {
        row.0 = self.0;
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].mul_add(a.0[i], b.0[i])))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.each(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.each(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self(self.0.map(f32::floor))
    }
    #[inline(always)]
    fn below(self, other: Self) -> u32 {
        (0..WIDTH).fold(0, |bits, i| bits | (u32::from(self.0[i] < other.0[i]) << i))
    }
    #[inline(always)]
    fn pick_below(self, other: Self, yes: Self, no: Self) -> Self {
        Self(std::array::from_fn(|i| if self.0[i] < other.0[i] { yes.0[i] } else { no.0[i] }))
    }
}

/// Eight numbers in one AVX register.
///
/// Why the unsafe blocks are sound: a [`Wide`](avx::Wide) is private to this module and its operations are reached
/// only from [`run`](avx::run), which checks that the machine has AVX2 and FMA. No operation touches memory but
/// `load` and `store`, whose [`Row`] is aligned to 32 bytes and borrowed.
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx {
    use super::{Add, Kernel, Lanes, Mul, Neg, Row, Sub};
    use std::arch::x86_64::*;

    #[derive(Clone, Copy)]
    struct Wide(__m256);

    /// Whether this machine has what [`run`] needs.
    #[inline]
    pub(super) fn present() -> bool {
        is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
    }

    /// Runs a kernel on [`Wide`] lanes, or on plain ones where the machine lacks them.
    #[inline]
    pub(super) fn run<K: Kernel>(kernel: K) -> K::Output {
        if present() {
            // SAFETY: the features were just found.
            unsafe { featured(kernel) }
        } else {
            kernel.run::<super::Plain>()
        }
    }

    #[target_feature(enable = "avx,avx2,fma")]
    fn featured<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Wide>()
    }

    impl Add for Wide {
        type Output = Self;
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            // SAFETY: see the module.
            Self(unsafe { _mm256_add_ps(self.0, other.0) })
        }
    }

    impl Sub for Wide {
        type Output = Self;
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            // SAFETY: see the module.
            Self(unsafe { _mm256_sub_ps(self.0, other.0) })
        }
    }

    impl Mul for Wide {
        type Output = Self;
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            // SAFETY: see the module.
            Self(unsafe { _mm256_mul_ps(self.0, other.0) })
        }
    }

    impl Neg for Wide {
        type Output = Self;
        #[inline(always)]
        fn neg(self) -> Self {
            // SAFETY: see the module.
            Self(unsafe { _mm256_xor_ps(self.0, _mm256_set1_ps(-0.0)) })
        }
    }

    impl Lanes for Wide {
        #[inline(always)]
        fn splat(x: f32) -> Self {
            // SAFETY: see the module.
            Self(unsafe { _mm256_set1_ps(x) })
        }
        #[inline(always)]
        fn load(row: &Row) -> Self {
            // SAFETY: see the module.
            Self(unsafe { _mm256_load_ps(row.0.as_ptr()) })
        }
        #[inline(always)]
        fn store(self, row: &mut Row) {
            // SAFETY: see the module.
            unsafe { _mm256_store_ps(row.0.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn mul_add(self, a: Self, b: Self) -> Self {
            // SAFETY: see the module.
            Self(unsafe { _mm256_fmadd_ps(self.0, a.0, b.0) })
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            // SAFETY: see the module.
            Self(unsafe { _mm256_min_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            // SAFETY: see the module.
            Self(unsafe { _mm256_max_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            // SAFETY: see the module.
            Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            // SAFETY: see the module.
            Self(unsafe { _mm256_sqrt_ps(self.0) })
        }
        #[inline(always)]
        fn floor(self) -> Self {
            // SAFETY: see the module.
            Self(unsafe { _mm256_floor_ps(self.0) })
        }
        #[inline(always)]
        fn below(self, other: Self) -> u32 {
            // SAFETY: see the module.
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) as u32 }
        }
        #[inline(always)]
        fn pick_below(self, other: Self, yes: Self, no: Self) -> Self {
            // SAFETY: see the module.
            Self(unsafe { _mm256_blendv_ps(no.0, yes.0, _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) })
        }
    }
}

/// Sines and cosines, within 2e-7 for angles up to 100 rad.
///
/// The polynomials are the usual minimax ones of single-precision libraries on a quarter turn about zero.
#[inline(always)]
pub fn sin_cos<L: Lanes>(x: L) -> (L, L) {
    let quarters = x.mul_add(L::splat(std::f32::consts::FRAC_2_PI), L::splat(0.5)).floor();
    // A quarter turn in two parts: the first one is exact times small whole numbers.
    let r = quarters.mul_add(L::splat(-1.570_312_5), x);
    let r = quarters.mul_add(L::splat(-4.838_268e-4), r);
    let z = r * r;
    let sine = z
        .mul_add(L::splat(-1.951_529_6e-4), L::splat(8.332_161e-3))
        .mul_add(z, L::splat(-1.666_665_5e-1))
        .mul_add(z * r, r);
    let cosine = z
        .mul_add(L::splat(2.443_315_7e-5), L::splat(-1.388_731_6e-3))
        .mul_add(z, L::splat(4.166_664_6e-2))
        .mul_add(z * z, z.mul_add(L::splat(-0.5), L::splat(1.0)));
    // The quarter the angle is in: 0, 1, 2 or 3, then what is odd about it.
    let quarter = (quarters * L::splat(0.25)).floor().mul_add(L::splat(-4.0), quarters);
    let half = (quarter * L::splat(0.5)).floor();
    let odd = half.mul_add(L::splat(-2.0), quarter);
    let (s, c) = (odd.pick_below(L::splat(0.5), sine, cosine), odd.pick_below(L::splat(0.5), cosine, sine));
    let second = half.pick_below(L::splat(0.5), s, -s);
    let flip = (half + odd).pick_below(L::splat(0.5), c, -c);
    let both = (half + odd).pick_below(L::splat(1.5), flip, c);
    (second, both)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Angles([f32; WIDTH]);
    impl Kernel for Angles {
        type Output = [[f32; WIDTH]; 2];
        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let (s, c) = sin_cos(L::load(&Row(self.0)));
            let (mut a, mut b) = (Row::default(), Row::default());
            s.store(&mut a);
            c.store(&mut b);
            [a.0, b.0]
        }
    }

    #[test]
    fn sines_are_right_and_alike_on_every_path() {
        for k in -20_000..20_000_i32 {
            let x: [f32; WIDTH] = std::array::from_fn(|i| k as f32 * 0.001 + i as f32 * 1.7);
            let [s, c] = dispatch(Angles(x));
            assert_eq!([s, c], Angles(x).run::<Plain>());
            for i in 0..WIDTH {
                let (es, ec) = f64::from(x[i]).sin_cos();
                assert!((f64::from(s[i]) - es).abs() < 3e-7, "sin {} = {} {}", x[i], s[i], es);
                assert!((f64::from(c[i]) - ec).abs() < 3e-7, "cos {} = {} {}", x[i], c[i], ec);
            }
        }
    }
}
