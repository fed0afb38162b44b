//! Numerical quadrature (floor 0): adaptive for the reference methods, Gauss-Legendre with running integrals for the
//! fast ones.

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

/// Nodes in `(0, 1)`, ascending, and weights of the `n`-point Gauss-Legendre rule.
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let count = n as f64;
    let mut rule: Vec<(f64, f64)> = (0..n)
        .map(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (count + 0.5)).cos();
            let mut slope = 1.0;
            // Newton's method on the Legendre polynomial doubles the digits each time.
            for _ in 0..8 {
                let (mut p, mut before) = (1.0, 0.0);
                for k in 0..n {
                    let k = k as f64;
                    (p, before) = (((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0), p);
                }
                slope = count * (x * p - before) / (x * x - 1.0);
                x -= p / slope;
            }
            (0.5 - 0.5 * x, 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect();
    rule.sort_by(|a, b| a.0.total_cmp(&b.0));
    rule
}

/// Gauss-Legendre rule of `N` points on `[0, 1]` with the running integral of what was sampled at them.
#[derive(Debug, Clone)]
pub struct Gauss<const N: usize> {
    /// Nodes.
    pub nodes: [f64; N],
    /// Weights.
    pub weights: [f64; N],
    /// `running[j][i]`: what the sample at node `j` adds to the integral from 0 to node `i`.
    pub running: [[f64; N]; N],
}

impl<const N: usize> Gauss<N> {
    /// The rule.
    pub fn new() -> Self {
        let rule = gauss_legendre(N);
        let (nodes, weights) = (std::array::from_fn(|i| rule[i].0), std::array::from_fn(|i| rule[i].1));
        let at: &[f64; N] = &nodes;
        let basis =
            |j: usize, x: f64| -> f64 { (0..N).filter(|&k| k != j).map(|k| (x - at[k]) / (at[j] - at[k])).product() };
        let running = std::array::from_fn(|j| {
            std::array::from_fn(|i| at[i] * rule.iter().map(|&(x, w)| w * basis(j, at[i] * x)).sum::<f64>())
        });
        Self { nodes, weights, running }
    }
}

impl<const N: usize> Default for Gauss<N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_integrates_polynomials_and_runs_along() {
        let rule = Gauss::<12>::new();
        let total: f64 = rule.nodes.iter().zip(rule.weights).map(|(x, w)| w * x.powi(23)).sum();
        assert!((total - 1.0 / 24.0).abs() < 1e-15, "degree 23 is exact: {total}");
        for i in 0..12 {
            let run: f64 = (0..12).map(|j| rule.running[j][i] * rule.nodes[j].powi(11)).sum();
            assert!((run - rule.nodes[i].powi(12) / 12.0).abs() < 1e-14, "degree 11 runs exactly: {run}");
        }
    }

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
