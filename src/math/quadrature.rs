//! Adaptive quadrature for the reference methods (floor 0).

/// Positive nodes of the 15-point Kronrod rule, and its weights; odd entries are the nodes of the 7-point Gauss rule.
const NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];
const GAUSS: [f64; 4] =
    [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_93, 0.417_959_183_673_469_4];

/// Integral of `f` over `[a, b]` to about the absolute error `tolerance`, by bisection of a Gauss-Kronrod pair.
pub fn adaptive(f: &mut impl FnMut(f64) -> f64, a: f64, b: f64, tolerance: f64) -> f64 {
    bisect(f, a, b, tolerance, 24)
}

fn bisect(f: &mut impl FnMut(f64) -> f64, a: f64, b: f64, tolerance: f64, levels: u32) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let centre = f(middle);
    let mut kronrod = KRONROD[7] * centre;
    let mut gauss = GAUSS[3] * centre;
    for i in 0..7 {
        let pair = f(middle - half * NODES[i]) + f(middle + half * NODES[i]);
        kronrod += KRONROD[i] * pair;
        if i % 2 == 1 {
            gauss += GAUSS[i / 2] * pair;
        }
    }
    if ((kronrod - gauss) * half).abs() <= tolerance || levels == 0 {
        return kronrod * half;
    }
    bisect(f, a, middle, 0.5 * tolerance, levels - 1) + bisect(f, middle, b, 0.5 * tolerance, levels - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrals_with_a_closed_form() {
        let e = adaptive(&mut |x: f64| (-x).exp(), 0.0, 30.0, 1e-12);
        assert!((e - (1.0 - (-30.0_f64).exp())).abs() < 1e-11, "decay: {e}");
        let kink = adaptive(&mut |x: f64| (x - 0.3).abs(), 0.0, 1.0, 1e-10);
        assert!((kink - 0.29).abs() < 1e-9, "kink: {kink}");
        let narrow = adaptive(&mut |x: f64| 1.0 / (1e-6 + (x - 0.5).powi(2)), 0.0, 1.0, 1e-6);
        let exact = 2.0e3 * (0.5e3_f64).atan();
        assert!((narrow - exact).abs() < 1e-4, "narrow peak: {narrow} against {exact}");
        let polynomial = adaptive(&mut |x: f64| x.powi(12), -1.0, 1.0, 1e-3);
        assert!((polynomial - 2.0 / 13.0).abs() < 1e-14, "degree 12 is exact without bisection: {polynomial}");
    }
}
